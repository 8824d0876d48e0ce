"""8-bit static quantisation of a YOLOv8-seg ONNX model, in the QDQ format.

Real value = scale * (integer - zero point) (Jacob et al., "Quantization and Training of Neural Networks for
Efficient Integer-Arithmetic-Only Inference", CVPR 2018). Every tensor that is to be 8-bit gets a pair
QuantizeLinear, DequantizeLinear behind it; ONNX Runtime fuses the pairs around an operator into its integer
version (its documentation, "Quantize ONNX models", QDQ format). Weights are signed and symmetric with one
scale per output channel, activations unsigned with one scale and zero point per tensor: the combination
that the VNNI instruction multiplies (u8 x s8).

8-bit become the convolutions with an activation (SiLU) behind them, which is all of the backbone and neck
and most of the head, and what passes their results on. Left in float are the bare convolutions that make box
bins, class scores and mask coefficients, and all that decodes them: little work, and it hurts most there.
"""

import tempfile

import numpy as np
import onnx
from onnx import helper, numpy_helper

from graph import consumers
from runtime import Session

ACTIVATION_STEPS = 255
TINY = np.finfo(np.float32).tiny  # a tensor or channel that is all 0 still needs a scale
FLOAT_AGAIN = "_dequantized"  # behind the name of a tensor: its value after the pair
# What moves values about without changing them: one scale must serve input and output.
MOVERS = {"MaxPool", "Resize", "Slice", "Split"}
# What passes 8-bit values on to further 8-bit operators.
PASSING = MOVERS | {"Add", "Concat"}


def quantize(model, library, images, weight_bits=8, threads=1):
    """Changes the model to 8 bits, with the ranges that its tensors take on the (letterboxed) images.

    Without VNNI, x86 processors add two products in 16 bits, which overflow with 8-bit weights: 7 for these.
    """
    graph = model.graph
    convolutions = _activated_convolutions(graph)
    if not convolutions:
        raise SystemExit("no convolution with a SiLU behind it was found: not a float YOLOv8 model")
    groups = _quantized_tensors(graph, convolutions)
    ranges = _calibrate(model, library, images, sorted({t for g in groups for t in g}), threads)
    parameters = {}
    for group in groups:
        low = min(ranges[t][0] for t in group)
        high = max(ranges[t][1] for t in group)
        parameters.update(dict.fromkeys(group, _affine(low, high)))
    _quantize_weights(graph, convolutions, parameters, 2 ** (weight_bits - 1) - 1)
    _insert_pairs(graph, parameters)


def _activated_convolutions(graph):
    """The Conv nodes whose result goes through x * sigmoid(x)."""
    readers = consumers(graph)
    return [
        node
        for node in graph.node
        if node.op_type == "Conv" and {r.op_type for r in readers.get(node.output[0], [])} == {"Sigmoid", "Mul"}
    ]


def _quantized_tensors(graph, convolutions):
    """The tensors to be 8-bit, grouped by common scale."""
    readers = consumers(graph)
    constant = {t.name for t in graph.initializer}
    silu = set()
    for node in convolutions:
        silu.add(node.output[0])
        for reader in readers[node.output[0]]:
            silu.add(reader.output[0])
    chosen = {t for t in silu if t in readers} | {node.input[0] for node in convolutions}
    partner = {t: t for t in chosen}

    def find(t):
        while partner[t] != t:
            t = partner[t]
        return t

    for node in graph.node:
        data = [t for t in node.input if t and t not in constant]
        if node.op_type in PASSING and data and all(t in chosen for t in data):
            for t in node.output:
                chosen.add(t)
                partner.setdefault(t, t)
            if node.op_type in MOVERS:
                for t in node.output:
                    partner[find(t)] = find(data[0])
    groups = {}
    for t in chosen:
        groups.setdefault(find(t), []).append(t)
    return [sorted(g) for _, g in sorted(groups.items())]


