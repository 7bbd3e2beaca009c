"""Vehicles that follow each other along one path: equal motions carry little information."""

import numpy as np

from tests.exact_motion import FINE, ExactGroup
from tracking.measurements import Kind

GAP, SPEED, STEP = 1.2, 0.9, 0.005
STRAIGHTS = ((-20.0, 8.0), (25.0, 38.0))
"""[m] Straight parts of the path; between them curvatures of up to 0.5 / m alternate."""


class Convoy(ExactGroup):
    """A convoy that starts from rest, with vibrating accelerations and lasting range errors."""

    def __init__(self, vehicle, n, seed, *, hz=50.0, seconds=60.0):
        rng = np.random.default_rng(seed)
        super().__init__(vehicle, range(n), hz=hz, seconds=seconds)
        s = np.arange(-20.0, SPEED * seconds + 5.0, STEP)
        curvature = 0.5 * np.sin(0.35 * (s - 8.0) + rng.uniform(0.0, 6.0))
        for begin, end in STRAIGHTS:
            curvature[(s >= begin) & (s < end)] = 0.0
        yaw = STEP * np.cumsum(curvature)
        path = STEP * np.cumsum(np.stack([np.cos(yaw), np.sin(yaw)], axis=-1), axis=0)
        u = np.clip(self.fine - 2.0, 0.0, 1.0)
        driven = SPEED * np.cumsum(u**3 * (10.0 - 15.0 * u + 6.0 * u**2)) / FINE
        at = driven[:, None] - GAP * np.arange(n)
        self._yaw = np.interp(at, s, yaw)
        self.pos = np.stack([np.interp(at, s, path[:, k]) for k in range(2)], axis=-1)
        if vehicle != "car":  # it need not follow the path exactly
            out = rng.normal(0.0, 0.08, n) + 0.05 * np.sin(0.8 * at + rng.uniform(0.0, 6.0, n))
            left = np.stack([-np.sin(self._yaw), np.cos(self._yaw)], axis=-1)
            self.pos += out[..., None] * left
        self.pos = np.concatenate([self.pos, np.zeros((*at.shape, 1))], axis=-1)
        self._vel = np.gradient(self.pos, self.fine, axis=0)
        self.block = self._measure(1.0 / hz)
        self._add_errors(rng)

    def _add_errors(self, rng):
        block, is_range = self.block, self.block.kind[0] == Kind.RANGE
        pair = 100 * block.i[0, is_range] + block.j[0, is_range]
        error = 0.05 * rng.standard_normal(is_range.sum())
        for each in np.unique(pair):
            lasting = np.cumsum(rng.normal(0.0, 0.001, np.sum(pair == each)))
            error[pair == each] += lasting - lasting.mean()
        block.values[0, is_range, 0] += error
        for node in range(self.constellation.n_nodes):
            of_node = (block.kind[0] == Kind.STATE) & (block.i[0] == node)
            noise = 0.35 * rng.standard_normal((of_node.sum(), 2)) + rng.normal(0.0, 0.03, 2)
            block.values[0, of_node, 4:6] += noise
