"""Orientations as they were told, carried on at the rate at which nodes turned last."""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.external_tracker.pending import ToldHeading
from tracking.arrays import F64, Bool

SMOOTH = 0.1
"""[s] Time constant of the rate: shorter follows a steering wheel, longer is smoother."""
FARTHEST = 0.2
"""[s] No heading is carried on for longer."""
FASTEST = 10.0
"""[rad/s] Faster is no turn, but a marker that was taken for another."""


class Headings:
    """Of the nodes, arrays over (node, ...). Law: what turns evenly is carried exactly."""

    def __init__(self, n: int) -> None:
        self.q_wb: F64 = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        """As told last, (node, 4)."""
        self.t: F64 = np.full(n, -np.inf)
        """When that was, (node) [s]; -inf before the first time."""
        self._rate: F64 = np.full(n, np.nan)

    def forget(self, node: int) -> None:
        """As if nothing had been told of it."""
        self.t[node], self._rate[node] = -np.inf, np.nan

    def take(self, told: list[tuple[int, ToldHeading]]) -> None:
        """Take over what was told; older than the last of a node changes nothing."""
        for node, heading in told:
            dt = heading.t - self.t[node]
            if dt < 0.0:
                continue
            if 0.0 < dt < math.inf:
                self._turn(node, yaw_of(heading.q_wb) - yaw_of(self.q_wb[node]), dt)
            self.q_wb[node], self.t[node] = heading.q_wb, heading.t

    def turns(self, now: float) -> F64:
        """How far each has turned since it was told, (node) [rad]."""
        known = np.isfinite(self.t) & np.isfinite(self._rate)
        age = np.where(known, now - self.t, 0.0)
        turned: F64 = np.where(known, self._rate, 0.0) * np.clip(age, 0.0, FARTHEST)
        return turned

    def known(self, now: float, stale: float) -> Bool:
        """Whether each was told within a time [s], (node)."""
        known: Bool = now - self.t <= stale
        return known

    def _turn(self, node: int, change: float, dt: float) -> None:
        change = math.remainder(change, 2.0 * math.pi)
        if dt > SMOOTH + FARTHEST or abs(change) > FASTEST * dt:
            self._rate[node] = np.nan
        elif math.isnan(self._rate[node]):
            self._rate[node] = change / dt
        else:
            self._rate[node] += -math.expm1(-dt / SMOOTH) * (change / dt - self._rate[node])


def yaw_of(q: F64 | tuple[float, ...]) -> float:
    """The angle of the body's x axis from east, counter-clockwise [rad]."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
