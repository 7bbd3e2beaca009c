"""Simulated episodes as a comparison reads them; the truth is at hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.utils import seeding

from relpos_env.config import Parts
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations.base import F32
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool


class Simulated:
    """A batch of environments as a `agents.comparison.meter.Running`."""

    def __init__(self, parts: Parts, seeds: Sequence[int]) -> None:
        """Begin an episode in every environment.

        Args:
            parts: What the environments are made of.
            seeds: Of the episodes.
        """
        self.formation = EnvCore(parts, len(seeds))
        for env, seed in enumerate(seeds):
            self.formation.seed(env, seeding.np_random(seed)[0])
            self.formation.begin([env])

    @property
    def car(self) -> CarParams:
        """That of the scenario, whatever mass is drawn."""
        return self.formation.parts.scenario.car

    @property
    def cycles(self) -> int:
        """Decisions of the longest episode."""
        return self.formation.parts.config.max_cycles

    @property
    def observations(self) -> F32:
        """What the cars see, (env, car, size)."""
        return self.formation.observations

    @property
    def present(self) -> Bool:
        """Who is in the room, (env, car)."""
        return self.formation.state.present

    @property
    def speed(self) -> F64:
        """True ones, (env, car) [m/s]."""
        vel = self.formation.state.vel_w
        speed: F64 = np.hypot(vel[..., 0], vel[..., 1])
        return speed

    @property
    def error(self) -> F64:
        """Formation error by the truth, (env, car) [m]."""
        return self.formation.task.error

    @property
    def place_error(self) -> F64:
        """By the truth, (env) [m]; NaN where no car is present or has a place."""
        f, present = self.formation, self.formation.state.present
        count = (present & f.task.has_target.any(axis=-1)).sum(axis=-1)
        off = np.where(present[..., None], f.state.pos_w - f.task.goal_w, 0.0).sum(axis=1)
        place: F64 = np.where(count > 0, np.linalg.norm(off, axis=-1), np.nan) / np.maximum(
            count, 1
        )
        return place

    @property
    def tracking_error(self) -> F64:
        """Of the relative positions that cars could use, (env, car) [m]."""
        return self.formation.tracking_error()

    @property
    def collisions(self) -> F64:
        """That cars began in the last decision, (env, car) [-]."""
        return self.formation.loop.swarm.contacts

    @property
    def clearance(self) -> F64:
        """By the truth, (env, car) [m]."""
        return self.formation.state.clearance

    @property
    def done(self) -> Bool:
        """Whether the task is accomplished, (env)."""
        return self.formation.task.done

    @property
    def over(self) -> Bool:
        """Whether the episode has ended, (env)."""
        return self.formation.terminated | self.formation.truncated

    def step(self, actions: F32) -> None:
        """One decision of all cars; see `Running`."""
        self.formation.step(*self.formation.parts.actions.decode(actions, "actions"))

    def close(self) -> None:
        """Release the batch."""
        self.formation.close()
