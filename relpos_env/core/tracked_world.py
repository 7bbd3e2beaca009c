"""Tracker in the loop: rooms, their measurements, and the estimates of the cars.

    command -> World -> measurements -> Perception -> view of every car

Measurements are the only input of the tracker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np

from relpos_env.interface.own_perception import OwnPerception
from relpos_env.interface.perception import FOR_POLICIES, Perception
from relpos_env.interface.views import AgentView
from relpos_env.scenarios import Scenario
from relpos_env.scenarios.episode import Episode
from relpos_env.timing import DT, STAND_STILL
from relpos_env.world.world import Physics, World
from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate
from tracking.filters import FilterBuilder
from tracking.late_data.horizon import HorizonParams
from tracking.measurements import Kind, MeasurementBlock
from tracking.ranging.compiled.overheard import Overheard
from tracking.ranging.frames.airtime import round_rate
from tracking.tracker import TrackerParams

Trackers = Literal["group", "own"]
"""``group``: one tracker receives the raw samples of all cars at no cost, as a host that listens;
``own``: each car has a tracker, which knows of the others what they send in ranging messages."""


def default_params(scenario: Scenario, n_cars: int, trackers: Trackers = "group") -> TrackerParams:
    """Return the default tracker parameters.

    Their horizon covers 1.5 ranging rounds, or 3.5 with a tracker on each car, which knows the
    motion of the others one round later, and one more for each lost message.
    """
    is_own = trackers == "own"
    radio = scenario.radio.with_motion() if is_own else scenario.radio
    phy = radio.for_nodes(n_cars).session.phy
    rounds = (3.5 if is_own else 1.5) / round_rate(phy, n_cars)
    horizon = HorizonParams(delay=max(HorizonParams().delay, rounds))
    return TrackerParams(filter=FOR_POLICIES, horizon=horizon)


def waiting_at_most(scenario: Scenario, n_cars: int, params: TrackerParams, n_steps: int) -> int:
    """Return an upper bound on the number of measurements in the horizon."""
    pairs = n_cars * (n_cars - 1) // 2
    phy = scenario.radio.for_nodes(n_cars).session.phy
    rate = 2 * n_cars / DT + pairs * round_rate(phy, n_cars)
    return int(1.2 * rate * (params.horizon.delay + 2 * n_steps * DT)) + 4 * pairs


class TrackedWorld:
    """Simulated groups of cars with a tracker for the group, or one on each car."""

    def __init__(
        self,
        scenario: Scenario,
        n_cars: int,
        n_envs: int = 1,
        *,
        filter: str | FilterBuilder,
        params: TrackerParams,
        trackers: Trackers = "group",
        n_steps: int = 10,
        proximity: int = 0,
        physics: Physics,
    ) -> None:
        is_own = trackers == "own"
        self.swarm = swarm = World(
            scenario, n_cars, n_envs, n_steps, proximity, physics, sends_motion=is_own
        )
        room = waiting_at_most(scenario, n_cars, params, n_steps)
        make = OwnPerception if is_own else Perception
        self.perception = make(
            swarm.constellation, params, *self._inputs(), filter=filter, room=room,
            n_rangefinders=proximity,
        )  # fmt: skip
        self.has_samples: Bool = np.ones(n_cars, dtype=bool)
        """False for cars without inertial sensors and magnetometer, (car)."""
        self._singles: dict[int, TrackedWorld] = {}

    @property
    def view(self) -> AgentView:
        """Current view of every car."""
        return self.perception.view

    @property
    def estimate(self) -> TeamEstimate:
        """Last estimate of the tracker, as old as the horizon; the next one overwrites it.

        Arrays over (env, ...); of trackers on each car over (env car, ...).
        """
        return self.perception.estimate

    def part(self, envs: slice) -> TrackedWorld:
        """Return a view of some of the groups that shares their memory."""
        part = TrackedWorld.__new__(TrackedWorld)  # a copy would bind all kernels, 2 ms
        part.swarm = self.swarm.part(envs)
        part.perception = self.perception.part(envs, *part._inputs())
        part.has_samples = self.has_samples
        part._singles = {}
        return part

    def share(self, target: F64, has_target: Bool, command: F64) -> None:
        """Let the view share the memory of the targets and commands of task and operator.

        Args:
            target: As in `AgentView`.
            has_target: As in `AgentView`.
            command: As in `AgentView`.
        """
        self.perception.share(target, has_target, command)
        self._singles = {}

    def begin(
        self,
        envs: Sequence[int],
        episodes: Sequence[Episode],
        rngs: Sequence[np.random.Generator],
        watch: Callable[[World], None] | None = None,
    ) -> None:
        """Reset some groups and keep them at rest while their trackers are switched on.

        Args:
            envs: Indices of the groups, ascending.
            episodes: Episode of each group.
            rngs: Generator of each group.
            watch: Called with the groups after each of their steps.
        """
        for env, episode, rng in zip(envs, episodes, rngs, strict=True):
            self.swarm.begin(env, episode, rng)
            self.perception.reset(env)
        steps = round(STAND_STILL / (DT * self.swarm.n_steps))
        for part in self._parts(envs):
            still = np.zeros((part.swarm.n_envs, self.view.speed.shape[1]))
            for _ in range(steps):
                part.step(still, still)
                if watch is not None:
                    watch(part.swarm)

    def _parts(self, envs: Sequence[int]) -> Iterator[TrackedWorld]:
        """Yield the groups to step: the whole batch at once, or each by itself."""
        if len(envs) == self.swarm.n_envs:
            yield self
            return
        for env in envs:
            if env not in self._singles:
                self._singles[env] = self.part(slice(env, env + 1))
            yield self._singles[env]

    def step(self, speed: F64, steering: F64) -> None:
        """Drive for one control period and update the tracker.

        Args:
            speed: Commanded speed, (env, car) [m/s].
            steering: Commanded steering angle, (env, car) [rad].
        """
        swarm, view = self.swarm, self.view
        swarm.step(speed, steering)
        state = swarm.state
        view.now[:] = swarm.t
        view.present[:] = state.present
        view.speed[:] = swarm.odometer
        view.steering[:] = state.steering
        view.near[:] = swarm.proximity
        if not self.has_samples.all():
            block = swarm.block
            is_sample = (block.kind == Kind.IMU) | (block.kind == Kind.MAG)
            block.valid[is_sample & ~self.has_samples[block.i]] = False
        self.perception.step()

    def _inputs(self) -> tuple[MeasurementBlock, Bool, Overheard]:
        """Return the arrays that the perception reads."""
        return self.swarm.block, self.swarm.powered, self.swarm.overheard

    def __getstate__(self) -> dict[str, object]:
        """Return the state without the parts."""
        return {**self.__dict__, "_singles": {}}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.perception.rebind(*self._inputs())
