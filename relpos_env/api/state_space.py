"""True state for critics, of all cars or relative to each car, inside a space."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from relpos_env.config import Parts
from relpos_env.interface.observations.base import F32
from relpos_env.world.world_state import WorldState
from tracking.arrays import F64

N_TRUTH = 8
"""[-] Number of true values of each car: 1, x, y, cosine and sine of the heading, velocity x, y,
yaw rate."""
FASTEST, FASTEST_TURN = 20.0, 100.0
"""[m/s, rad/s] Velocities are clipped at these limits; no car is that fast."""


def state_space(parts: Parts) -> spaces.Box:
    """Return the space of `truth_inside` for one environment, (8 car)."""
    w, d = 0.5 * parts.scenario.room[0], 0.5 * parts.scenario.room[1]
    high = np.array([1.0, w, d, 1.0, 1.0, FASTEST, FASTEST, FASTEST_TURN], dtype=np.float32)
    low = -high
    low[0] = 0.0
    return spaces.Box(np.tile(low, parts.n_cars), np.tile(high, parts.n_cars), dtype=np.float32)


def truth_inside(state: WorldState, space: spaces.Box) -> F32:
    """Return the true state of every environment, clipped to the space, (env, 8 car)."""
    flat = truth_of(state).reshape(len(state.heading), -1)
    truth: F32 = np.clip(flat, space.low, space.high).astype(np.float32)
    return truth


def truth_of(state: WorldState) -> F64:
    """Return `N_TRUTH` values of every car, zeros for absent ones, (env, car, 8)."""
    columns = [
        np.ones_like(state.heading),
        state.pos_w[..., 0],
        state.pos_w[..., 1],
        np.cos(state.heading),
        np.sin(state.heading),
        state.vel_w[..., 0],
        state.vel_w[..., 1],
        state.yaw_rate,
    ]
    truth: F64 = np.stack(columns, axis=-1) * state.present[..., None]
    return truth


def truth_of_each(state: WorldState) -> F64:
    """Return the true state relative to each car, for critics of one car, (env, car, 8 car).

    The car itself comes first, with its position in the room, then the others relative to it;
    directions are in its frame. The values are those of `truth_of`, zeros for absent cars.
    """
    s = truth_of(state)
    n_envs, n, _ = s.shape
    seen = s[:, (np.arange(n)[:, None] + np.arange(n)) % n]
    own = s[:, :, None]
    c, sn = own[..., 3], own[..., 4]
    relative = seen.copy()
    offset = seen[..., 1:3] - own[..., 1:3]
    for k, vector in ((1, offset), (3, seen[..., 3:5]), (5, seen[..., 5:7])):
        x, y = vector[..., 0], vector[..., 1]
        relative[..., k], relative[..., k + 1] = c * x + sn * y, c * y - sn * x
    relative[:, :, 0, 1:3] = s[..., 1:3]
    truth: F64 = (relative * seen[..., :1] * own[..., :1]).reshape(n_envs, n, -1)
    return truth
