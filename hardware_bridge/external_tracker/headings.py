"""Reported orientations, extrapolated at the last yaw rate of each node."""

from __future__ import annotations

import math

import numpy as np

from hardware_bridge.external_tracker.pending import HeadingReport
from tracking.arrays import F64, Bool

SMOOTH = 0.1
"""[s] Time constant of the yaw rate: shorter follows steering, longer is smoother."""
FARTHEST = 0.2
"""[s] Longest extrapolation of a heading."""
FASTEST = 10.0
"""[rad/s] Largest yaw rate; a faster change is a confusion of markers."""


class Headings:
    """Headings of the nodes, (node, ...). Constant rotation is extrapolated exactly."""

    def __init__(self, n: int) -> None:
        self.q_wb: F64 = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        """Last reported orientation, (node, 4)."""
        self.t: F64 = np.full(n, -np.inf)
        """Time of the last report, (node) [s]; -inf before the first one."""
        self._rate: F64 = np.full(n, np.nan)

    def forget(self, node: int) -> None:
        """Discard the reports of a node."""
        self.t[node], self._rate[node] = -np.inf, np.nan

    def take(self, reports: list[tuple[int, HeadingReport]]) -> None:
        """Process reports; one older than the last of its node is ignored."""
        for node, heading in reports:
            dt = heading.t - self.t[node]
            if dt < 0.0:
                continue
            if 0.0 < dt < math.inf:
                self._turn(node, yaw_of(heading.q_wb) - yaw_of(self.q_wb[node]), dt)
            self.q_wb[node], self.t[node] = heading.q_wb, heading.t

    def turns(self, now: float) -> F64:
        """Return the rotation of each node since its last report, (node) [rad]."""
        known = np.isfinite(self.t) & np.isfinite(self._rate)
        age = np.where(known, now - self.t, 0.0)
        turned: F64 = np.where(known, self._rate, 0.0) * np.clip(age, 0.0, FARTHEST)
        return turned

    def known(self, now: float, stale: float) -> Bool:
        """Return whether each heading was reported within the last `stale` [s], (node)."""
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
    """Return the angle of the body's x axis from east, counter-clockwise [rad]."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
