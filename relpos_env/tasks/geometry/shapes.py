"""Shapes of formations: slots for any number of cars, x ahead, y to the left."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.tasks.options import car_count, points, positive
from tracking.arrays import F64

MAX_SPACING = 1.0
"""[m] Default distance between neighbours, reduced in small rooms."""
MIN_SPACING = 0.5
"""[m] Smallest default distance between neighbours: a little more than the length of a car."""
SHARE = 0.75
"""[-] Share of the free space that a formation with default spacing takes at most, if possible."""


def line(n: int) -> F64:
    """Return slots side by side, from left to right, (slot, 2)."""
    return np.stack([np.zeros(n), 0.5 * (n - 1) - np.arange(n)], axis=1)


def v(n: int) -> F64:
    """Return a wedge: one slot ahead, the others 45 degrees back, alternately left and right."""
    row, side = (np.arange(n) + 1) // 2, np.where(np.arange(n) % 2 == 1, 1.0, -1.0)
    places: F64 = np.sqrt(0.5) * np.stack([-row, side * row], axis=1)
    return places


def triangle(n: int) -> F64:
    """Return rows of 1, 2, 3, ... slots from front to back on a triangular lattice."""
    places: list[tuple[float, float]] = []
    row = 0
    while len(places) < n:
        m = min(row + 1, n - len(places))
        places += [(-row * np.sqrt(0.75), 0.5 * (m - 1) - q) for q in range(m)]
        row += 1
    return np.array(places)


def ring(n: int) -> F64:
    """Return a regular polygon, counter-clockwise, the first slot ahead."""
    if n == 1:
        return np.zeros((1, 2))
    angle = 2.0 * np.pi * np.arange(n) / n
    places: F64 = np.stack([np.cos(angle), np.sin(angle)], axis=1) / (2.0 * np.sin(np.pi / n))
    return places


SHAPES: dict[str, Callable[[int], F64]] = {"triangle": triangle, "line": line, "v": v, "ring": ring}
"""Name to ``(number of cars) -> slots, (slot, 2)``, neighbours a distance of about 1 apart.
A new shape needs a function and a line here."""


class Formation:
    """A shape with its spacing: slots for any number of present cars."""

    def __init__(
        self,
        shape: str | Sequence[Sequence[float]] | F64,
        n_cars: int,
        spacing: float | None,
        *,
        led: bool = False,
    ) -> None:
        """Choose a shape.

        Args:
            shape: One of `SHAPES`, or slots (x ahead, y left) [m], one per car.
            n_cars: Maximum number of cars.
            spacing: Distance between neighbours [m]; None to choose it by `fit`. Ignored for
                explicit slots.
            led: True if slots are relative to the first one, else to their mean.

        Raises:
            EnvError: `shape` or `spacing` is invalid.
        """
        self._led, self._n_cars = led, car_count(n_cars)
        self._given: F64 | None = None
        self._spacing = None if spacing is None else positive("spacing", spacing)
        if isinstance(shape, str):
            self._make = look_up(SHAPES, shape, "shape")
        else:
            given = points("shape", shape, n_cars)[:n_cars]
            gaps = np.linalg.norm(given[:, None] - given[None, :], axis=-1)
            if gaps[~np.eye(n_cars, dtype=bool)].min() <= 0.0:
                raise EnvError("shape: expected places that differ, got some twice")
            self._given, self._spacing = given, 1.0

    def places(self, n: int) -> F64:
        """Return the slots for n cars, (slot, 2) [m], relative to their mean or the first."""
        raw = self._given[:n] if self._given is not None else self._make(n)
        middle = raw[0] if self._led else raw.mean(axis=0)
        places: F64 = (raw - middle) * (MAX_SPACING if self._spacing is None else self._spacing)
        return places

    def extent(self, heading: float | None) -> F64:
        """Return the largest half extent along x and y for any number of cars, (2) [m].

        Args:
            heading: Heading of the formation [rad]; None if it turns.
        """
        extent = np.zeros(2)
        for n in range(1, self._n_cars + 1):
            places = self.places(n)
            if heading is None:
                reach = np.full(2, np.linalg.norm(places, axis=1).max())
            else:
                c, s = np.cos(heading), np.sin(heading)
                reach = np.abs(places @ np.array([[c, s], [-s, c]])).max(axis=0)
            extent = np.maximum(extent, reach)
        return extent

    def fit(self, half: F64, heading: float | None) -> F64:
        """Choose the spacing if it is None, and check that the formation fits.

        Args:
            half: Half of the free space along x and y [m].
            heading: As for `extent`.

        Returns:
            Half extent, as from `extent`.

        Raises:
            EnvError: The formation exceeds the free space.
        """
        extent = self.extent(heading)
        share = SHARE * float(np.min(half / np.maximum(extent, 1e-9)))
        if self._spacing is None:
            self._spacing = float(np.clip(share * MAX_SPACING, MIN_SPACING, MAX_SPACING))
            extent = self.extent(heading)
        if np.any(extent > half + 1e-9):
            what = "shape" if self._given is not None else "spacing"
            raise EnvError(
                f"{what}: {self._n_cars} cars need {2 * extent[0]:.1f} m x {2 * extent[1]:.1f} m, "
                f"expected at most {2 * half[0]:.1f} m x {2 * half[1]:.1f} m"
            )
        return extent
