"""Free floor of a room on a grid: positions where cars fit at any heading.

A cell is free if its centre is at least `berth` from walls and boxes. Adjacent free cells form
patches, in which cars can drive from any cell to any other.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from relpos_env.scenarios.rooms.overlap import distance
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool

CELL = 0.1
"""[m] Side of a cell, larger in rooms that would have more than `MOST_CELLS`."""
MOST_CELLS = 10_000
MARGIN = 0.1
"""[m] Clearance of a car on every side."""
FLOOR_PER_CAR = 1.9
"""[spacing^2] Free floor per car for random placement: random sequential addition of discs jams
at a coverage of 0.547 (Feder, J. Theor. Biol. 87, 1980); here it is 0.41."""

Area = tuple[float, float, float, float]
"""Minimum x, minimum y, maximum x, maximum y [m]."""


def berth(car: CarParams) -> float:
    """Return half the width that a car needs to rotate and pass [m]."""
    return 0.5 * math.hypot(car.length, car.width) + MARGIN


def spacing(car: CarParams) -> float:
    """Return the minimum distance between the centres of two cars at any heading [m]."""
    return math.hypot(car.length, car.width) + MARGIN


class Floor:
    """Floor of a room with boxes."""

    def __init__(self, room: tuple[float, float], car: CarParams, boxes: F64) -> None:
        """Compute the grid and its clearance.

        Args:
            room: Size along x and y [m].
            car: Parameters with the size of the cars.
            boxes: Boxes in the room, (box, 6).
        """
        self.cell = max(CELL, math.sqrt(room[0] * room[1] / MOST_CELLS))
        # Between the centres of two coarse cells the clearance is smaller than at them.
        self._berth = berth(car) + 0.5 * (self.cell - CELL)
        self._spacing = spacing(car)
        x, y = (self._axis(side) for side in room)
        self.centres: F64 = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        """Centres of the cells, (i, j, 2) [m]."""
        walls = 0.5 * np.array(room) - np.abs(self.centres)
        self.clearance: F64 = walls.min(axis=-1)
        """Distance of each cell's centre from the nearest wall or box, (i, j) [m]."""
        for box in boxes:
            self.add(box)

    def add(self, box: F64) -> None:
        """Add a box, (6)."""
        self.clearance = self.with_box(box)

    def with_box(self, box: F64) -> F64:
        """Return `clearance` with another box, without adding it."""
        return np.minimum(self.clearance, distance(self.centres, box))

    def patches(self, clearance: F64, area: Area | None = None) -> tuple[int, Bool, float]:
        """Divide the free floor into connected patches.

        Args:
            clearance: Clearance of every cell, (i, j) [m].
            area: Area in which the size of patches is measured; None is the whole room.

        Returns:
            Number of patches of the whole floor; mask of the cells in the area of the largest
            patch there, (i, j); and their size [m2].
        """
        labels, n = ndimage.label(clearance >= self._berth)
        inside = np.ones(labels.shape, dtype=bool) if area is None else self._within(area)
        sizes = np.bincount(labels[inside], minlength=n + 1)
        sizes[0] = 0
        largest = (labels == sizes.argmax()) & inside & (labels > 0)
        return n, largest, float(largest.sum()) * self.cell**2

    def room_for(self, size: float) -> int:
        """Return the number of cars that fit at random on a free floor of a size [m2]."""
        return int(size / (FLOOR_PER_CAR * self._spacing**2))

    def scatter(self, n: int, area: Area | None, taken: F64, rng: np.random.Generator) -> F64:
        """Sample random poses clear of each other, of walls, boxes and given positions.

        Args:
            n: Number of poses.
            area: Area of the poses; None is the whole room.
            taken: Positions to keep clear of, (position, 2) [m].
            rng: Generator of positions and headings.

        Returns:
            x, y, heading, (pose, 3) [m, m, rad]; fewer than `n` if no more fit.
        """
        _, free, _ = self.patches(self.clearance, area)
        cells = self.centres[free]
        poses = np.zeros((n, 3))
        shift = 0.25 * CELL
        apart = self._spacing + math.sqrt(2.0) * shift
        for place in taken:
            cells = cells[np.hypot(*(cells - place).T) >= apart]
        for k in range(n):
            if not len(cells):
                return poses[:k]
            at = cells[rng.integers(len(cells))] + rng.uniform(-shift, shift, 2)
            poses[k] = *at, rng.uniform(-np.pi, np.pi)
            cells = cells[np.hypot(*(cells - at).T) >= apart]
        return poses

    def _within(self, area: Area) -> Bool:
        low, high = np.array(area[:2]), np.array(area[2:])
        inside: Bool = np.all((self.centres >= low) & (self.centres <= high), axis=-1)
        return inside

    def _axis(self, side: float) -> F64:
        n = max(int(side / self.cell), 1)
        return (np.arange(n, dtype=np.float64) - 0.5 * (n - 1)) * self.cell
