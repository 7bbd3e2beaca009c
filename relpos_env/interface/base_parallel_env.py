"""PettingZoo environment of a group of cars, in simulation or on hardware.

The environment handles agents, spaces and dicts of the PettingZoo API; a `Group` runs the steps.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from relpos_env.errors import EnvError
from relpos_env.interface.actions import ActionMode
from relpos_env.interface.infos import Columns, car_infos
from relpos_env.interface.observations import Field, space_of
from relpos_env.interface.observations.base import F32
from relpos_env.interface.seeding import episode_rng
from tracking.arrays import F64, Bool

PRESENT = Field("present", 1, "-", "1 while the car is in the room", 1.0, signed=False)
"""Last field of observations with fixed agents."""


class Group(Protocol):
    """Cars in arrays over (env, car, ...), here with one environment."""

    @property
    def observations(self) -> F32:
        """Observations, (env, car, size); zeros for absent cars."""

    @property
    def rewards(self) -> F64:
        """Rewards, (env, car); 0 for absent cars."""

    @property
    def active(self) -> Bool:
        """True for cars that are present or temporarily absent, (env, car)."""

    @property
    def left(self) -> Bool:
        """True for cars that left for good in the last step, (env, car)."""

    @property
    def terminated(self) -> Bool:
        """True where the episode has terminated, (env)."""

    @property
    def truncated(self) -> Bool:
        """True where the time limit is reached, (env)."""

    def infos(self) -> Columns:
        """Return the info values of cars, see `relpos_env.interface.infos`."""

    def seed(self, env: int, rng: np.random.Generator) -> None:
        """Set the generator of an environment's episodes, from the next episode on."""

    def step(self, speed: F64, steering: F64) -> None:
        """Drive for one control period; speed [m/s] and steering [rad], each (env, car)."""


