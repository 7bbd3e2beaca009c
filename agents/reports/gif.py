"""Animated GIF of a drive, for pages that only show images."""

from __future__ import annotations

import io
from typing import Any

from PIL import Image

COLOURS, WIDTH = 48, 640
"""Number of colours, and largest width [px]; small values for small files."""


class Gif:
    """A GIF in an endless loop; images are scaled down when they are added."""

    def __init__(self, *, every: int, interval: float) -> None:
        """Create an empty animation.

        Args:
            every: Every n-th image is kept.
            interval: Time between two added images [s].
        """
        self._every, self._milliseconds = every, round(1000.0 * interval * every)
        self._n, self._kept = 0, list[Image.Image]()

    def add(self, picture: Any) -> None:
        """Add an image, uint8 (height, width, 3)."""
        if self._n % self._every == 0:
            image = Image.fromarray(picture)
            scale = min(1.0, WIDTH / image.width)
            size = round(image.width * scale), round(image.height * scale)
            small = image.resize(size, Image.Resampling.LANCZOS)
            self._kept.append(small.quantize(COLOURS, dither=Image.Dither.NONE))
        self._n += 1

    def to_bytes(self) -> bytes:
        """Return the file; at least one image is required."""
        (first, *others), out = self._kept, io.BytesIO()
        first.save(
            out, "GIF", save_all=True, append_images=others, duration=self._milliseconds,
            loop=0, disposal=1,
        )  # fmt: skip
        return out.getvalue()
