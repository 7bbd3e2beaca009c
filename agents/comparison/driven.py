"""Episodes of real cars for a comparison, measured by the tracker's estimates."""

from __future__ import annotations

import numpy as np

from hardware_bridge.live.env import HardwareFormationEnv
from relpos_env.interface.actions import action_mode
from relpos_env.interface.observations.base import F32
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool


class Driven:
    """A group of real cars as an `agents.comparison.meter.Running` of one environment."""

    def __init__(self, env: HardwareFormationEnv, cycles: int) -> None:
        """Begin an episode after the cars are armed and their tracker has converged.

        Args:
            env: Environment of the real cars.
            cycles: Control steps of an episode.

        Raises:
            BridgeError: The cars could not be armed.
        """
        env.reset()
        self._env, self._group = env, env.group
        self._actions = action_mode("continuous")
        self._unknown: F64 = np.full(self._group.active.shape, np.nan)
        self.car, self.cycles = CarParams(), cycles

    @property
    def observations(self) -> F32:
        """Observations of the cars, (1, car, size)."""
        return self._group.observations

    @property
    def present(self) -> Bool:
        """True for cars that are received, (1, car)."""
        return self._group.estimated.present

    @property
    def speed(self) -> F64:
        """Odometer speed, (1, car) [m/s]."""
        speed: F64 = np.abs(self._group.swarm.view.speed)
        return speed

    @property
    def error(self) -> F64:
        """Formation error by the estimates, (1, car) [m]."""
        return self._group.task.error

    @property
    def place_error(self) -> F64:
        """Not measurable on hardware; NaN, (1,)."""
        return self._unknown[:, 0]

    @property
    def tracking_error(self) -> F64:
        """Not measurable on hardware; NaN, (1, car)."""
        return self._unknown

    @property
    def disagreement(self) -> F64:
        """NaN: one tracker serves the group, (1, car)."""
        return self._unknown

    @property
    def collisions(self) -> F64:
        """Not measurable on hardware; NaN, (1, car)."""
        return self._unknown

    @property
    def clearance(self) -> F64:
        """Not measurable on hardware; NaN, (1, car)."""
        return self._unknown

    @property
    def done(self) -> Bool:
        """True if the task is accomplished by the estimates, (1,)."""
        return self._group.task.done

    @property
    def over(self) -> Bool:
        """True if the episode has ended, (1,)."""
        return self._group.terminated | self._group.truncated

    def step(self, actions: F32) -> None:
        """Run one control step of all cars in real time; see `Running`."""
        self._group.step(*self._actions.decode(actions, "actions"))

    def close(self) -> None:
        """Stop the cars."""
        self._env.close()
