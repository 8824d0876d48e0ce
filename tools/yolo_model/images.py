"""Pictures as a YOLOv8 network wants them."""

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


def letterbox(file, size):
    """The picture as [1, 3, height, width] in 0..1, RGB, scaled to fit, centred on grey.

    Returns it with the scale and the left and top border: x_network = scale * x_picture + border.
    """
    width, height = size
    picture = Image.open(file).convert("RGB")
    scale = min(width / picture.width, height / picture.height)
    inner = (round(picture.width * scale), round(picture.height * scale))
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    canvas = Image.new("RGB", size, (PADDING,) * 3)
    canvas.paste(picture.resize(inner, Image.BILINEAR), (left, top))
    return np.asarray(canvas, np.float32).transpose(2, 0, 1)[None] / 255.0, scale, (left, top)
