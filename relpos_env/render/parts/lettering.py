"""Text on the image."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from relpos_env.render.backend import load_pygame
from relpos_env.render.palette import Colour

if TYPE_CHECKING:
    import pygame

_KEPT = 512
"""Size of the cache of rendered texts; a full cache is cleared, as most texts are past times."""


def _font_file(name: str) -> str | None:
    """Return a font file of matplotlib, equal on every machine, without importing matplotlib."""
    spec = find_spec("matplotlib")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        path = Path(folder) / "mpl-data" / "fonts" / "ttf" / name
        if path.is_file():
            return str(path)
    return None


class Lettering:
    """Text on surfaces in one typeface, in pixels of the image."""

    def __init__(self) -> None:
        self._pg = load_pygame()
        self._pg.font.init()
        self._files = (_font_file("DejaVuSans.ttf"), _font_file("DejaVuSans-Bold.ttf"))
        self._fonts: dict[tuple[int, bool], pygame.font.Font] = {}
        self._texts: dict[tuple[str, int, Colour, bool], pygame.Surface] = {}

    def write(
        self,
        picture: pygame.Surface,
        text: str,
        at: tuple[float, float],
        size: float,
        colour: Colour,
        *,
        bold: bool = False,
        anchor: tuple[float, float] = (0.0, 0.5),
        most: float | None = None,
        rim: Colour | None = None,
    ) -> None:
        """Write one line.

        Args:
            picture: Surface to write on.
            text: Text of the line.
            at: Position of the anchor [pixels].
            size: Height of the font [pixels].
            colour: Colour of the letters.
            bold: True for bold letters.
            anchor: Reference point of the text, as fractions of its width and height.
            most: Maximum width; longer text is shortened [pixels].
            rim: Colour of a thin rim round the letters, for contrast on any background.
        """
        drawn = self._drawn(text, max(8, round(size)), colour, bold)
        while most is not None and drawn.get_width() > most and len(text) > 2:
            text = text[:-2].rstrip() + "…"
            drawn = self._drawn(text, max(8, round(size)), colour, bold)
        x = round(at[0] - anchor[0] * drawn.get_width())
        y = round(at[1] - anchor[1] * drawn.get_height())
        if rim is not None:
            around = self._drawn(text, max(8, round(size)), rim, bold)
            for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                picture.blit(around, (x + dx, y + dy))
        picture.blit(drawn, (x, y))

    def width(self, text: str, size: float, *, bold: bool = False) -> int:
        """Return the width of one line [pixels]."""
        return int(self._font(max(8, round(size)), bold).size(text)[0])

    def _drawn(self, text: str, size: int, colour: Colour, bold: bool) -> pygame.Surface:
        key = (text, size, colour, bold)
        if key not in self._texts:
            if len(self._texts) >= _KEPT:
                self._texts.clear()
            self._texts[key] = self._font(size, bold).render(text, True, colour)
        return self._texts[key]

    def _font(self, size: int, bold: bool) -> pygame.font.Font:
        if (size, bold) not in self._fonts:
            self._fonts[size, bold] = self._pg.font.Font(self._files[bold], size)
        return self._fonts[size, bold]
