"""Simulated episodes for a comparison, measured by ground truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.utils import seeding

from agents.errors import UsageError
from relpos_env.config import Parts
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations.base import F32
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool


class Simulated:
    """A batch of environments as an `agents.comparison.meter.Running`."""

    def __init__(self, parts: Parts, seeds: Sequence[int]) -> None:
        """Begin an episode in every environment.

        Args:
            parts: Parts of the environments.
            seeds: Seeds of the episodes.
        """
        self.formation = EnvCore(parts, len(seeds))
        for env, seed in enumerate(seeds):
            self.formation.seed(env, seeding.np_random(seed)[0])
            self.formation.begin([env])

    @property
    def car(self) -> CarParams:
        """Nominal car of the scenario, without randomisation."""
        return self.formation.parts.scenario.car

    @property
    def cycles(self) -> int:
        """Control steps of the longest episode."""
        return self.formation.parts.config.max_cycles

    @property
    def observations(self) -> F32:
        """Observations of the cars, (env, car, size)."""
        return self.formation.observations

    @property
    def present(self) -> Bool:
        """True for present cars, (env, car)."""
        return self.formation.state.present

    @property
    def speed(self) -> F64:
        """True speed, (env, car) [m/s]."""
        vel = self.formation.state.vel_w
        speed: F64 = np.hypot(vel[..., 0], vel[..., 1])
        return speed

    @property
    def error(self) -> F64:
        """True formation error, (env, car) [m]."""
        return self.formation.task.error

    @property
    def place_error(self) -> F64:
        """True distance of the group's centre from that of its goals, (env,) [m]; NaN if none."""
        f, present = self.formation, self.formation.state.present
        count = (present & f.task.has_target.any(axis=-1)).sum(axis=-1)
        off = np.where(present[..., None], f.state.pos_w - f.task.goal_w, 0.0).sum(axis=1)
        place: F64 = np.where(count > 0, np.linalg.norm(off, axis=-1), np.nan) / np.maximum(
            count, 1
        )
        return place

    @property
    def tracking_error(self) -> F64:
        """Error of the usable relative positions, (env, car) [m]."""
        return self.formation.tracking_error()

    @property
    def disagreement(self) -> F64:
        """Difference of two cars' estimates of each other, (env, car) [m]; NaN for one tracker."""
        formation = self.formation
        if formation.parts.config.trackers == "group":
            return np.full(formation.rewards.shape, np.nan)
        disagreement: F64 = formation.infos()["disagreement"]
        return disagreement

    @property
    def collisions(self) -> F64:
        """Collisions that began in the last control step, (env, car) [-]."""
        return self.formation.loop.swarm.contacts

    @property
    def clearance(self) -> F64:
        """True distance from a car to the nearest object, (env, car) [m]."""
        return self.formation.state.clearance

    @property
    def done(self) -> Bool:
        """True if the task is accomplished, (env,)."""
        return self.formation.task.done

    @property
    def over(self) -> Bool:
        """True if the episode has ended, (env,)."""
        return self.formation.terminated | self.formation.truncated

    def step(self, actions: F32) -> None:
        """Run one control step of all cars; see `Running`."""
        mode = self.formation.parts.actions
        expected = (*self.formation.rewards.shape, *mode.shape)
        if np.shape(actions) != expected:
            raise UsageError(
                f"actions of the driver: expected {expected[1:]} of an environment, got "
                f"{np.shape(actions)[1:]}"
            )
        self.formation.step(*mode.decode(actions, "actions of the driver"))

    def close(self) -> None:
        """Release the batch."""
        self.formation.close()
