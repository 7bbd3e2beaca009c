"""The PettingZoo environment: cars keep a formation on what their trackers tell them.

Every step a car sees where its tracker believes the others to be (or, in the mode ``truth``,
where they are), and answers with a speed and a steering angle. `docs/environment.md` has the
tables of observations, actions and rewards.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from relpos_env.errors import EnvError
from relpos_env.interface.actions import ContinuousActions, DriveCommand
from relpos_env.interface.observations import observation_mode
from relpos_env.interface.views import AgentView
from relpos_env.loop import LoopConfig, TrackedSimulation, default_params
from relpos_env.scenarios import Scenario
from relpos_env.scenarios import scenario as find_scenario
from relpos_env.tasks import make_task
from tracking.arrays import F64
from tracking.errors import ConfigError
from tracking.filters import DEFAULT_FILTER, filter_builder
from tracking.tracker import TrackerParams


class FormationEnv(ParallelEnv):  # type: ignore[misc]
    """Cars in a room keep a formation, each on its own tracker's estimates.

    Law: same arguments, seed and actions, same everything, bit for bit.
    """

    metadata = {"name": "formation_v0", "render_modes": [], "is_parallelizable": True}

    def __init__(
        self,
        *,
        scenario: str = "ring-nlos",
        task: str = "ring",
        n_cars: int = 3,
        observation: str = "estimate",
        filter: str = DEFAULT_FILTER,
        params: TrackerParams | None = None,
        max_cycles: int = 600,
        render_mode: None = None,
        record: bool = False,
    ) -> None:
        """Build the environment.

        Args:
            scenario: Room, obstacles and sensors, one of `relpos_env.scenarios.SCENARIOS`.
            task: What the formation is, one of `relpos_env.tasks.TASKS`.
            n_cars: Number of cars, at least 2.
            observation: One of `relpos_env.interface.observations.OBSERVATIONS`.
            filter: Position filter of the trackers, one of `tracking.filters.FILTERS`.
            params: What the trackers believe; by default `relpos_env.loop.default_params`.
            max_cycles: Steps of 0.1 s until truncation.
            render_mode: None; this version draws nothing.
            record: Keep measurements and truth of the episode, see `recorded_log`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        if render_mode is not None:
            raise EnvError(f"render_mode: expected None, got {render_mode!r}")
        if max_cycles < 1:
            raise EnvError(f"max_cycles: expected at least 1, got {max_cycles}")
        try:
            filter_builder(filter)
        except ConfigError as error:
            raise EnvError(str(error)) from error
        self.render_mode = render_mode
        chosen = replace(find_scenario(scenario), n_cars=n_cars)
        self._config = LoopConfig(
            scenario=chosen, filter=filter, params=params or default_params(chosen)
        )
        self._task = make_task(task, self._config.scenario)
        self._mode = observation_mode(observation, n_cars)
        self._actions = ContinuousActions()
        self._max_cycles, self._record = max_cycles, record
        self.possible_agents = [f"car_{k}" for k in range(n_cars)]
        self.agents: list[str] = []
        self.observation_spaces = {a: self._mode.space() for a in self.possible_agents}
        self.action_spaces = {a: self._actions.space() for a in self.possible_agents}
        # State: x, y, cos and sin of heading, velocity x, y of every car.
        self.state_space = spaces.Box(-np.inf, np.inf, shape=(6 * n_cars,), dtype=np.float64)
        self._rng: np.random.Generator | None = None
        self._loop: TrackedSimulation | None = None

    @property
    def fields(self) -> tuple[Any, ...]:
        """Names, sizes and units of the stretches of an observation."""
        return self._mode.fields

    @property
    def scenario(self) -> Scenario:
        """Room, obstacles, cars and sensors."""
        return self._config.scenario

    def target(self) -> F64:
        """Wanted relative positions now, (car, other, 2) [m]."""
        return self._task.target(self._t)

    @property
    def loop(self) -> TrackedSimulation:
        """The running simulation.

        Raises:
            EnvError: Before the first reset.
        """
        if self._loop is None:
            raise EnvError("the environment must be reset first")
        return self._loop

    def observation_space(self, agent: str) -> spaces.Box:
        """Observation space of one car, the same object at each call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Action space of one car, the same object at each call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; a seed makes this and all that follow it repeatable.

        Args:
            seed: None goes on with the generator of the episode before.
            options: Not used.
        """
        if seed is not None or self._rng is None:
            self._rng, _ = seeding.np_random(seed)
        episode = self._rng.spawn(1)[0]
        self._loop = TrackedSimulation(self._config, episode, record=self._record)
        self._start = self.loop.sim.t
        self._cycles = 0
        self._task.reset(self.loop.state)
        self.agents = list(self.possible_agents)
        return self._observe(), self._infos()

    def step(self, actions: dict[str, F64]) -> tuple[dict[str, Any], ...]:
        """Drive for 0.1 s.

        Args:
            actions: Speed and steering in [-1, 1] of every car; clipped beyond.

        Raises:
            EnvError: An action is missing, has a wrong shape or is not finite.
        """
        if not self.agents:
            return {}, {}, {}, {}, {}
        command = self._decode(actions)
        before = self.loop.sim.world.n_collisions.copy()
        self.loop.step(command)
        self._cycles += 1
        collided = (self.loop.sim.world.n_collisions - before).astype(np.float64)
        terms = self._task.rewards(self.loop.state, self._t, collided)
        observations, infos = self._observe(), self._infos(terms)
        over = self._cycles >= self._max_cycles
        rewards = {
            a: float(sum(term[k] for term in terms.values())) for k, a in enumerate(self.agents)
        }
        terminations = dict.fromkeys(self.agents, False)
        truncations = dict.fromkeys(self.agents, over)
        if over:
            self.agents = []
        return observations, rewards, terminations, truncations, infos

    def state(self) -> F64:
        """The truth, for critics: x, y, cos, sin of heading, velocity of every car."""
        s = self.loop.state
        columns = [s.pos_w, np.cos(s.heading)[:, None], np.sin(s.heading)[:, None], s.vel_w]
        return np.concatenate(columns, axis=1).ravel()

    def recorded_log(self, name: str) -> Any:
        """The episode so far as a log with truth; needs ``record=True``."""
        return self.loop.sim.to_log(name)

    def render(self) -> None:
        """Draw nothing: the only render mode is None."""

    def close(self) -> None:
        """Release the simulation."""
        self._loop = None
        self.agents = []

    @property
    def _t(self) -> float:
        """Time since the cars were let go [s]."""
        return self.loop.sim.t - self._start

    def _decode(self, actions: dict[str, F64]) -> DriveCommand:
        missing = [a for a in self.agents if a not in actions]
        if missing:
            raise EnvError(f"actions: none for {', '.join(missing)}")
        for agent in self.agents:
            if np.shape(actions[agent]) != (2,):
                raise EnvError(
                    f"action of {agent}: expected shape (2,), got {np.shape(actions[agent])}"
                )
        stacked = np.array([actions[a] for a in self.agents], dtype=np.float64)
        return self._actions.decode(self.loop.sim.t, stacked, tuple(self.agents))

    def _observe(self) -> dict[str, Any]:
        loop = self.loop
        view = AgentView.build(
            loop.belief(truth=self._mode.needs_truth),
            self._task.target(self._t),
            self._task.command(loop.state, self._t),
            loop.sim.odometer_speed,
            loop.state.steering,
        )
        rows = self._mode.observe(view).astype(np.float32)
        return {a: rows[k].copy() for k, a in enumerate(self.agents)}

    def _infos(self, terms: dict[str, F64] | None = None) -> dict[str, Any]:
        """Formation error, tracking error and the reward terms of every car."""
        state, loop = self.loop.state, self.loop
        error = self._task.error(state, self._t)
        estimate = loop.estimate.at(loop.sim.t).take(0)
        i, j = loop.sim.constellation.pairs.T
        difference = estimate.pos_ij_w[:, :2] - (state.pos_w[j] - state.pos_w[i])
        distance = np.where(estimate.ok, np.linalg.norm(difference, axis=1), np.nan)
        infos: dict[str, Any] = {}
        for k, agent in enumerate(self.agents):
            own = distance[(i == k) | (j == k)]
            known = own[np.isfinite(own)]
            infos[agent] = {
                "formation_error": float(error[k]),
                "tracked": len(known),
                "rewards": {name: float(term[k]) for name, term in (terms or {}).items()},
            }
            if len(known):
                infos[agent]["tracking_error"] = float(known.mean())
        return infos
