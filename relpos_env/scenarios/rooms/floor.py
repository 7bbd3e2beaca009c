"""The free floor of a room on a grid: where cars fit whatever their heading, and can pass.

A cell is free if its centre is farther than `berth` from walls and boxes. Cells that touch are
connected, so cars can get from any free cell of a patch to any other one.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from relpos_env.scenarios.rooms.overlap import distance
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool

CELL = 0.1
"""[m] Side of a cell, larger in rooms of more than `MOST_CELLS`."""
MOST_CELLS = 10_000
MARGIN = 0.1
"""[m] Room to leave between a car and what stands next to it, on every side."""
FLOOR_PER_CAR = 1.9
"""[spacing^2] Free floor that each car needs to find a random place: discs thrown at random jam
when they cover 0.547 of the floor (Feder, J. Theor. Biol. 87, 1980); these cover 0.41."""

Area = tuple[float, float, float, float]
"""x from, y from, x to, y to [m]."""


def berth(car: CarParams) -> float:
    """Half the width that a car needs to stand, turn and pass [m]."""
    return 0.5 * math.hypot(car.length, car.width) + MARGIN


def spacing(car: CarParams) -> float:
    """Least distance between the centres of two cars that stand in any heading [m]."""
    return math.hypot(car.length, car.width) + MARGIN


class Floor:
    """The floor of a room with boxes on it."""

    def __init__(self, room: tuple[float, float], car: CarParams, boxes: F64) -> None:
        """Measure the room out.

        Args:
            room: Along x and y [m].
            car: That is to fit.
            boxes: What stands in it, (box, 6).
        """
        self.cell = max(CELL, math.sqrt(room[0] * room[1] / MOST_CELLS))
        # Between the centres of two coarse cells less is free than at them.
        self._berth = berth(car) + 0.5 * (self.cell - CELL)
        self._spacing = spacing(car)
        x, y = (self._axis(side) for side in room)
        self.centres: F64 = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        """Of the cells, (i, j, 2) [m]."""
        walls = 0.5 * np.array(room) - np.abs(self.centres)
        self.clearance: F64 = walls.min(axis=-1)
        """From the centre of a cell to the next wall or box, (i, j) [m]."""
        for box in boxes:
            self.add(box)

    def add(self, box: F64) -> None:
        """Put another box down, (6)."""
        self.clearance = self.with_box(box)

    def with_box(self, box: F64) -> F64:
        """What `clearance` would be with another box."""
        return np.minimum(self.clearance, distance(self.centres, box))

    def patches(self, clearance: F64, area: Area | None = None) -> tuple[int, Bool, float]:
        """The free floor in connected patches.

        Args:
            clearance: Of every cell, (i, j) [m].
            area: Only the floor in it counts for size; None is all.

        Returns:
            Number of patches of the whole floor; the cells in the area of the one with most
            floor there, (i, j); and their size [m2].
        """
        labels, n = ndimage.label(clearance >= self._berth)
        inside = np.ones(labels.shape, dtype=bool) if area is None else self._within(area)
        sizes = np.bincount(labels[inside], minlength=n + 1)
        sizes[0] = 0
        largest = (labels == sizes.argmax()) & inside & (labels > 0)
        return n, largest, float(largest.sum()) * self.cell**2

    def room_for(self, size: float) -> int:
        """Cars that find random places on so much free floor [m2]."""
        return int(size / (FLOOR_PER_CAR * self._spacing**2))

    def scatter(self, n: int, area: Area | None, taken: F64, rng: np.random.Generator) -> F64:
        """Random poses apart from each other, from walls, boxes and places already taken.

        Args:
            n: How many are wanted.
            area: In which; None is the whole room.
            taken: (place, 2) [m].
            rng: For places and headings.

        Returns:
            x, y, heading, (pose, 3) [m, m, rad]; fewer than `n` where no more fit.
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
