"""Orientation of a sensor's axes relative to the body."""

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
    """Axes of a sensor along x, y and z of the body: forward, left and up."""

    order: tuple[int, ...] = (0, 1, 2)
    """Index of the sensor's axis for each axis of the body, (3)."""
    signs: tuple[float, ...] = (1.0, 1.0, 1.0)
    """-1 if that axis of the sensor points the other way, (3)."""

    @classmethod
    def parse(cls, names: Sequence[str], *, mirrored: bool) -> Axes:
        """Parse names of axes such as "y", "-x", "z".

        Args:
            names: Axes of the sensor for x, y and z of the body.
            mirrored: True for a sensor whose own axes may be left-handed.

        Raises:
            ConfigError: Not three different axes, or left-handed ones without `mirrored`.
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
        """Return readings in axes of the body, (..., 3)."""
        return np.asarray(values[..., list(self.order)] * np.array(self.signs))

    def turn_one(self, reading: Triple) -> Triple:
        """Return a single reading in axes of the body."""
        a, b, c = (s * reading[k] for k, s in zip(self.order, self.signs, strict=True))
        return a, b, c

    @property
    def is_body(self) -> bool:
        """True if the sensor's axes are those of the body."""
        return self == Axes()
