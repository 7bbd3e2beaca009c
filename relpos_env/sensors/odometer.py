"""Wheel odometer: the measured forward speed of a car."""

from __future__ import annotations

from dataclasses import dataclass

from relpos_env.world.parameter_records import numbers_dtype


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometerSimParams:
    """Parameters of the simulated odometer."""

    scale_std: float = 0.02
    """[-] Standard deviation of the wheel radius error, constant per car and episode."""
    noise: float = 0.02
    """[m/s] White noise of a reading."""


ODOMETER = numbers_dtype(OdometerSimParams)
"""Record type of `OdometerSimParams` for the kernels."""