class BaseFormationParallelEnv(ParallelEnv, ABC):  # type: ignore[misc]
    """Environment with one agent per car.

    A car that joins in mid-episode becomes an agent in that step. A car that leaves for good is
    truncated with its last observation. A temporarily absent car stays an agent with zero
    observations, no reward and ignored actions (``info["present"]`` is False). With fixed agents
    every possible agent stays for the whole episode: observations of absent cars are zero, and
    observations end with the field `PRESENT`.
    """

    metadata = {  # noqa: RUF012
        "name": "formation_v0",
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        group: Group,
        fields: tuple[Field, ...],
        actions: ActionMode,
        *,
        n_cars: int,
        history: int = 1,
        fixed_agents: bool = False,
    ) -> None:
        """Create the agents and their spaces.

        Args:
            group: Group of cars with one environment.
            fields: Fields of one observation.
            actions: Action mode.
            n_cars: Maximum number of cars.
            history: Number of stacked observations.
            fixed_agents: True to keep the same agents for the whole episode.
        """
        self._group, self._actions, self._fixed = group, actions, fixed_agents
        self.fields = (*fields, PRESENT) if fixed_agents else fields
        """Fields of an observation, with names, sizes and units."""
        self.possible_agents = [f"car_{k}" for k in range(n_cars)]
        self.agents: list[str] = []
        self._numbers = {agent: k for k, agent in enumerate(self.possible_agents)}
        space = space_of(fields, history)
        if fixed_agents:
            space = spaces.Box(
                np.append(space.low, np.float32(0.0)),
                np.append(space.high, np.float32(1.0)),
                dtype=np.float32,
            )
        self.observation_spaces = {a: copy(space) for a in self.possible_agents}
        self.action_spaces = {a: actions.space() for a in self.possible_agents}
        self._rng: np.random.Generator | None = None
        self._begun = False

    @property
    def np_random(self) -> np.random.Generator:
        """Generator of the episodes."""
        if self._rng is None:
            self._rng = episode_rng(None)
            self._group.seed(0, self._rng)
        return self._rng

    def observation_space(self, agent: str) -> spaces.Box:
        """Return the observation space of one car, the same object at each call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return the action space of one car, the same object at each call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; in simulation, a seed makes this and all later episodes repeatable.

        Args:
            seed: Seed; None continues with the generator of the previous episode.
            options: Options of the episode; see the class of the environment.

        Raises:
            EnvError: An option is unknown or invalid.
        """
        if seed is not None or self._rng is None:
            self._rng = episode_rng(seed)
            self._group.seed(0, self._rng)
        self._begun = False  # until all options are applied
        # The PettingZoo test suite passes an option named "options".
        if not isinstance(options, dict | None):
            raise EnvError(f"options: expected a dict, got {options!r}")
        self._begin({name: what for name, what in (options or {}).items() if name != "options"})
        self._begun = True
        active = self._group.active[0]
        self.agents = [a for a, n in self._numbers.items() if self._fixed or active[n]]
        observations = self._observations()
        self._show()
        return {a: observations[self._numbers[a]] for a in self.agents}, self._infos(self.agents)

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Drive for 0.1 s.

        Args:
            actions: Action of every agent.

        Raises:
            EnvError: An action is missing, has a wrong shape, is not finite or not in its space,
                or is of an unknown agent; there was no reset, or the episode is over.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        if not self.agents:
            if actions:
                raise EnvError("the episode is over, the environment must be reset")
            return {}, {}, {}, {}, {}
        group, numbers = self._group, self._numbers
        group.step(*self._decode(actions))
        terminated, truncated = bool(group.terminated[0]), bool(group.truncated[0])
        active, left = group.active[0].tolist(), group.left[0].tolist()
        if self._fixed:
            concerned, active = self.possible_agents, [True] * len(active)
            left = [False] * len(active)
        else:
            concerned = [a for a, n in numbers.items() if active[n] or left[n]]
        observations, rewards = self._observations(), group.rewards[0].tolist()
        self.agents = (
            [] if terminated or truncated else [a for a in concerned if active[numbers[a]]]
        )
        self._show()
        return (
            {a: observations[numbers[a]] for a in concerned},
            {a: rewards[numbers[a]] for a in concerned},
            dict.fromkeys(concerned, terminated),
            {a: truncated or left[numbers[a]] for a in concerned},
            self._infos(concerned),
        )

    @abstractmethod
    def _begin(self, options: Mapping[str, Any]) -> None:
        """Begin an episode of the group."""

    def _infos(self, agents: list[str]) -> dict[str, Any]:
        """Return the infos of agents."""
        cars = [self._numbers[agent] for agent in agents]
        return dict(zip(agents, car_infos(self._group.infos(), 0, cars), strict=True))

    def _show(self) -> None:
        """Hook that is called after every reset and step."""

    def _observations(self) -> F32:
        """Return a copy of the observations, (car, size)."""
        observations = self._group.observations[0]
        if not self._fixed:
            own: F32 = observations.copy()
            return own
        present = self._group.infos()["present"][0]
        rows: F32 = np.column_stack([observations * present[:, None], present.astype(np.float32)])
        return rows

    def _decode(self, actions: dict[str, Any]) -> tuple[F64, F64]:
        """Return the commands of all cars; 0 for absent cars."""
        n, mode, agents = len(self.possible_agents), self._actions, self.agents
        if len(actions) != len(agents):
            for agent in actions:
                if agent not in self._numbers:
                    known = ", ".join(self.possible_agents)
                    raise EnvError(f"actions: expected agents among {known}, got {agent!r}")
        speed, steering = np.zeros((1, n)), np.zeros((1, n))
        try:
            rows = np.array([actions[agent] for agent in agents])
            if rows.shape == (len(agents), *mode.shape):
                cars = [self._numbers[agent] for agent in agents] if len(agents) < n else slice(n)
                speed[0, cars], steering[0, cars] = mode.decode(rows, "actions")
                return speed, steering
        except KeyError as error:
            raise EnvError(f"actions: none for {error.args[0]}") from error
        except (ValueError, EnvError):
            pass
        # Some action is invalid: decode them one by one to name its agent in the error.
        for agent in self.agents:
            action = actions[agent]
            if np.shape(action) != mode.shape:
                shape = np.shape(action)
                raise EnvError(f"action of {agent}: expected shape {mode.shape}, got {shape}")
            k = self._numbers[agent]
            speed[0, k], steering[0, k] = mode.decode(action, f"action of {agent}")
        return speed, steering
