"""How much faster a second model is, and how far its detections are those of the first."""

import time
from dataclasses import dataclass

import numpy as np
from PIL import Image

from images import letterbox

MIN_SCORE = 0.3
NMS_IOU = 0.5
MATCH_IOU = 0.5
BOX_ROWS = 4  # rows of output0 before the class scores
PROTOTYPE_STRIDE = 4


@dataclass
class Detection:
    box: np.ndarray  # left, top, right, bottom in the picture's pixels
    score: float
    mask: np.ndarray  # bool, of the picture's size


def detect(session, image, class_id):
    """The instances of one class that a network finds in a letterboxed picture, best first."""
    output, prototypes = (o[0] for o in session.run(image.array))
    coefficients_from = len(output) - len(prototypes)
    scores = output[BOX_ROWS + class_id]
    is_best = output[BOX_ROWS:coefficients_from].max(axis=0) == scores
    found = []
    for i in sorted(np.flatnonzero(is_best & (scores >= MIN_SCORE)), key=lambda i: -scores[i]):
        x, y, w, h = output[:BOX_ROWS, i]
        corners = np.array([x - w / 2, y - h / 2, x + w / 2, y + h / 2])
        box = (corners - np.tile(image.border, 2)) / image.scale
        if all(box_iou(box, d.box) <= NMS_IOU for d in found):
            logits = np.tensordot(output[coefficients_from:, i], prototypes, 1)
            found.append(Detection(box, float(scores[i]), _mask(logits, image, box)))
    return found


def _mask(logits, image, box):
    """Where the prototypes' sum is above 0 (sigmoid above 0.5) inside the box, at the picture's resolution."""
    width, height = image.picture_size
    first = np.array(image.border)
    last = first + np.array(image.picture_size) * image.scale
    region = tuple(np.concatenate([first, last]) / PROTOTYPE_STRIDE)
    on = np.asarray(Image.fromarray(logits).resize((width, height), Image.BILINEAR, region)) > 0
    x, y = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    return on & (x >= box[0]) & (x < box[2]) & (y >= box[1]) & (y < box[3])


def box_iou(a, b):
    sides = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    common = np.prod(np.maximum(sides, 0.0))
    return common / (np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - common)


def match(first, second):
    """Pairs of detections whose boxes overlap enough, the best overlap first, each detection once."""
    candidates = sorted(((box_iou(a.box, b.box), i, j) for i, a in enumerate(first) for j, b in enumerate(second)))
    pairs, used_first, used_second = [], set(), set()
    for overlap, i, j in reversed(candidates):
        if overlap > MATCH_IOU and i not in used_first and j not in used_second:
            pairs.append((first[i], second[j]))
            used_first.add(i)
            used_second.add(j)
    return pairs


@dataclass
class Agreement:
    first: int  # detections of the first model
    second: int
    box_ious: list  # of the matched pairs
    mask_ious: list


def agreement(sessions, sizes, files, class_id):
    """Over all pictures, the instances of a class that two sessions find."""
    result = Agreement(0, 0, [], [])
    for file in files:
        first, second = (detect(s, letterbox(file, size), class_id) for s, size in zip(sessions, sizes))
        result.first += len(first)
        result.second += len(second)
        for a, b in match(first, second):
            result.box_ious.append(box_iou(a.box, b.box))
            result.mask_ious.append((a.mask & b.mask).sum() / max((a.mask | b.mask).sum(), 1))
    return result


def run_times(sessions, images, runs):
    """Milliseconds per run, [runs, sessions]; the sessions take turns, so that a busy machine slows all alike."""
    for session, image in zip(sessions, images):
        session.run(image.array)  # the first run also allocates
    times = np.zeros((runs, len(sessions)))
    for run in range(runs):
        for k, (session, image) in enumerate(zip(sessions, images)):
            start = time.perf_counter()
            session.run(image.array)
            times[run, k] = (time.perf_counter() - start) * 1e3
    return times
