"""What the tools need to know of an Ultralytics YOLOv8-seg graph (YOLO11-seg has the same outside)."""

import onnx
from onnx import numpy_helper

STRIDES = (8, 16, 32)  # input pixels per cell of the three levels that detect
PER_AXIS_OPSET = 13  # the first with one quantisation scale per channel
CHANGED_IN_13 = {"Squeeze", "Unsqueeze", "ReduceSum"}  # an attribute became an input


def load(file):
    """The model at opset 13 or later."""
    try:
        model = onnx.load(file)
    except Exception as error:  # whatever protobuf or the file system has to say
        raise SystemExit(f"{file} is not an ONNX model that can be read: {error}") from None
    onnx_set = next((o for o in model.opset_import if o.domain in ("", "ai.onnx")), None)
    ranks = [len(dimensions(v)) for v in [*model.graph.input, *model.graph.output]]
    if onnx_set is None or ranks != [4, 3, 4]:
        raise SystemExit(f"{file}: expected images[1,3,H,W] -> output0[1,116,A], output1[1,32,H/4,W/4] (YOLOv8-seg)")
    if onnx_set.version < PER_AXIS_OPSET:
        _upgrade(file, model.graph)
        onnx_set.version = PER_AXIS_OPSET
    _collect_constants(model.graph)
    return model


def _upgrade(file, graph):
    """Rewrites the operators whose meaning changed in opset 13."""
    for node in list(graph.node):
        if node.op_type in CHANGED_IN_13:
            raise SystemExit(f"{file}: {node.op_type} of an opset below {PER_AXIS_OPSET}; export with opset=17")
        if node.op_type == "Split":
            sizes = onnx.helper.get_attribute_value(next(a for a in node.attribute if a.name == "split"))
            name = f"{node.output[0]}_sizes"
            graph.initializer.append(onnx.helper.make_tensor(name, onnx.TensorProto.INT64, [len(sizes)], sizes))
            node.input.append(name)
            kept = [a for a in node.attribute if a.name != "split"]
            del node.attribute[:]
            node.attribute.extend(kept)
        # Softmax is left alone. Before opset 13 it ran over all axes from the given one on; the box decoder
        # means the 16 bins alone, which is the same only if they are last. Some converters wrote axis 1 of
        # [1, 16, 4, A] under opset 12: boxes of no size, mended by the newer reading.


def _collect_constants(graph):
    """Makes initializers of Constant nodes, so that a constant lies in one place."""
    for node in [n for n in graph.node if n.op_type == "Constant" and n.attribute[0].name == "value"]:
        graph.initializer.append(node.attribute[0].t)
        graph.initializer[-1].name = node.output[0]
        graph.node.remove(node)


def overwrite(tensor, array):
    """Gives a constant a new value (and shape); its name and type stay."""
    name = tensor.name
    tensor.CopyFrom(numpy_helper.from_array(array.astype(numpy_helper.to_array(tensor).dtype), name))


def consumers(graph):
    """The nodes that read each tensor."""
    readers = {}
    for node in graph.node:
        for name in node.input:
            readers.setdefault(name, []).append(node)
    return readers


def dimensions(value_info):
    """The sizes of a graph's input or output; 0 where not fixed."""
    return [d.dim_value for d in value_info.type.tensor_type.shape.dim]


def set_dimensions(value_info, sizes):
    shape = value_info.type.tensor_type.shape
    for dim, size in zip(shape.dim, sizes):
        dim.dim_value = size


def input_size(model):
    """(width, height); (0, 0) if the model takes any."""
    height, width = dimensions(model.graph.input[0])[2:]
    return width, height
