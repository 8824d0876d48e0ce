#!/usr/bin/env python3
"""Makes a YOLOv8-seg ONNX model fit: another input size, 8-bit weights; and compares two models.

    yolo_model.py resize MODEL -o OUT --size 640x480
    yolo_model.py quantize MODEL -o OUT --images FOLDER [FOLDER ...]
    yolo_model.py compare MODEL OTHER --images FOLDER [FOLDER ...]

Sizes are width x height. See README.md beside this file.
"""

import argparse
import re

import numpy as np
import onnx

import compare
import graph
from images import image_files, letterbox
from quantize import quantize
from resize import resize
from runtime import Library, Session


def size(text):
    if not re.fullmatch(r"\d+x\d+", text):
        raise argparse.ArgumentTypeError(f"{text}: expected WIDTHxHEIGHT, e.g. 640x480")
    width, height = map(int, text.split("x"))
    return width, height


def resize_command(arguments):
    model = graph.load(arguments.model)
    resize(model, arguments.size)
    onnx.save(model, arguments.output)


def quantize_command(arguments):
    model = graph.load(arguments.model)
    files = image_files(arguments.images, arguments.count)
    images = [letterbox(f, fixed_size(model, arguments.model)) for f in files]
    quantize(model, Library(arguments.runtime), images, arguments.weight_bits, arguments.threads)
    onnx.save(model, arguments.output)


def compare_command(arguments):
    library = Library(arguments.runtime)
    sessions, sizes = [], []
    for file in (arguments.model, arguments.other):
        model = graph.load(file)
        sizes.append(fixed_size(model, file))
        names = [v.name for v in model.graph.input], [v.name for v in model.graph.output]
        sessions.append(Session(library, file, *names, arguments.threads))
    files = image_files(arguments.images, arguments.count)
    found = compare.agreement(sessions, sizes, files, arguments.class_id)
    print(f"images {len(files)}, instances {found.first} and {found.second}, matched {len(found.box_ious)}")
    if found.box_ious:
        boxes, masks = np.mean(found.box_ious), np.mean(found.mask_ious)
        print(f"mean IoU of boxes {boxes:.3f}, of masks {masks:.3f} (least {min(found.mask_ious):.3f})")
    times = compare.run_times(sessions, [letterbox(files[0], s) for s in sizes], arguments.runs)
    for name, of in (("median", np.median), ("least", np.min)):
        first, second = of(times, axis=0)
        print(f"{name} {first:.1f} ms and {second:.1f} ms, {first / second:.2f} times as fast")


def fixed_size(model, file):
    width, height = graph.input_size(model)
    if not width or not height:
        raise SystemExit(f"{file} takes any input size; give it one with: yolo_model.py resize")
    return width, height


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)

    running = argparse.ArgumentParser(add_help=False)
    running.add_argument("--images", nargs="+", required=True, help="folders of .png or .jpg pictures")
    running.add_argument("--count", type=int, default=24, help="pictures taken of them, evenly (default 24)")
    running.add_argument("--threads", type=int, default=1, help="of ONNX Runtime (default 1)")
    running.add_argument("--runtime", help="libonnxruntime.so, where the system does not find it by itself")

    command = commands.add_parser("resize", help="another fixed input size")
    command.set_defaults(run=resize_command)
    command.add_argument("model")
    command.add_argument("-o", "--output", required=True)
    command.add_argument("--size", type=size, required=True, help="WIDTHxHEIGHT, multiples of 32")

    command = commands.add_parser("quantize", parents=[running], help="8-bit weights and activations (QDQ)")
    command.set_defaults(run=quantize_command)
    command.add_argument("model")
    command.add_argument("-o", "--output", required=True)

    command.add_argument(
        "--weight-bits", type=int, choices=(7, 8), default=8, help="7 for processors without VNNI (default 8)"
    )

    command = commands.add_parser("compare", parents=[running], help="agreement and run times of two models")
    command.set_defaults(run=compare_command)
    command.add_argument("model")
    command.add_argument("other")
    command.add_argument("--class-id", type=int, default=0, help="of the instances compared (default 0, person)")
    command.add_argument("--runs", type=int, default=30, help="timed runs of each (default 30)")

    arguments = parser.parse_args()
    try:
        arguments.run(arguments)
    except (OSError, RuntimeError) as error:  # files, ONNX Runtime
        raise SystemExit(f"yolo_model: {error}") from None


if __name__ == "__main__":
    main()
