"""A moving picture of a drive, for pages that show no more than images."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from PIL import Image

COLOURS, WIDTH = 48, 640
"""Of a picture, the width in pixels; few make small files."""


def gif_of(pictures: Sequence[Any], *, interval: float) -> bytes:
    """A GIF that repeats for ever.

    Args:
        pictures: One or more, uint8 (height, width, 3).
        interval: Between two of them [s], in steps of 0.01 s.
    """
    first, *others = [_small(Image.fromarray(picture)) for picture in pictures]
    out, milliseconds = io.BytesIO(), round(1000.0 * interval)
    first.save(
        out, "GIF", save_all=True, append_images=others, duration=milliseconds, loop=0, disposal=1
    )
    return out.getvalue()


def _small(picture: Image.Image) -> Image.Image:
    """A picture of `WIDTH` or less, with few colours."""
    scale = min(1.0, WIDTH / picture.width)
    size = round(picture.width * scale), round(picture.height * scale)
    reduced = picture.resize(size, Image.Resampling.LANCZOS)
    return reduced.quantize(COLOURS, dither=Image.Dither.NONE)
