"""Live view of a drive on the terminal: a plan of the room in characters."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.text import Text

ARROWS = "→↗↑↖←↙↓↘"
PLAIN_ARROWS = ">/^\\</v\\"
"""Arrows for terminals with ASCII only."""
COLOURS = ("blue", "red", "green", "dark_orange", "magenta", "cyan")
"""Colours of cars, as in the animation of the report."""
ASPECT = 0.5
"""[-] Width of a character over its height."""
FINE = 4
"""[-] Sample points per character along each axis."""
PERIOD = 0.05
"""[s] Shortest time between two pictures."""


def draw_room(
    frames: dict[str, Any], k: int, *, width: int, height: int, plain: bool = False
) -> Text:
    """Return the plan of the room in one frame.

    Arrows are cars, # obstacles, o the estimates of the first car and + its target positions.

    Args:
        frames: Frames of `agents.simulation.frames.FrameRecorder`.
        k: Index of the frame.
        width: Maximum number of characters in a line.
        height: Maximum number of lines.
        plain: Whether to use ASCII only.
    """
    across, deep = frames["room"]
    scale = min(width / across, height / (deep * ASPECT))  # characters per metre
    columns, rows = max(2, int(across * scale)), max(2, int(deep * scale * ASPECT))
    letters, colours = np.full((rows, columns), " "), np.full((rows, columns), "", dtype=object)

    def put(x: float, y: float, letter: str, colour: str) -> None:
        row = math.floor((0.5 - y / deep) * rows)
        column = math.floor((0.5 + x / across) * columns)
        if 0 <= row < rows and 0 <= column < columns:
            letters[row, column], colours[row, column] = letter, colour

    # Walls may be thinner than a character: each character is sampled at several points.
    y, x = np.mgrid[0 : rows * FINE, 0 : columns * FINE] + 0.5
    x, y = (x / columns / FINE - 0.5) * across, (0.5 - y / rows / FINE) * deep
    for corners in _boxes(frames, k):
        fine = _is_inside(np.asarray(corners), x, y).reshape(rows, FINE, columns, FINE)
        inside = fine.any(axis=(1, 3))
        letters[inside], colours[inside] = "#", "bright_black"
    viewer = frames["viewer"][k]
    places, here = frames["pos"][k], frames["present"][k]
    for n, target in enumerate(frames["target"][k]):
        if target is not None:
            at = places[viewer][0] + target[0], places[viewer][1] + target[1]
            put(*at, "+", COLOURS[n % len(COLOURS)])
    for n, estimate in enumerate(frames["estimate"][k]):
        if estimate is not None:
            at = places[viewer][0] + estimate[0], places[viewer][1] + estimate[1]
            put(*at, "o", COLOURS[n % len(COLOURS)])
    arrows = PLAIN_ARROWS if plain else ARROWS
    for n, (place, heading) in enumerate(zip(places, frames["heading"][k], strict=True)):
        if here[n]:
            arrow = arrows[round(heading / (0.25 * math.pi)) % 8]
            put(place[0], place[1], arrow, f"bold {COLOURS[n % len(COLOURS)]}")
    text = Text()
    for row in range(rows):
        for letter, colour in zip(letters[row], colours[row], strict=True):
            text.append(letter, colour)
        text.append("\n")
    text.right_crop(1)
    return text


def _boxes(frames: dict[str, Any], k: int) -> Any:
    """Return the corners of the obstacles; frames have them only after a change."""
    while k > 0 and frames["boxes"][k] is None:
        k -= 1
    return frames["boxes"][k] or ()


def _is_inside(corners: Any, x: Any, y: Any) -> Any:
    """Return True for points in a convex polygon."""
    sides = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    return np.all(np.array(sides) >= 0.0, axis=0) | np.all(np.array(sides) <= 0.0, axis=0)


class LiveRoom:
    """View of a drive on stderr, updated in place; no output without a terminal."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self.shown = self._console.is_terminal and not self._console.is_dumb_terminal
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._last = -math.inf

    def __enter__(self) -> Self:
        if self.shown:
            self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self.shown:
            self._live.stop()

    def show(self, frames: dict[str, Any], title: str, k: int = -1) -> None:
        """Draw a frame, the latest by default, unless the last picture is newer than `PERIOD`."""
        now = time.monotonic()
        if not self.shown or now - self._last < PERIOD or not frames["t"]:
            return
        self._last, k = now, k % len(frames["t"])
        size, plain = self._console.size, "utf" not in self._console.encoding.lower()
        room = draw_room(frames, k, width=size.width - 4, height=size.height - 7, plain=plain)
        error = frames["tracking"][k]
        text = f"{frames['t'][k]:5.1f} s, formation error {frames['formation'][k]:.2f} m"
        if error is not None:
            text += f", tracking error {error:.2f} m"
        panel = Panel(room, title=title, expand=False, padding=0, safe_box=plain)
        key = "o: estimate of another car by the first, +: its target"
        self._live.update(Group(panel, Text(f"{text}\n{key}")), refresh=True)

    def replay(self, frames: dict[str, Any], title: str, until: Callable[[], bool]) -> None:
        """Show a drive repeatedly in real time until `until` returns True."""
        k = 0
        while not until():
            self.show(frames, title, k)
            k = (k + 1) % max(1, len(frames["t"]))
            time.sleep(frames["dt"])
