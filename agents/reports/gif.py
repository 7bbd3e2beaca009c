"""A moving picture of a drive, for pages that show no more than images."""

from __future__ import annotations

import io
from typing import Any

from PIL import Image

COLOURS, WIDTH = 48, 640
"""Of a picture, and its width in pixels; few make small files."""


class Gif:
    """A GIF that repeats for ever; pictures are made small as they come."""

    def __init__(self, *, every: int, interval: float) -> None:
        """Prepare.

        Args:
            every: One picture of this number is kept.
            interval: Between two pictures that are added [s].
        """
        self._every, self._milliseconds = every, round(1000.0 * interval * every)
        self._n, self._kept = 0, list[Image.Image]()

    def add(self, picture: Any) -> None:
        """Add a picture, uint8 (height, width, 3)."""
        if self._n % self._every == 0:
            image = Image.fromarray(picture)
            scale = min(1.0, WIDTH / image.width)
            size = round(image.width * scale), round(image.height * scale)
            small = image.resize(size, Image.Resampling.LANCZOS)
            self._kept.append(small.quantize(COLOURS, dither=Image.Dither.NONE))
        self._n += 1

    def to_bytes(self) -> bytes:
        """The file, of one or more pictures."""
        (first, *others), out = self._kept, io.BytesIO()
        first.save(
            out, "GIF", save_all=True, append_images=others, duration=self._milliseconds,
            loop=0, disposal=1,
        )  # fmt: skip
        return out.getvalue()
