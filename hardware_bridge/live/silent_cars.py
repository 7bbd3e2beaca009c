"""Silent cars: they may be obstacles to the others until an operator dismisses them.

The last well-known relative position of each is propagated by the cars' motion, with growing
uncertainty. Only the safety gate uses it, once the car has left.
"""

from __future__ import annotations

import numpy as np

from hardware_bridge.safety.picture import Picture
from relpos_env.interface.views import AgentView
from tracking.arrays import F64, Bool
from tracking.estimate import Status

SILENT = 0.5
"""[-] `Picture.present` of a silent car: others avoid it, and it is disarmed."""
GROWTH = 0.05
"""[m/s] Growth of its position uncertainty: dead reckoning of the others, and it may roll."""


class SilentCars:
    """Silent cars of one group."""

    def __init__(self, n_slots: int) -> None:
        self.here: Bool = np.zeros(n_slots, dtype=bool)
        """True for silent cars that are not known to be gone, (slot)."""
        self._pos: F64 = np.zeros((n_slots, n_slots, 2))
        self._sigma: F64 = np.full((n_slots, n_slots), np.inf)
        self._t = -np.inf

    def note(self, view: AgentView, sigma: F64, recent: Bool) -> None:
        """Store the known positions of cars with recent messages.

        Args:
            view: View of one environment.
            sigma: Largest standard deviation of each relative position, (slot, slot) [m].
            recent: True for cars with recent messages, (slot).
        """
        known = view.ok[0] & np.isfinite(sigma) & recent
        self._pos[known] = view.pos[0][known]
        self._sigma[known] = sigma[known]

    def keep(self, slot: int) -> None:
        """Mark a car that has left as silent."""
        self.here[slot] = True

    def forget(self, slot: int) -> None:
        """Mark a car as not silent, after its next message."""
        self.here[slot] = False

    def dismiss(self) -> None:
        """Mark all silent cars as gone, as an operator's command."""
        self.here[:] = False

    def move(self, view: AgentView, t: float) -> None:
        """Propagate positions to the time of a view [s], by the cars' odometry."""
        elapsed = t - self._t if np.isfinite(self._t) else 0.0
        self._t = t
        own = _velocities(view)
        self._pos += elapsed * (own - own[:, None])
        self._sigma += elapsed * GROWTH

    def write(self, q: Picture, view: AgentView) -> None:
        """Write silent cars into a snapshot, at rest at their last positions."""
        own = _velocities(view)
        for slot in np.flatnonzero(self.here).tolist():
            q.present[0, slot] = SILENT
            others = np.arange(len(self.here)) != slot
            for a, b, sign in ((others, slot, 1.0), (slot, others, -1.0)):
                q.status[0, a, b], q.sound[0, a, b] = Status.OK, 1.0
                q.sigma[0, a, b] = self._sigma[others, slot]
                q.pos[0, a, b] = sign * self._pos[others, slot]
                q.vel[0, a, b] = -sign * own[others]


def _velocities(view: AgentView) -> F64:
    """Return the world velocities of the cars by heading and odometer, (slot, 2) [m/s]."""
    ahead = np.stack([np.cos(view.heading[0]), np.sin(view.heading[0])], axis=-1)
    velocities: F64 = ahead * np.where(view.present[0], view.speed[0], 0.0)[:, None]
    return velocities
