"""Tests on a tiny network with the outside of a YOLOv8-seg export.

    cd tools/yolo_model && ONNXRUNTIME=/path/to/libonnxruntime.so python3 -m unittest

Without ONNXRUNTIME and without the library in the system, the tests that run a network are left out.
"""

import copy
import ctypes.util
import os
import tempfile
import unittest

import numpy as np
import onnx
from onnx import helper, numpy_helper

import graph
from compare import Detection, match
from images import Letterboxed
from quantize import quantize
from resize import anchors, resize, strides
from runtime import Library, Session

CLASSES, COEFFICIENTS, BINS, CHANNELS = 2, 2, 16, 8
RUNTIME = os.environ.get("ONNXRUNTIME") or ctypes.util.find_library("onnxruntime")


class Builder:
    """A network of three levels, each one strided convolution with SiLU, and YOLOv8's box decoder."""

    def __init__(self, size, opset=13):
        self.random = np.random.default_rng(1)  # the same weights at every size
        self.nodes, self.constants = [], []
        width, height = size
        levels = [self.silu(self.conv("images", 3, CHANNELS, s)) for s in graph.STRIDES]
        counts = [width // s * (height // s) for s in graph.STRIDES]
        rows = {
            name: self.add("Concat", *[self.flat(self.conv(x, CHANNELS, n, 1), n, c) for x, c in zip(levels, counts)],
                           axis=2)
            for name, n in (("box", 4 * BINS), ("class", CLASSES), ("mask", COEFFICIENTS))
        }  # fmt: skip
        parts = self.boxes(rows["box"], size), self.add("Sigmoid", rows["class"]), rows["mask"]
        output = self.add("Concat", *parts, axis=1)
        prototypes = self.silu(self.conv("images", 3, COEFFICIENTS, 4))
        shapes = {
            "images": [1, 3, height, width],
            output: [1, 4 + CLASSES + COEFFICIENTS, sum(counts)],
            prototypes: [1, COEFFICIENTS, height // 4, width // 4],
        }
        values = [helper.make_tensor_value_info(n, onnx.TensorProto.FLOAT, s) for n, s in shapes.items()]
        made = helper.make_graph(self.nodes, "tiny", values[:1], values[1:], self.constants)
        self.model = helper.make_model(made, opset_imports=[helper.make_opsetid("", opset)], ir_version=7)

    def add(self, operator, *inputs, **attributes):
        name = f"t{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], name, **attributes))
        return name

    def constant(self, value):
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return name

    def conv(self, source, channels, made, stride):
        weights = self.random.normal(size=(made, channels, stride, stride)) / np.sqrt(channels * stride**2)
        bias = self.random.normal(size=made)
        inputs = [self.constant(w.astype(np.float32)) for w in (weights, bias)]
        return self.add("Conv", source, *inputs, kernel_shape=[stride] * 2, strides=[stride] * 2)

    def silu(self, source):
        return self.add("Mul", source, self.add("Sigmoid", source))

    def flat(self, source, channels, count):
        return self.add("Reshape", source, self.constant([1, channels, count]))

    def boxes(self, bins, size):
        cells = len(strides(size))
        bins = self.add("Reshape", bins, self.constant([1, 4, BINS, cells]))
        shares = self.add("Softmax", self.add("Transpose", bins, perm=[0, 2, 1, 3]), axis=1)
        weights = self.constant(np.arange(BINS, dtype=np.float32).reshape(1, BINS, 1, 1))
        sides = self.add("Reshape", self.add("Conv", shares, weights), self.constant([1, 4, cells]))
        bounds = [self.constant([i]) for i in (0, 2, 4)]
        near, far = (self.add("Slice", sides, *bounds[i : i + 2], self.constant([1])) for i in (0, 1))
        centres = self.constant(anchors(size).astype(np.float32)[None])
        first, last = self.add("Sub", centres, near), self.add("Add", far, centres)
        middle = self.add("Mul", self.add("Add", first, last), self.constant(np.float32(0.5)))
        box = self.add("Concat", middle, self.add("Sub", last, first), axis=1)
        return self.add("Mul", box, self.constant(strides(size).astype(np.float32)[None]))


def loaded(model):
    with tempfile.NamedTemporaryFile(suffix=".onnx") as file:
        onnx.save(model, file.name)
        return graph.load(file.name)


def run(model, array):
    with tempfile.NamedTemporaryFile(suffix=".onnx") as file:
        onnx.save(model, file.name)
        names = [v.name for v in model.graph.input], [v.name for v in model.graph.output]
        session = Session(Library(RUNTIME), file.name, *names)
        results = session.run(array)
        session.close()
        return results


def picture(size, seed):
    return np.random.default_rng(seed).random((1, 3, size[1], size[0]), np.float32)


class Resize(unittest.TestCase):
    def test_a_resized_export_is_the_export_at_that_size(self):
        model = Builder((128, 128)).model
        resize(model, (160, 96))
        self.assertEqual(model, Builder((160, 96)).model)

    def test_rounded_anchors_are_made_exact(self):
        model = Builder((128, 128)).model
        rounded = next(t for t in model.graph.initializer if tuple(t.dims) == (1, 2, len(strides((128, 128)))))
        graph.overwrite(rounded, numpy_helper.to_array(rounded) + 0.3)
        resize(model, (128, 128))
        self.assertEqual(model, Builder((128, 128)).model)

    def test_refuses_what_is_no_decoder(self):
        model = Builder((128, 128)).model
        wrong = next(t for t in model.graph.initializer if tuple(t.dims) == (1, 2, len(strides((128, 128)))))
        graph.overwrite(wrong, numpy_helper.to_array(wrong) * 2)
        with self.assertRaises(SystemExit):
            resize(model, (160, 96))

    def test_refuses_a_size_that_is_no_multiple_of_32(self):
        with self.assertRaises(SystemExit):
            resize(Builder((128, 128)).model, (160, 100))


@unittest.skipUnless(RUNTIME, "ONNX Runtime is not here: name it in ONNXRUNTIME")
class Running(unittest.TestCase):
    def test_boxes_of_an_old_opset_have_a_size(self):
        old = Builder((64, 64), opset=12).model
        array = picture((64, 64), 2)
        self.assertLess(run(old, array)[0][0, 2:4].mean(), 1.0)  # Softmax over all cells: next to nothing
        for mended, right in zip(run(loaded(old), array), run(Builder((64, 64)).model, array)):
            np.testing.assert_array_equal(mended, right)

    def test_8_bit_results_are_near_the_float_ones(self):
        size = (128, 96)
        model = Builder(size).model
        coded = copy.deepcopy(model)
        array = picture(size, 3)
        quantize(coded, Library(RUNTIME), [Letterboxed(array, 1.0, (0, 0), size)])
        pairs = sum(n.op_type == "QuantizeLinear" for n in coded.graph.node)
        # The image, and of four blocks convolution, sigmoid and product; but the prototypes are a result.
        self.assertEqual(pairs, 1 + 4 * 3 - 1)
        for exact, near in zip(run(model, array), run(coded, array)):
            # Some four roundings lie in between, each of at most half a 255th of a tensor's range.
            self.assertLess(np.abs(near - exact).max(), 4 * np.ptp(exact) / 255)


class Compare(unittest.TestCase):
    def test_each_detection_is_matched_once_and_the_best_overlap_wins(self):
        def at(x):
            return Detection(np.array([x, 0.0, x + 10.0, 10.0]), 1.0, None)

        first, second = [at(0.0), at(50.0)], [at(2.0), at(0.5), at(80.0)]
        pairs = match(first, second)
        self.assertEqual([(a.box[0], b.box[0]) for a, b in pairs], [(0.0, 0.5)])


if __name__ == "__main__":
    unittest.main()
