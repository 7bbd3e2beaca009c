"""Batch of environments without an interface: rooms, trackers, operator, task, observations.

The PettingZoo, Gymnasium, Stable-Baselines3 and TorchRL environments are thin wrappers of this
one, so they cannot differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from relpos_env.config import Parts, whole_number
from relpos_env.core._outcome_kernels import TeamResults, judge, tracking_errors
from relpos_env.core.command_gate import make_gate
from relpos_env.core.own_rewards import check_task_rewards, own_reward
from relpos_env.core.reset_options import ResetOptions
from relpos_env.core.tracked_world import TrackedWorld
from relpos_env.errors import EnvError
from relpos_env.interface._info_kernels import write_figures
from relpos_env.interface.infos import Columns, car_columns, make_figures
from relpos_env.interface.observations import total_size
from relpos_env.interface.observations.base import F32
from relpos_env.interface.views import reveal
from relpos_env.scenarios.episode import draw_episode
from relpos_env.sensors.operator import Operator
from relpos_env.tasks import TASKS, DrivingTask, InformedTask, reward_weights
from relpos_env.timing import DECISION, DT, STAND_STILL
from relpos_env.world.world import Physics, World
from relpos_env.world.world_state import WorldState
from tracking.arrays import F64, I64, Bool
from tracking.kernels.jit import bind

MOST_ENVS = 1 << 20
NO_OPTIONS = ResetOptions()


class EnvCore:
    """Environments of one configuration, with their results in arrays.

    Properties: equal configurations, seeds and actions give equal results, bit for bit;
    environment k of a batch equals that environment alone.
    """

    def __init__(
        self, parts: Parts, n_envs: int = 1, threads: int = 1, physics: Physics = "fast"
    ) -> None:
        """Allocate the batch; `begin` starts its episodes.

        Args:
            parts: Resolved configuration of the environments.
            n_envs: Number of environments.
            threads: Number of parts of the batch that are stepped at a time.
            physics: Default if the configuration has no value.
        """
        n_envs = whole_number("n_envs", n_envs, 1, MOST_ENVS)
        threads = whole_number("threads", threads, 1, n_envs)
        self.parts, self.n_envs = parts, n_envs
        config, n = parts.config, parts.n_cars
        physics = config.physics or physics
        if parts.scenario.furnish is not None and physics != "pymunk":
            raise EnvError(
                f"physics: expected 'pymunk' in scenario {parts.scenario.name!r}, which puts more "
                f"into the space, got {physics!r}"
            )
        self.loop = TrackedWorld(
            parts.scenario, n, n_envs, filter=config.filter, params=parts.params,
            trackers=config.trackers, n_steps=round(DECISION / DT), proximity=config.proximity,
            physics=physics,
        )  # fmt: skip
        self.task = parts.make_task(n_envs)
        gain = config.operator.gain
        if isinstance(self.task, DrivingTask):
            gain, self.loop.has_samples[:] = 0.0, self.task.has_samples
        self.operator = Operator(replace(config.operator, gain=gain), n, n_envs)
        self._is_own_task = not (isinstance(config.task, str) and config.task in TASKS)
        self.weights = reward_weights(config.task, self.task, config.weights)
        self._size = total_size(parts.mode.fields)
        self.observations: F32 = np.zeros((n_envs, n, config.history * self._size), np.float32)
        """Observations, (env, car, size); zeros for absent cars."""
        self.rewards: F64 = np.zeros((n_envs, n))
        """Rewards, (env, car); 0 for absent cars."""
        self.team = TeamResults(np.zeros(n_envs), np.zeros(n_envs), np.zeros(n_envs))
        """Outcome of the last step for all cars together, (env)."""
        self.own_reward: F64 = np.zeros((n_envs, n))
        """Reward of the user's own term, (env, car)."""
        self.gate = make_gate(n_envs, n) if config.gate else None
        self.active: Bool = np.zeros((n_envs, n), dtype=bool)
        """Participating cars, (env, car): in the room, or temporarily absent."""
        self.left: Bool = np.zeros((n_envs, n), dtype=bool)
        """Cars that left for good in the last step, (env, car)."""
        self.terminated: Bool = np.zeros(n_envs, dtype=bool)
        self.truncated: Bool = np.zeros(n_envs, dtype=bool)
        self.cycles: I64 = np.zeros(n_envs, dtype=np.int64)
        self._tracking_error: F64 = np.zeros((n_envs, n))
        self._figures = make_figures(n_envs, n, len(self.task.terms))
        self._t: F64 = np.zeros(n_envs)
        self._rngs = [np.random.default_rng(k) for k in range(n_envs)]
        self._newest: F32 = self.observations
        if config.history > 1:
            self._newest = np.zeros((n_envs, n, self._size), np.float32)
        self.loop.share(self.task.target, self.task.has_target, self.operator.command)
        self._threads = threads
        self._pool: ThreadPoolExecutor | None = None
        self._share_out()

    def seed(self, env: int, rng: np.random.Generator) -> None:
        """Set the generator of an environment, which draws its episodes from the next one on."""
        self._rngs[env] = rng

    def begin(
        self,
        envs: Sequence[int],
        watch: Callable[[World], None] | None = None,
        options: ResetOptions = NO_OPTIONS,
    ) -> None:
        """Start a new episode in some environments and observe it.

        Args:
            envs: Indices of the environments, ascending.
            watch: Called with the groups after each step of the initial rest.
            options: Requests for the episodes.

        Raises:
            EnvError: A request cannot be fulfilled.
        """
        scenario = options.scenario or self.parts.scenario
        seconds = STAND_STILL + DECISION * self.parts.config.max_cycles
        rngs = [self._rngs[env].spawn(1)[0] for env in envs]
        episodes = [draw_episode(scenario, self.parts.n_cars, seconds, rng) for rng in rngs]
        episodes = [options.placed(episode, scenario.room) for episode in episodes]
        self.loop.begin(envs, episodes, [rng.spawn(1)[0] for rng in rngs], watch)
        for env, rng in zip(envs, rngs, strict=True):
            self._begin_task(env, rng, options)
        self._observe(envs)

    def _begin_task(self, env: int, rng: np.random.Generator, options: ResetOptions) -> None:
        here = slice(env, env + 1)
        if self.gate is not None:
            self.gate.reset(env)
        seed = np.array([rng.integers(1 << 62)], dtype=np.uint64)
        self.task.reset(self.state, here, self.loop.swarm.boxes)
        if options.goals is not None:
            cars = np.flatnonzero(self.state.present[env])
            self.task.set_goals(env, options.goals, cars)
        if isinstance(self.task, DrivingTask):
            self.task.plan_drive(env, rng.spawn(1)[0])
        self.operator.reset(seed, here)
        self.cycles[env] = 0
        self.active[env] = False
        self.terminated[env] = self.truncated[env] = False
        self._judge(here)
        self.own_reward[env] = 0.0
        self.left[env] = False
        self.observations[env] = 0.0

    def step(self, speed: F64, steering: F64) -> None:
        """Drive all environments for one control period; the results are in the arrays.

        Args:
            speed: Commanded speed, (env, car) [m/s]; without effect for cars outside the room.
            steering: Commanded angle, (env, car) [rad]; without effect for cars outside the room.
        """
        if self.gate is not None:
            speed, steering = self.gate.allow(self.loop.view, speed, steering)
        if isinstance(self.task, DrivingTask):
            speed, steering = speed.copy(), steering.copy()
            self.task.drive(self.state, self.t, speed, steering)
        if self._pool is None:
            self.loop.step(speed, steering)
        else:
            jobs = [
                self._pool.submit(part.step, speed[envs], steering[envs])
                for envs, part in self._lanes
            ]
            for job in jobs:
                job.result()
        everything = slice(0, self.n_envs)
        self.cycles += 1
        self._judge(everything)
        if self.parts.reward is not None:
            self.own_reward[:] = own = own_reward(self.parts.reward, self, self.state.present)
            self.rewards += own
            self.team.reward[:] += own.sum(axis=1) / np.maximum(self.active.sum(axis=1), 1)
        self._observe(everything)

    @property
    def state(self) -> WorldState:
        """Current true state."""
        return self.loop.swarm.state

    @property
    def t(self) -> F64:
        """Time since the end of the initial rest, (env) [s]; overwritten at the next step."""
        np.subtract(self.loop.swarm.t, STAND_STILL, out=self._t)
        return self._t

    def tracking_error(self) -> F64:
        """Return the distance of estimated from true relative positions, (env, car) [m].

        Mean over the usable estimates of a car; NaN if it has none.
        """
        self._compare()
        return self._tracking_error.copy()

    def team_observations(self) -> F32:
        """Return the concatenated observations of all cars, (env, car size); a copy.

        Zeros for absent cars, also for those that left in the last step.
        """
        rows = self.observations.copy()
        rows[self.left] = 0.0
        return rows.reshape(self.n_envs, -1)

    def infos(self) -> Columns:
        """Return the infos of every car, see `relpos_env.interface.infos`; shares memory."""
        self._compare()
        self._figure()
        return self._columns | ({} if self.gate is None else self.gate.infos())

    def close(self) -> None:
        """Release the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _judge(self, envs: slice) -> None:
        """Update task, operator and outcome with the current state."""
        self.task.update(self.state, self.t, self.loop.swarm.contacts, envs)
        if isinstance(self.task, InformedTask):
            self.task.inform(self.loop.view.cov, self.loop.view.ok, envs)
        self.operator.sample(self.state, self.task, envs)
        if envs.stop - envs.start == self.n_envs:
            self._judge_all()
        else:
            judge(envs.start, envs.stop, *self._verdict)
        if self._is_own_task:
            check_task_rewards(self.parts.config.task, self.task)

    def _observe(self, envs: slice | Sequence[int]) -> None:
        """Write the observations of some environments; those of the others do not change.

        A car that left for good keeps its last observation before it left.
        """
        some_left = self.left.any()
        last = self.observations[self.left] if some_left else None
        if self.parts.mode.needs_truth:
            s = self.state
            reveal(self.loop.view, s.pos_w, s.vel_w, s.heading)
        self._write()
        if self.parts.config.history > 1:
            observations, size = self.observations[envs], self._size
            observations[..., size:] = observations[..., :-size].copy()
            observations[..., :size] = self._newest[envs]
            observations[~self.loop.view.present[envs]] = 0.0
            self.observations[envs] = observations
        if some_left:
            self.observations[self.left] = last

    def _share_out(self) -> None:
        """Partition the batch for the threads and bind the kernels to their arrays."""
        edges = np.linspace(0, self.n_envs, self._threads + 1).astype(int)
        slices = [slice(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        self._lanes = [(envs, self.loop.part(envs)) for envs in slices] if len(slices) > 1 else []
        self._write = self.parts.mode.bind(self.loop.view, self._newest)
        swarm, view, config = self.loop.swarm, self.loop.view, self.parts.config
        self._verdict = (
            self.state.present, swarm.to_come, swarm.contacts, self.task.error, self.task.rewards,
            self.weights, self.task.done, self.cycles, config.max_cycles, config.end_on_collision,
            self.task.terms.index("time") if "time" in self.task.terms else -1,
            self.rewards, self.team, self.active, self.left, self.terminated, self.truncated,
        )  # fmt: skip
        self._judge_all = bind(judge, 0, self.n_envs, *self._verdict)
        self._compare = bind(tracking_errors, swarm.body, view.pos, view.ok, self._tracking_error)
        self._figure = bind(
            write_figures, self.task.error, self._tracking_error, view.ok, view.pos,
            self.state.present, swarm.contacts, self.task.rewards, self.weights, self.task.done,
            self._figures,
        )  # fmt: skip
        columns = car_columns(self._figures, self.task.terms, self.state.present, self.active)
        self._columns = columns | (
            {} if self.parts.reward is None else {"reward_own": self.own_reward}
        )
        self._pool = ThreadPoolExecutor(self._threads) if self._threads > 1 else None

    def __getstate__(self) -> dict[str, object]:
        """Return the state without threads, views and bound kernels."""
        behind = {"_lanes", "_pool", "_write", "_verdict", "_judge_all", "_compare"}
        behind |= {"_figure", "_columns"}
        return {k: v for k, v in self.__dict__.items() if k not in behind}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._share_out()
