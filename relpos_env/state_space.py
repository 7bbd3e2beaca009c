"""The truth for critics, inside a space."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from relpos_env.config import Parts
from relpos_env.formation import Formation
from relpos_env.interface.observations.base import F32

FASTEST, FASTEST_TURN = 20.0, 100.0
"""[m/s], [rad/s] Velocities beyond are cut off; no car of ours is so fast."""


def state_space(parts: Parts) -> spaces.Box:
    """The space of `Formation.truth` of one environment, (8 car)."""
    w, d = 0.5 * parts.scenario.room[0], 0.5 * parts.scenario.room[1]
    high = np.array([1.0, w, d, 1.0, 1.0, FASTEST, FASTEST, FASTEST_TURN], dtype=np.float32)
    low = -high
    low[0] = 0.0
    return spaces.Box(np.tile(low, parts.n_cars), np.tile(high, parts.n_cars), dtype=np.float32)


def truth_inside(formation: Formation, space: spaces.Box) -> F32:
    """The truth of every environment, cut off at the limits of the space, (env, 8 car)."""
    truth: F32 = np.clip(formation.truth(), space.low, space.high).astype(np.float32)
    return truth
