"""Wheel speed: what a car knows of its own motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.records import numbers_dtype
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometerSimParams:
    """What the simulated odometer does."""

    scale_std: float = 0.02
    """[-] Error of the wheel radius, constant for a car."""
    noise: float = 0.02
    """[m/s]"""


ODOMETER = numbers_dtype(OdometerSimParams)
"""`OdometerSimParams` as the kernels take it."""


class Odometer:
    """The odometers of all cars. Laws as for `Imu`."""

    def __init__(self, params: OdometerSimParams, n_cars: int, rng: np.random.Generator) -> None:
        self._params, self._rng = params, rng
        self._scale = 1.0 + params.scale_std * rng.standard_normal(n_cars)

    def sample(self, speed: F64) -> F64:
        """One reading of every car, (car) [m/s]."""
        return self._scale * speed + self._params.noise * self._rng.standard_normal(len(speed))
