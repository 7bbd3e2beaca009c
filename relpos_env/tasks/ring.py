"""A ring that turns: cars keep even places on a circle and circle together.

All accelerate differently, so the group's rotation stays observable. The cars see each other
through their trackers only. An operator with a remote control sees the room: he asks for the
circling speed and trims the centre of the group back to the centre of the room.
"""

from __future__ import annotations

import numpy as np

from relpos_env.scenarios import Scenario
from relpos_env.world import WorldState
from tracking.arrays import F64

LOOKAHEAD = 0.3
"""[s] The operator asks for the velocity of so much later, which covers the cars' lag."""
TRIM_GAIN = 0.4
"""[1/s] How firmly the operator brings the group back to the centre."""
COLLISION_COST = 1.0
"""[-] Reward lost with every contact."""


class RingFormation:
    """Even places on a circle, turning counter-clockwise at a constant rate."""

    def __init__(self, scenario: Scenario, speed: float = 1.0) -> None:
        self._n = scenario.n_cars
        self._radius = float(np.min(scenario.ring))
        self._rate = speed / self._radius
        self._phase = np.zeros(self._n)

    def reset(self, state: WorldState) -> None:
        """Begin where the cars stand: places go in the order in which the cars stand."""
        angle = np.arctan2(state.pos_w[:, 1], state.pos_w[:, 0])
        spacing = 2.0 * np.pi / self._n
        slots = spacing * np.argsort(np.argsort(np.mod(angle, 2.0 * np.pi)))
        # The common phase that puts the places nearest to the cars.
        start = np.angle(np.mean(np.exp(1j * (angle - slots))))
        self._phase = start + slots

    def offsets(self, t: float) -> F64:
        """Wanted positions relative to the centre, (car, 2) [m]."""
        angle = self._phase + self._rate * t
        offsets: F64 = self._radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return offsets

    def target(self, t: float) -> F64:
        """Wanted relative positions, (car, other, 2) [m]."""
        offsets = self.offsets(t)
        return offsets[None, :] - offsets[:, None]

    def command(self, state: WorldState, t: float) -> F64:
        """Circling velocity a little ahead of now, plus the operator's trim, (car, 2) [m/s]."""
        ahead = self.offsets(t + LOOKAHEAD)
        circling = self._rate * np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
        trim = -TRIM_GAIN * state.pos_w.mean(axis=0)
        velocity: F64 = circling + trim
        return velocity

    def error(self, state: WorldState, t: float) -> F64:
        """Mean distance of the others from where they should be, (car) [m]."""
        actual = state.pos_w[None, :] - state.pos_w[:, None]
        distance = np.linalg.norm(actual - self.target(t), axis=-1)
        error: F64 = distance.sum(axis=1) / (self._n - 1)
        return error

    def rewards(self, state: WorldState, t: float, collided: F64) -> dict[str, F64]:
        """Nearness to the formation, and contacts."""
        return {
            "formation": np.exp(-self.error(state, t) / 0.5),
            "collision": -COLLISION_COST * collided,
        }
