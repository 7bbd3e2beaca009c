"""Actions of the timed cars: a controller that follows the task, or random noise.

Both return shares of the largest speed and steering, (env, car, 2), for a whole batch.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from relpos_env.core.env_core import EnvCore
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from tracking.arrays import F64

Drive = Callable[[EnvCore], F64]

PULL = 0.8
"""[1/s] Gain from distance to the formation slot to speed."""
LOOKAHEAD = 0.6
"""[m] Lookahead distance of pure pursuit."""
LEAST_SPEED, MOST_SPEED = 0.3, 0.9
"""[m/s] Speed range of random driving."""
KEEP = 0.95
"""[-] Autocorrelation of the noise from step to step, a correlation time of 2 s."""


def followed(formation: EnvCore) -> F64:
    """Return actions of pure pursuit of operator command and formation slot, from the truth.

    With the heading error e of the target velocity and the lookahead d, the arc has curvature
    2 sin(e) / d (Coulter, CMU-RI-TR-92-01) and the steering is atan(wheelbase curvature).
    """
    state, task = formation.state, formation.task
    desired = formation.operator.command + PULL * (task.goal_w - state.pos_w)
    off = np.arctan2(desired[..., 1], desired[..., 0]) - state.heading
    off = np.arctan2(np.sin(off), np.cos(off))
    wheelbase = formation.parts.scenario.car.wheelbase
    turn = np.sin(np.clip(off, -0.5 * np.pi, 0.5 * np.pi))
    steering = np.arctan(wheelbase * 2.0 * turn / LOOKAHEAD)
    speed = np.linalg.norm(desired, axis=-1) * np.clip(np.cos(off), 0.3, 1.0)
    return _shares(speed, steering)


class Chance:
    """Smooth random actions from Gauss-Markov noise, with which cars end up at the walls."""

    def __init__(self, seed: int = 0) -> None:
        self._rng = np.random.default_rng(seed)
        self._noise: F64 | None = None

    def __call__(self, formation: EnvCore) -> F64:
        """Return the actions of the next step."""
        fresh = self._rng.normal(size=(*formation.active.shape, 2))
        if self._noise is None:
            self._noise = fresh
        self._noise = KEEP * self._noise + np.sqrt(1.0 - KEEP**2) * fresh
        share = 0.5 + 0.5 * np.tanh(self._noise[..., 0])
        speed = LEAST_SPEED + (MOST_SPEED - LEAST_SPEED) * share
        return _shares(speed, 0.5 * MAX_STEERING * self._noise[..., 1])


def _shares(speed: F64, steering: F64) -> F64:
    actions: F64 = np.stack([speed / MAX_SPEED, steering / MAX_STEERING], axis=-1)
    return np.clip(actions, -1.0, 1.0)
