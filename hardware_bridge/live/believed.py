"""Where cars believe themselves to be, in the place of a truth that nobody has.

Relative positions leave one place open: it is chosen so that the present cars' middle is the
origin. Tasks ask for nothing that depends on it but where a path lies in the room.
"""

from __future__ import annotations

import numpy as np

from relpos_env.interface.views import View
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
        self.present: Bool = np.zeros(shape, dtype=bool)
        self.known: Bool = np.zeros(shape, dtype=bool)
        """Whose place is known relative to the others'."""

    def update(self, view: View, seconds: float) -> None:
        """Take over what the cars see now.

        Args:
            view: Of one environment.
            seconds: Since the last update [s].
        """
        present = view.present[0]
        ok = view.ok[0] & present[:, None] & present[None, :]
        self.present[0] = present
        self.known[0] = False
        self.pos_w[0] = 0.0
        if present.any():
            # Seen from whoever knows most of the others.
            seer = int(np.argmax(ok.sum(axis=1) + 0.5 * present))
            known = ok[seer].copy()
            known[seer] = True
            pos = np.where(known[:, None], view.pos[0, seer], 0.0)
            self.pos_w[0] = np.where(known[:, None], pos - pos[known].mean(axis=0), 0.0)
            self.known[0] = known
        ahead = np.stack([np.cos(view.heading[0]), np.sin(view.heading[0])], axis=-1)
        moves = present & view.oriented[0]
        vel = np.where(moves[:, None], view.speed[0][:, None] * ahead, 0.0)
        self.accel_w[0] = (vel - self.vel_w[0]) / max(seconds, 1e-3)
        self.vel_w[0] = vel

    @property
    def complete(self) -> bool:
        """Whether every present car's place is known, of at least two."""
        present = self.present[0]
        return bool(present.sum() >= 2 and self.known[0, present].all())
