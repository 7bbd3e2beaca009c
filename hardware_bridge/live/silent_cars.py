"""Cars that have fallen silent: they may stand in the way of the others until a person says not.

The last place of each that was known well, relative to the others, is moved on by how far cars have
driven since, and grows uncertain. Only the safety gate looks at it, once the car has left.
"""

from __future__ import annotations

import numpy as np

from hardware_bridge.safety.picture import Picture
from relpos_env.interface.views import AgentView
from tracking.arrays import F64, Bool
from tracking.estimate import Status

SILENT = 0.5
"""[-] `Picture.present` of one: others look out for it, and it is held."""
GROWTH = 0.05
"""[m/s] By which its place grows uncertain: dead reckoning of the others, and it may roll."""


class SilentCars:
    """Of one group of so many slots."""

    def __init__(self, n_slots: int) -> None:
        self.here: Bool = np.zeros(n_slots, dtype=bool)
        """Which have fallen silent and are not known to be gone, (slot)."""
        self._pos: F64 = np.zeros((n_slots, n_slots, 2))
        self._sigma: F64 = np.full((n_slots, n_slots), np.inf)
        self._t = -np.inf

    def note(self, view: AgentView, sigma: F64, heard: Bool) -> None:
        """Note where those are that are heard and known to be there.

        Args:
            view: Of one environment.
            sigma: Largest standard deviation of where each is to each, (slot, slot) [m].
            heard: Which were heard just now, (slot).
        """
        known = view.ok[0] & np.isfinite(sigma) & heard
        self._pos[known] = view.pos[0][known]
        self._sigma[known] = sigma[known]

    def keep(self, slot: int) -> None:
        """One has left."""
        self.here[slot] = True

    def forget(self, slot: int) -> None:
        """One is heard again."""
        self.here[slot] = False

    def dismiss(self) -> None:
        """A person says that those who are silent are gone."""
        self.here[:] = False

    def move(self, view: AgentView, t: float) -> None:
        """Move on to the time of a view [s], by what cars say of their own driving."""
        elapsed = t - self._t if np.isfinite(self._t) else 0.0
        self._t = t
        own = _velocities(view)
        self._pos += elapsed * (own - own[:, None])
        self._sigma += elapsed * GROWTH

    def write(self, q: Picture, view: AgentView) -> None:
        """Let the gate see them: they stand where they were last."""
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
    """Of the cars in the world, by their own headings and odometers, (slot, 2) [m/s]."""
    ahead = np.stack([np.cos(view.heading[0]), np.sin(view.heading[0])], axis=-1)
    velocities: F64 = ahead * np.where(view.present[0], view.speed[0], 0.0)[:, None]
    return velocities
