"""Relative positions of the other cars, where they should be, and the car's own motion."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from relpos_env.interface.observations.base import Field
from relpos_env.interface.views import AgentView
from tracking.arrays import F64

FAR = 20.0
"""[m] Limit of positions in an observation."""


class RelativePositions:
    """Others in the order of their number, this car left out; zeros where the mask is 0."""

    def __init__(self, n_cars: int, *, needs_truth: bool) -> None:
        self.needs_truth = needs_truth
        n = n_cars - 1
        self.fields = (
            Field("mask", n, "-", "1 where the estimate of that car can be used", 1.0),
            Field("pos", 2 * n, "m", "position of each other car: forward, left", FAR),
            Field("vel", 2 * n, "m/s", "its velocity relative to this car", 10.0),
            Field("std", n, "m", "standard deviation of that position", FAR),
            Field("target", 2 * n, "m", "where that car should be", FAR),
            Field("command", 2, "m/s", "velocity asked by the operator", 10.0),
            Field("heading", 2, "-", "cosine and sine of the heading", 1.0),
            Field("motion", 2, "m/s, rad", "own speed and steering angle", 10.0),
        )
        self._others = np.array([[b for b in range(n_cars) if b != a] for a in range(n_cars)])
        self._limit = np.concatenate([np.full(f.size, f.limit) for f in self.fields])

    def space(self) -> spaces.Box:
        """The observation space of one car."""
        limit = self._limit.astype(np.float32)
        return spaces.Box(-limit, limit, dtype=np.float32)

    def observe(self, view: AgentView) -> F64:
        """Observations of every car, (car, size)."""
        n_cars = len(view.heading)
        rows = np.arange(n_cars)[:, None]
        ok = view.ok[rows, self._others]
        known = ok[..., None]
        parts = [
            ok.astype(np.float64),
            np.where(known, view.pos_b[rows, self._others], 0.0).reshape(n_cars, -1),
            np.where(known, view.vel_b[rows, self._others], 0.0).reshape(n_cars, -1),
            np.where(ok, view.pos_std[rows, self._others], 0.0),
            view.target_b[rows, self._others].reshape(n_cars, -1),
            view.command_b,
            np.stack([np.cos(view.heading), np.sin(view.heading)], axis=1),
            np.stack([view.speed, view.steering], axis=1),
        ]
        rows_of_all: F64 = np.clip(np.concatenate(parts, axis=1), -self._limit, self._limit)
        return rows_of_all
