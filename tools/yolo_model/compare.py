"""How much faster a second model is, and how far its detections are those of the first."""

import time
from dataclasses import dataclass

import numpy as np

from images import letterbox
from runtime import Session

MIN_SCORE = 0.3
NMS_IOU = 0.5
MATCH_IOU = 0.5
BOX_ROWS = 4  # rows of output0 before the class scores
PROTOTYPE_STRIDE = 4


@dataclass
class Detection:
    box: np.ndarray  # left, top, right, bottom in the picture's pixels
    score: float
    mask: np.ndarray  # bool, at the resolution of the prototypes


def detect(outputs, class_id, scale, border):
    """The instances of one class in a network's outputs, best first."""
    rows, prototypes = outputs[0][0], outputs[1][0]
    coefficients_from = len(rows) - len(prototypes)
    scores = rows[BOX_ROWS + class_id]
    best = (rows[BOX_ROWS:coefficients_from].max(axis=0) == scores) & (scores >= MIN_SCORE)
    candidates = sorted(np.flatnonzero(best), key=lambda i: -scores[i])
    found = []
    for i in candidates:
        x, y, w, h = rows[:BOX_ROWS, i]
        corners = np.array([x - w / 2, y - h / 2, x + w / 2, y + h / 2])
        box = (corners - np.tile(border, 2)) / scale
        if all(box_iou(box, d.box) <= NMS_IOU for d in found):
            mask = np.tensordot(rows[coefficients_from:, i], prototypes, 1) > 0
            found.append(Detection(box, float(scores[i]), mask & _inside(corners, mask.shape)))
    return found


def _inside(corners, shape):
    left, top, right, bottom = corners / PROTOTYPE_STRIDE
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    return (x >= left) & (x < right) & (y >= top) & (y < bottom)


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
    first: int = 0  # detections of the first model
    second: int = 0
    matched: int = 0
    box_iou: float = 0.0  # mean over the matched
    mask_iou: float = 0.0  # mean over the matched; nan if the models' sizes differ
    worst_mask_iou: float = 0.0


def agreement(sessions, sizes, files, class_id):
    """Over all pictures, the instances of a class that two sessions find."""
    result, boxes, masks = Agreement(), [], []
    for file in files:
        found = []
        for session, size in zip(sessions, sizes):
            image, scale, border = letterbox(file, size)
            found.append(detect(session.run(image), class_id, scale, border))
        pairs = match(*found)
        result.first += len(found[0])
        result.second += len(found[1])
        result.matched += len(pairs)
        boxes += [box_iou(a.box, b.box) for a, b in pairs]
        if sizes[0] == sizes[1]:
            masks += [(a.mask & b.mask).sum() / max((a.mask | b.mask).sum(), 1) for a, b in pairs]
    if boxes:
        result.box_iou = float(np.mean(boxes))
        result.mask_iou = float(np.mean(masks)) if masks else float("nan")
        result.worst_mask_iou = float(np.min(masks)) if masks else float("nan")
    return result


def run_times(sessions, images, runs):
    """Milliseconds per run, [runs, sessions]; the sessions take turns, so that a busy machine slows all alike."""
    for session, image in zip(sessions, images):
        session.run(image)
    times = np.zeros((runs, len(sessions)))
    for run in range(runs):
        for k, (session, image) in enumerate(zip(sessions, images)):
            start = time.perf_counter()
            session.run(image)
            times[run, k] = (time.perf_counter() - start) * 1e3
    return times
