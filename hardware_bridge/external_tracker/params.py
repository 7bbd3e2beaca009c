"""What is believed of positions that come ready from another tracker."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hardware_bridge.errors import BridgeError


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadyParams:
    """``[tracker.positions]``; see `external_tracker.perception.ReadyPerception`."""

    std: float = 0.02
    """[m] Of each axis of a position that comes without a covariance. Larger makes velocities
    smoother and later, and lets the gate keep cars further apart."""
    vel_std: float = 0.1
    """[m/s] Of each axis of a velocity that comes without one."""
    accel_psd: float = 1.5
    """[m/s2/sqrt(Hz)] Acceleration noise of a node whose velocity does not come. Larger follows
    turns, smaller is smoother; as `unaided_accel_psd` of the joint filter."""
    top_speed: float = 3.0
    """[m/s] Standard deviation of a velocity before a second position."""
    stale: float = 0.5
    """[s] What is older is dead reckoning: a pair is lost, a heading unknown."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not 0.0 < getattr(self, each.name) <= 1000.0:
                raise BridgeError(f"{each.name}: expected a number above 0, up to 1000")
