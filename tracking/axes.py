"""Axes of a sensor that is read in other axes than those of the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64
from tracking.errors import ConfigError

NAMES = "x", "y", "z"
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Axes:
    """Which axes of a sensor are x, y and z of the body: forward, left and up."""

    order: tuple[int, ...] = (0, 1, 2)
    """(3) Axis of the sensor, for each of the body."""
    signs: tuple[float, ...] = (1.0, 1.0, 1.0)
    """(3) -1 where it points the other way."""

    @classmethod
    def parse(cls, names: Sequence[str], *, mirrored: bool) -> Axes:
        """Axes from names such as "y", "-x", "z".

        Args:
            names: Axes of the sensor for x, y and z of the body.
            mirrored: True for a sensor whose own axes may be left-handed.

        Raises:
            ConfigError: They are not three different axes, or no rotation of a sensor that
                measures rotations.
        """
        bare = [name.strip().removeprefix("-").removeprefix("+") for name in names]
        if sorted(bare) != sorted(NAMES):
            raise ConfigError(f'expected x, y and z in some order, "-" before some, got {names}')
        order = tuple(NAMES.index(name) for name in bare)
        signs = tuple(-1.0 if name.strip().startswith("-") else 1.0 for name in names)
        axes = cls(order, signs)
        if not mirrored and np.linalg.det(axes.turn(np.eye(3))) < 0.0:
            raise ConfigError(
                f"expected right-handed axes, got {names}: one sign or an exchange is wrong"
            )
        return axes

    def turn(self, values: F64) -> F64:
        """Readings in axes of the body, (..., 3)."""
        return np.asarray(values[..., list(self.order)] * np.array(self.signs))

    def turn_one(self, reading: Triple) -> Triple:
        """The same of a single reading."""
        a, b, c = (s * reading[k] for k, s in zip(self.order, self.signs, strict=True))
        return a, b, c

    @property
    def is_body(self) -> bool:
        """True for a sensor that is mounted as the body is."""
        return self == Axes()
