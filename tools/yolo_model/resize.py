"""Another input size for a YOLOv8-seg ONNX export of fixed size.

The convolutions do not care about the size. What an export freezes is: the shapes that Reshape is given, the
cell centres ("anchors", in cells) and the cells' strides (in pixels) that decode the boxes, and the shapes
declared for input and outputs. All of them follow from the size (ultralytics/utils/tal.py describes the
anchors: one per cell, centred, row by row, levels 8, 16, 32).
"""

import numpy as np
from onnx import numpy_helper

from graph import STRIDES, dimensions, input_size, overwrite, set_dimensions

ADVICE = "export at the new size instead"
TARGET_SHAPE = {"Reshape": 1, "Resize": 3}  # which input of an operator is the shape of its result
ANCHOR_TOLERANCE = 0.5  # cells; weights that went through 8 bits have rounded anchors
STRIDE_TOLERANCE = 0.01  # relative


def resize(model, size):
    """Changes the model to an input of `size` = (width, height), multiples of 32."""
    graph = model.graph
    if any(side % STRIDES[-1] or side <= 0 for side in size):
        raise SystemExit(f"a size of {size[0]}x{size[1]}: both sides must be multiples of {STRIDES[-1]}")
    old = input_size(model)
    if all(old):
        _resize_reshapes(graph, old, size)
        _resize_decoder(graph, old, size)
    _, channels, _ = dimensions(graph.output[0])
    _, prototypes, _, _ = dimensions(graph.output[1])
    width, height = size
    set_dimensions(graph.input[0], [1, 3, height, width])
    set_dimensions(graph.output[0], [1, channels, _cells(size)])
    set_dimensions(graph.output[1], [1, prototypes, height // 4, width // 4])
    del graph.value_info[:]  # shapes inside, which now are wrong; a runtime infers them


def _level(size, stride):
    """(width, height) of a level in cells."""
    return size[0] // stride, size[1] // stride


def _cells(size):
    return sum(w * h for w, h in (_level(size, s) for s in STRIDES))


def _resize_reshapes(graph, old, new):
    """The target shapes that count cells: [.., cells], of one level or all, or [.., height, width] of a level."""
    counts = {_cells(old): _cells(new)}
    grids = {}
    for stride in STRIDES:
        (old_w, old_h), (new_w, new_h) = _level(old, stride), _level(new, stride)
        counts[old_w * old_h] = new_w * new_h
        grids[(old_h, old_w)] = [new_h, new_w]
    shaping = [(n, TARGET_SHAPE[n.op_type]) for n in graph.node if n.op_type in TARGET_SHAPE]
    targets = {n.input[place] for n, place in shaping if len(n.input) > place}
    for tensor in graph.initializer:
        if tensor.name not in targets:
            continue
        shape = numpy_helper.to_array(tensor).copy()
        if len(shape) == 4 and tuple(shape[2:]) in grids:
            shape[2:] = grids[tuple(shape[2:])]
        elif shape[-1] in counts:
            shape[-1] = counts[shape[-1]]
        overwrite(tensor, shape)


def _resize_decoder(graph, old, new):
    """The float constants with one entry per cell: anchors [.., 2, A] and strides [.., 1 or 4, A]."""
    kinds = set()
    for tensor in graph.initializer:
        value = numpy_helper.to_array(tensor)
        if value.dtype != np.float32 or value.ndim == 0 or value.shape[-1] != _cells(old):
            continue
        rows = value.reshape(-1, _cells(old))
        kind = "anchors" if len(rows) == 2 else "strides"
        _check(tensor.name, kind, rows, old)
        made = anchors(new) if kind == "anchors" else np.tile(strides(new), (len(rows), 1))
        overwrite(tensor, made.reshape(*value.shape[:-1], -1))
        kinds.add(kind)
    if kinds != {"anchors", "strides"}:
        raise SystemExit(f"the anchors and strides of a YOLOv8 box decoder were not found; {ADVICE}")


def anchors(size):
    """[2, A]: x and y of the centre of every cell, in cells of its level."""
    grids = []
    for stride in STRIDES:
        width, height = _level(size, stride)
        y, x = np.mgrid[:height, :width] + 0.5
        grids.append(np.stack([x.ravel(), y.ravel()]))
    return np.concatenate(grids, axis=1)


def strides(size):
    """[A]: pixels per cell."""
    return np.concatenate([np.full(w * h, s) for s in STRIDES for w, h in [_level(size, s)]]).astype(np.float64)


def _check(name, kind, rows, size):
    """That a constant is what it is taken for."""
    if kind == "anchors":
        right = np.abs(rows - anchors(size)).max() <= ANCHOR_TOLERANCE
    else:
        right = np.abs(rows / strides(size) - 1.0).max() <= STRIDE_TOLERANCE
    if not right:
        raise SystemExit(f"{name} does not hold the {kind} of a YOLOv8 box decoder; {ADVICE}")
