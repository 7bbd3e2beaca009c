"""Where cars believe themselves to be, in the place of a truth that is not known.

Relative positions leave one place open: it is chosen so that the middle of the cars with a place
is the origin. Tasks ask for nothing that depends on it but where a path lies in the room.

For the seconds in which the tracker is not sure of a car, its place goes on by its odometer.
"""

from __future__ import annotations

import numpy as np

from relpos_env.interface.views import AgentView
from tracking.arrays import F64, Bool


class Believed:
    """What tasks read of the world, arrays over (1, slot, ...); world frame."""

    def __init__(self, n_cars: int) -> None:
        shape = (1, n_cars)
        self.pos_w: F64 = np.zeros((*shape, 2))
        """[m]"""
        self.vel_w: F64 = np.zeros((*shape, 2))
        """[m/s] By odometer and heading."""
        self.accel_w: F64 = np.zeros((*shape, 2))
        """[m/s2] From one decision to the next."""
        self.clearance: F64 = np.full(shape, np.inf)
        """[m] Infinite: what stands next to them is not known."""
        self.present: Bool = np.zeros(shape, dtype=bool)
        self.known: Bool = np.zeros(shape, dtype=bool)
        """Whose place is known relative to the others'."""
        self._placed: Bool = np.zeros(n_cars, dtype=bool)

    def update(self, view: AgentView, seconds: float) -> None:
        """Take over what the cars see now.

        Args:
            view: Of one environment.
            seconds: Since the last update [s].
        """
        present = view.present[0]
        self.present[0] = present
        self._move(view, seconds)
        self._placed &= present
        ok = view.ok[0] & present[:, None] & present[None, :]
        self.known[0] = False
        if present.any():
            # Seen from the car that knows most of the others.
            seer = int(np.argmax(ok.sum(axis=1) + 0.5 * present))
            known = ok[seer].copy()
            known[seer] = True
            self.known[0] = known
            seen, both = view.pos[0, seer], known & self._placed
            # What went on is put next to those that are seen and had a place before.
            shift = (seen - self.pos_w[0])[both].mean(axis=0) if both.any() else 0.0
            pos = np.where(known[:, None], seen, self.pos_w[0] + shift)
            self._placed = known | (self._placed & both.any())
            self.pos_w[0] = np.where(
                self._placed[:, None], pos - pos[self._placed].mean(axis=0), 0.0
            )

    def _move(self, view: AgentView, seconds: float) -> None:
        """Everyone's place goes on by its odometer and heading."""
        ahead = np.stack([np.cos(view.heading[0]), np.sin(view.heading[0])], axis=-1)
        moves = view.present[0] & view.oriented[0]
        vel = np.where(moves[:, None], view.speed[0][:, None] * ahead, 0.0)
        self.accel_w[0] = (vel - self.vel_w[0]) / max(seconds, 1e-3)
        self.pos_w[0] += 0.5 * (vel + self.vel_w[0]) * seconds
        self.vel_w[0] = vel

    @property
    def complete(self) -> bool:
        """Whether every present car's place is known, of at least two."""
        present = self.present[0]
        return bool(present.sum() >= 2 and self.known[0, present].all())
