"""The tracker in the loop: rooms, their measurements, and what the cars believe.

    command -> Swarm -> measurements -> Horizon -> Tracker -> view of every car

The tracker gets nothing but measurements. Its estimate is as old as the horizon's delay and
is carried to the present: positions at constant velocity, headings by the gyroscopes.
"""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from relpos_env.interface._view_kernels import forget_all, note_ranges
from relpos_env.interface.views import View, bind_view, make_view
from relpos_env.scenarios import Scenario
from relpos_env.scenarios.episode import Episode
from relpos_env.swarm import Swarm
from relpos_env.timing import DT, STAND_STILL
from tracking.arrays import F64, Bool
from tracking.compiled import bind
from tracking.estimate import TeamEstimate
from tracking.horizon import Horizon, HorizonParams
from tracking.measurements import MeasurementBlock
from tracking.ranging.airtime import round_rate
from tracking.tracker import Tracker, TrackerParams


def default_params(scenario: Scenario, n_cars: int) -> TrackerParams:
    """What the trackers believe by default: they wait for ranges as long as a round takes."""
    radio = scenario.radio.for_nodes(n_cars)
    rounds = 1.5 / round_rate(radio.session.phy, n_cars)
    return TrackerParams(horizon=HorizonParams(delay=max(HorizonParams().delay, rounds)))


def waiting_at_most(scenario: Scenario, n_cars: int, params: TrackerParams, n_steps: int) -> int:
    """Measurements that the horizon holds at a time, and some."""
    pairs = n_cars * (n_cars - 1) // 2
    phy = scenario.radio.for_nodes(n_cars).session.phy
    rate = 2 * n_cars / DT + pairs * round_rate(phy, n_cars)
    return int(1.2 * rate * (params.horizon.delay + 2 * n_steps * DT)) + 4 * pairs


class TrackedSwarm:
    """Groups of cars that know each other through their trackers."""

    def __init__(
        self,
        scenario: Scenario,
        n_cars: int,
        n_envs: int = 1,
        *,
        filter: str,
        params: TrackerParams,
        n_steps: int = 10,
        proximity: int = 0,
    ) -> None:
        self.swarm = Swarm(scenario, n_cars, n_envs, n_steps, proximity)
        self.tracker = Tracker(self.swarm.constellation, params, filter=filter, n_envs=n_envs)
        self.horizon = Horizon(params.horizon, n_envs)
        self._room = waiting_at_most(scenario, n_cars, params, n_steps)
        self.horizon.reserve(self._room)
        self.view: View = make_view(n_envs, n_cars, proximity)
        self.estimate = TeamEstimate.empty(self.swarm.constellation, np.zeros(n_envs))
        """The tracker's last estimate, as old as the horizon, overwritten by the next."""
        self._bind()

    def part(self, envs: slice) -> TrackedSwarm:
        """Some of the groups; shares their memory."""
        part = copy.copy(self)
        part.swarm = self.swarm.part(envs)
        part.tracker, part.horizon = self.tracker.part(envs), self.horizon.part(envs)
        part.view = self.view.part(envs)
        whole = self.estimate
        part.estimate = TeamEstimate(
            whole.constellation, whole.t[envs], *(array[envs] for array in whole.arrays)
        )
        part._bind()
        return part

    def share(self, target: F64, wanted: Bool, command: F64) -> None:
        """Let the view have what the task and the operator want, in their own memory.

        Args:
            target: As in `View`.
            wanted: As in `View`.
            command: As in `View`.
        """
        self.view = self.view._replace(target=target, wanted=wanted, command=command)
        self._bind()

    def begin(
        self,
        env: int,
        episode: Episode,
        rng: np.random.Generator,
        watch: Callable[[Swarm], None] | None = None,
    ) -> None:
        """Begin a group anew and let it stand while its trackers are switched on.

        Args:
            env: Which.
            episode: What it is made of.
            rng: Its own.
            watch: Called with the group after each of its steps.
        """
        self.swarm.begin(env, episode, rng)
        self.tracker.reset(env)
        self.horizon.reset(env)
        forget_all(self.view, env)
        if env not in self._singles:
            self._singles[env] = self.part(slice(env, env + 1))
        still = np.zeros((1, self.view.speed.shape[1]))
        for _ in range(round(STAND_STILL / (DT * self.swarm.n_steps))):
            self._singles[env].step(still, still)
            if watch is not None:
                watch(self._singles[env].swarm)

    def step(self, speed: F64, steering: F64) -> None:
        """Drive for one decision and let the tracker catch up.

        Args:
            speed: Wanted, (env, car) [m/s].
            steering: Wanted, (env, car) [rad].
        """
        swarm, view = self.swarm, self.view
        swarm.step(speed, steering)
        state = swarm.state
        view.now[:] = swarm.t
        view.present[:] = state.present
        view.speed[:] = swarm.odometer
        view.steering[:] = state.steering
        view.near[:] = swarm.proximity
        self._wait()
        self.estimate.t[:] = self.horizon.state.released
        self._orient()
        self._follow()
        self._turn()
        self._see()
        self._note()

    def _bind(self) -> None:
        """Put together what the kernels take: arrays that stay where they are."""
        view, block = self.view, self.swarm.block
        due = MeasurementBlock.empty(self.swarm.n_envs, self._room)
        self._wait = self.horizon.bind(block, view.now, due)
        self._orient, self._follow = self.tracker.bind(due, self.estimate)
        turns = np.zeros_like(view.heading)
        self._turn = self.horizon.bind_turns(self.swarm.constellation, turns)
        self._see = bind_view(view, self.estimate, self.swarm.powered, turns)
        self._note = bind(
            note_ranges, block.t, block.kind, block.i, block.j, block.values, block.has_power,
            block.valid, view,
        )  # fmt: skip
        self._singles: dict[int, TrackedSwarm] = {}

    def __getstate__(self) -> dict[str, object]:
        """What is put together by `_bind` stays behind."""
        bound = ("_wait", "_orient", "_follow", "_turn", "_see", "_note", "_singles")
        return {k: v for k, v in self.__dict__.items() if k not in bound}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._bind()
