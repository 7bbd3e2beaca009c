"""Scripted drivers of a recorded run: people with remote controls who see the room."""

from __future__ import annotations

import numpy as np

from relpos_env.interface.actions import DriveCommand
from relpos_env.scenarios import Scenario
from relpos_env.world.world_state import WorldState
from tracking.arrays import F64, Bool


class LoopDrivers:
    """Drivers that circle the middle of the room, each at its own varying speed and radius.

    They steer along the loop, keep away from each other and from the walls, and reverse when
    they are stuck.
    """

    def __init__(
        self, scenario: Scenario, rng: np.random.Generator, n_cars: int | None = None
    ) -> None:
        n = scenario.n_cars if n_cars is None else n_cars
        self._scenario = scenario
        self._ring = np.array(scenario.ring)
        self._frequency = rng.uniform(0.03, 0.12, (3, n))
        self._phase = rng.uniform(0.0, 2.0 * np.pi, (3, n))
        self._stuck_since = np.full(n, np.inf)
        self._back_until = np.full(n, -np.inf)

    def command(self, state: WorldState) -> DriveCommand:
        """Return the current command of every driver."""
        n = len(state.heading)
        wave = np.sin(2.0 * np.pi * self._frequency * state.t + self._phase)
        speed = 1.2 + 0.5 * wave[0]
        lane = 1.0 + 0.18 * wave[1]
        desired = self._loop_direction(state.pos_w, lane) + self._keep_apart(
            state.pos_w, state.present
        )
        error = np.arctan2(desired[:, 1], desired[:, 0]) - state.heading + 0.25 * wave[2]
        error = (error + np.pi) % (2.0 * np.pi) - np.pi
        steering = np.clip(1.5 * error, -0.42, 0.42)
        speed = np.where(np.abs(error) > 1.2, 0.6, speed)
        for k in range(n):
            slow = abs(state.speed[k]) < 0.1 and state.t > 1.0
            self._stuck_since[k] = min(self._stuck_since[k], state.t) if slow else np.inf
            if state.t - self._stuck_since[k] > 0.5:
                self._back_until[k] = state.t + 0.8
                self._stuck_since[k] = np.inf
            if state.t < self._back_until[k]:
                speed[k], steering[k] = -0.7, -steering[k]
        return DriveCommand(float(state.t), speed, steering)

    def _loop_direction(self, pos: F64, lane: F64) -> F64:
        """Return the direction along the ellipse and towards the lane, (car, 2)."""
        scaled = pos / self._ring
        radius = np.maximum(np.linalg.norm(scaled, axis=1), 1e-3)[:, None]
        tangent = np.stack([-scaled[:, 1], scaled[:, 0]], axis=1) * self._ring
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-6)
        outward = pos / np.maximum(np.linalg.norm(pos, axis=1, keepdims=True), 1e-3)
        direction: F64 = tangent + 2.0 * (lane[:, None] - radius) * outward
        return direction

    def _keep_apart(self, pos: F64, present: Bool) -> F64:
        """Return the direction away from cars within 0.9 m and walls within 0.4 m, (car, 2)."""
        away = pos[:, None] - pos[None, :]
        distance = np.linalg.norm(away, axis=-1) + 1e3 * (np.eye(len(pos)) + ~present)
        push = np.maximum(0.9 - distance, 0.0) / np.maximum(distance, 0.1)
        others = 2.0 * np.sum(push[..., None] * away, axis=1)
        half = 0.5 * np.array(self._scenario.room)
        walls = 3.0 * (np.maximum(-pos - half + 0.4, 0.0) - np.maximum(pos - half + 0.4, 0.0))
        total: F64 = others + walls
        return total
