"""Wheel speed: what a car knows of its own motion."""

from __future__ import annotations

from dataclasses import dataclass

from relpos_env.world.parameter_records import numbers_dtype


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometerSimParams:
    """What the simulated odometer does."""

    scale_std: float = 0.02
    """[-] Error of the wheel radius, constant for a car."""
    noise: float = 0.02
    """[m/s]"""


ODOMETER = numbers_dtype(OdometerSimParams)
"""`OdometerSimParams` as the kernels take it."""