def _calibrate(model, library, images, tensors, threads):
    """[low, high] of each tensor: the least and greatest value of an image, averaged over the images.

    The average (a moving one in Jacob et al., section 3.1) rather than the extreme: one odd image does not
    widen the range for all.
    """
    observer = onnx.ModelProto()
    observer.CopyFrom(model)
    inputs = [v.name for v in observer.graph.input]
    del observer.graph.output[:]
    names = []
    for t in tensors:
        for kind in ("Min", "Max"):
            name = f"{t}_{kind}"
            observer.graph.node.append(helper.make_node(f"Reduce{kind}", [t], [name], keepdims=0))
            observer.graph.output.append(helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, []))
            names.append(name)
    with tempfile.NamedTemporaryFile(suffix=".onnx") as file:
        onnx.save(observer, file.name)
        session = Session(library, file.name, inputs, names, threads)
        seen = np.array([session.run(image.array) for image in images]).reshape(len(images), len(tensors), 2)
        session.close()
    return dict(zip(tensors, seen.mean(axis=0)))


def _affine(low, high):
    """(scale, zero point) so that 0..255 covers low..high and 0 is met exactly (padding is 0)."""
    low, high = min(low, 0.0), max(high, 0.0)
    scale = max(high - low, TINY) / ACTIVATION_STEPS
    return np.float32(scale), np.uint8(np.clip(round(-low / scale), 0, ACTIVATION_STEPS))


def _constant(graph, name, array):
    graph.initializer.append(numpy_helper.from_array(array, name))
    return name


def _insert_pairs(graph, parameters):
    """Behind each tensor its pair; all readers take the pair's result."""
    nodes = [pair for value in graph.input for pair in _pair(graph, value.name, parameters)]
    for node in graph.node:
        for i, name in enumerate(node.input):
            if name in parameters:
                node.input[i] = name + FLOAT_AGAIN
        nodes.append(node)
        nodes.extend(pair for name in node.output for pair in _pair(graph, name, parameters))
    _set_nodes(graph, nodes)


def _pair(graph, name, parameters):
    """The nodes that take a tensor to 8 bits and back; none for a tensor that stays float."""
    if name not in parameters:
        return []
    scale, zero = parameters[name]
    by = [_constant(graph, f"{name}_scale", np.array(scale)), _constant(graph, f"{name}_zero", np.array(zero))]
    return [
        helper.make_node("QuantizeLinear", [name, *by], [f"{name}_8bit"], f"{name}_quantize"),
        helper.make_node("DequantizeLinear", [f"{name}_8bit", *by], [name + FLOAT_AGAIN], f"{name}_dequantize"),
    ]


def _set_nodes(graph, nodes):
    copies = onnx.GraphProto()
    copies.node.extend(nodes)
    graph.ClearField("node")
    graph.node.extend(copies.node)


def _quantize_weights(graph, convolutions, parameters, largest_integer):
    """Weights to int8 per output channel, bias to int32 in units of input scale times weight scale."""
    stored = {t.name: t for t in graph.initializer}
    restored = []
    for node in convolutions:
        weights = numpy_helper.to_array(stored[node.input[1]])
        largest = np.abs(weights).reshape(len(weights), -1).max(axis=1)
        scale = np.maximum(largest, TINY) / np.float32(largest_integer)
        integers = np.rint(weights / scale.reshape(-1, 1, 1, 1)).astype(np.int8)
        restored.append(_dequantized(graph, stored[node.input[1]], integers, scale))
        if len(node.input) > 2:
            bias = numpy_helper.to_array(stored[node.input[2]])
            bias_scale = scale * parameters[node.input[0]][0]
            restored.append(_dequantized(graph, stored[node.input[2]], _to_int32(bias / bias_scale), bias_scale))
    _set_nodes(graph, [*restored, *graph.node])


def _to_int32(values):
    limits = np.iinfo(np.int32)
    return np.clip(np.rint(values.astype(np.float64)), limits.min, limits.max).astype(np.int32)


def _dequantized(graph, tensor, integers, scale):
    """Replaces a float initializer by integers; returns the node that makes floats of them again."""
    name = tensor.name
    graph.initializer.remove(tensor)
    inputs = [
        _constant(graph, f"{name}_integers", integers),
        _constant(graph, f"{name}_scale", scale),
        _constant(graph, f"{name}_zero", np.zeros(len(scale), integers.dtype)),
    ]
    return helper.make_node("DequantizeLinear", inputs, [name], f"{name}_dequantize", axis=0)

