"""Pictures as a YOLOv8 network wants them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

PADDING = 114  # the grey that Ultralytics trains and predicts with


def image_files(folders, count):
    """At most `count` pictures, taken evenly from all in the folders."""
    files = [f for folder in folders for f in sorted(Path(folder).iterdir())]
    files = [f for f in files if f.suffix.lower() in (".png", ".jpg", ".jpeg")]
    if not files:
        raise SystemExit(f"no .png or .jpg in {', '.join(map(str, folders))}")
    chosen = np.linspace(0, len(files) - 1, min(count, len(files))).round().astype(int)
    return [files[i] for i in chosen]


@dataclass
class Letterboxed:
    """A picture scaled to fit a network's input: x_input = scale * x_picture + border."""

    array: np.ndarray  # [1, 3, height, width], RGB, 0..1
    scale: float
    border: tuple  # left, top
    picture_size: tuple  # width, height before scaling


def letterbox(file, size):
    """The picture centred on grey in an input of `size` = (width, height)."""
    width, height = size
    picture = Image.open(file).convert("RGB")
    scale = min(width / picture.width, height / picture.height)
    inner = (round(picture.width * scale), round(picture.height * scale))
    border = ((width - inner[0]) // 2, (height - inner[1]) // 2)
    canvas = Image.new("RGB", size, (PADDING,) * 3)
    canvas.paste(picture.resize(inner, Image.BILINEAR), border)
    array = np.asarray(canvas, np.float32).transpose(2, 0, 1)[None] / np.float32(255.0)
    return Letterboxed(array, scale, border, picture.size)
