"""Estimated state of the cars, in place of the unknown ground truth.

Relative positions leave the translation of the group undetermined: the mean of the cars with a
position is the origin. In tasks, only the location of a path in the room depends on it.

While the tracker is not certain of a car, the car's position is propagated by its odometer.
"""

from __future__ import annotations

import numpy as np

from relpos_env.interface.views import AgentView
from tracking.arrays import F64, Bool


class EstimatedState:
    """State of the world for tasks, arrays over (1, slot, ...); world frame."""

    def __init__(self, n_cars: int) -> None:
        shape = (1, n_cars)
        self.pos_w: F64 = np.zeros((*shape, 2))
        """[m] Positions."""
        self.vel_w: F64 = np.zeros((*shape, 2))
        """[m/s] Velocities by odometer and heading."""
        self.accel_w: F64 = np.zeros((*shape, 2))
        """[m/s2] Mean accelerations since the last update."""
        self.clearance: F64 = np.full(shape, np.inf)
        """[m] Distances to obstacles; infinite, since they are unknown."""
        self.present: Bool = np.zeros(shape, dtype=bool)
        self.known: Bool = np.zeros(shape, dtype=bool)
        """True if the position relative to the others is known."""
        self._placed: Bool = np.zeros(n_cars, dtype=bool)

    def update(self, view: AgentView, seconds: float) -> None:
        """Update the state from a view.

        Args:
            view: View of one environment.
            seconds: Time since the last update [s].
        """
        present = view.present[0]
        self.present[0] = present
        self._move(view, seconds)
        self._placed &= present
        ok = view.ok[0] & present[:, None] & present[None, :]
        self.known[0] = False
        if present.any():
            # Positions are relative to the car with the most known others.
            seer = int(np.argmax(ok.sum(axis=1) + 0.5 * present))
            known = ok[seer].copy()
            known[seer] = True
            self.known[0] = known
            seen, both = view.pos[0, seer], known & self._placed
            # Propagated positions are shifted to fit the cars that are known and had a position.
            shift = (seen - self.pos_w[0])[both].mean(axis=0) if both.any() else 0.0
            pos = np.where(known[:, None], seen, self.pos_w[0] + shift)
            self._placed = known | (self._placed & both.any())
            self.pos_w[0] = np.where(
                self._placed[:, None], pos - pos[self._placed].mean(axis=0), 0.0
            )

    def _move(self, view: AgentView, seconds: float) -> None:
        """Propagate all positions by odometer and heading."""
        ahead = np.stack([np.cos(view.heading[0]), np.sin(view.heading[0])], axis=-1)
        moves = view.present[0] & view.oriented[0]
        vel = np.where(moves[:, None], view.speed[0][:, None] * ahead, 0.0)
        self.accel_w[0] = (vel - self.vel_w[0]) / max(seconds, 1e-3)
        self.pos_w[0] += 0.5 * (vel + self.vel_w[0]) * seconds
        self.vel_w[0] = vel

    @property
    def complete(self) -> bool:
        """True if the positions of all present cars are known, at least two."""
        present = self.present[0]
        return bool(present.sum() >= 2 and self.known[0, present].all())
