"""Parameters of positions from an external tracker."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hardware_bridge.errors import BridgeError


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadyParams:
    """Keys of ``[tracker.positions]``; see `external_tracker.perception.ReadyPerception`."""

    std: float = 0.02
    """[m] Standard deviation per axis of positions without a covariance. Larger values make
    velocities smoother and later, and the gate keeps cars further apart."""
    vel_std: float = 0.1
    """[m/s] Standard deviation per axis of velocities without a covariance."""
    accel_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Acceleration noise density of nodes without reported velocity. A larger value
    follows manoeuvres, a smaller one is smoother; as `unaided_accel_psd` of the joint filter."""
    top_speed: float = 3.0
    """[m/s] Standard deviation of the velocity before the second position."""
    stale: float = 0.5
    """[s] Age at which estimates become dead reckoning: a pair is lost, a heading unknown."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not 0.0 < getattr(self, each.name) <= 1000.0:
                raise BridgeError(f"{each.name}: expected a number above 0, up to 1000")
