"""The PettingZoo environment: cars keep a formation on what their trackers tell them.

Every step a car sees where its tracker believes the others to be (or, in the mode ``truth``,
where they are), and answers with a speed and a steering angle. `docs/environment.md` has the
tables of observations, actions and rewards.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from relpos_env.config import configure
from relpos_env.errors import EnvError
from relpos_env.formation import Formation
from relpos_env.interface.observations import Field, space_of
from relpos_env.loop import TrackedSwarm
from relpos_env.recording import Recording
from relpos_env.render.film import Film, check_render_mode
from relpos_env.scenarios import Scenario
from tracking.arrays import F64
from tracking.log import Log

TRUTH_FIELDS = 8
"""Numbers of a car in `state()`."""


class FormationEnv(ParallelEnv):  # type: ignore[misc]
    """Cars in a room keep a formation, each on its own tracker's estimates.

    An agent is a car. One that joins in mid-episode becomes an agent in that step; one that
    leaves for good is truncated; one that is away and will return stays an agent, sees zeros,
    gets no reward, and what it does has no effect (``info["present"]`` is False).

    Law: same arguments, seed and actions, same everything, bit for bit.
    """

    metadata = {  # noqa: RUF012
        "name": "formation_v0",
        "render_modes": ["human", "rgb_array"],
        "render_fps": 10,
        "is_parallelizable": True,
    }

    def __init__(
        self, *, render_mode: str | None = None, record: bool = False, **arguments: Any
    ) -> None:
        """Build the environment.

        Args:
            render_mode: None, ``human`` or ``rgb_array``.
            record: Keep measurements and truth of the episode, see `recorded_log`.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._parts = parts = configure(arguments)
        self._record = record
        self._formation = Formation(parts)
        self.possible_agents = [f"car_{k}" for k in range(parts.n_cars)]
        self.agents: list[str] = []
        self._numbers = {agent: k for k, agent in enumerate(self.possible_agents)}
        history = parts.config.history
        self.observation_spaces = {
            a: space_of(parts.mode.fields, history) for a in self.possible_agents
        }
        self.action_spaces = {a: parts.actions.space() for a in self.possible_agents}
        self.state_space = spaces.Box(
            -np.inf, np.inf, shape=(TRUTH_FIELDS * parts.n_cars,), dtype=np.float64
        )
        self._rng: np.random.Generator | None = None
        self._begun = False
        self._film = Film(render_mode, 10.0)
        self._recording: Recording | None = None

    @property
    def fields(self) -> tuple[Field, ...]:
        """Names, sizes and units of the stretches of an observation."""
        return self._parts.mode.fields

    @property
    def scenario(self) -> Scenario:
        """Room, obstacles, cars and sensors."""
        return self._parts.scenario

    @property
    def formation(self) -> Formation:
        """The running environment: truth, task, views of the cars; a batch of one.

        Raises:
            EnvError: Before the first reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        return self._formation

    @property
    def loop(self) -> TrackedSwarm:
        """The running simulation with its trackers; a batch of one."""
        return self.formation.loop

    def observation_space(self, agent: str) -> spaces.Box:
        """Observation space of one car, the same object at each call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
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
            self._formation.seed(0, self._rng)
        self._recording = recording = Recording() if self._record else None
        self._formation.begin(0, None if recording is None else recording.add_swarm)
        self._begun = True
        self._film.forget()
        self.agents = [a for a, n in self._numbers.items() if self._formation.active[0, n]]
        observations = self._formation.observations[0].copy()
        self._show()
        return (
            {a: observations[self._numbers[a]] for a in self.agents},
            self._infos(self.agents),
        )

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Drive for 0.1 s.

        Args:
            actions: Of every agent.

        Raises:
            EnvError: An action is missing, has a wrong shape, is not finite or not in its space;
                or there was no reset.
        """
        formation = self.formation
        if not self.agents:
            return {}, {}, {}, {}, {}
        speed, steering = self._decode(actions)
        formation.step(speed, steering)
        if self._recording is not None:
            self._recording.add_swarm(formation.loop.swarm)
        active, left = formation.active[0].tolist(), formation.left[0].tolist()
        concerned = [a for a, n in self._numbers.items() if active[n] or left[n]]
        observations = formation.observations[0].copy()
        rewards = formation.rewards[0].tolist()
        terminated, truncated = bool(formation.terminated[0]), bool(formation.truncated[0])
        numbers = self._numbers
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

    def state(self) -> F64:
        """The truth, for critics, (8 car); zeros for absent cars.

        Of each car: 1, x, y, cosine and sine of the heading, velocity x, y, yaw rate.
        """
        truth: F64 = self.formation.truth()[0]
        return truth

    def recorded_log(self, name: str) -> Log:
        """The episode so far as a log with truth.

        Raises:
            EnvError: The environment was not made with ``record=True``, or not reset.
        """
        if self._recording is None:
            raise EnvError("record: expected True when the environment was made, and a reset")
        constellation = self.loop.swarm.constellation
        return self._recording.to_log(name, self.scenario.name, constellation, truth_every=2)

    def render(self) -> Any:
        """A picture of now, uint8 (height, width, 3).

        None without a render mode, or with a window, which shows itself at every step.

        Raises:
            EnvError: Before the first reset.
        """
        return self._film.picture(self.formation)

    def close(self) -> None:
        """Release the window; the environment can be reset again."""
        self._film.close()
        self.agents = []
        self._begun = False

    def _decode(self, actions: dict[str, Any]) -> tuple[F64, F64]:
        """Commands of all cars; those of nobody are zero."""
        n, mode = self._parts.n_cars, self._parts.actions
        speed, steering = np.zeros((1, n)), np.zeros((1, n))
        for agent in self.agents:
            if agent not in actions:
                raise EnvError(f"actions: none for {agent}")
        try:
            rows = np.array([actions[agent] for agent in self.agents])
            if rows.shape == (len(self.agents), *mode.shape):
                cars = [self._numbers[agent] for agent in self.agents]
                speed[0, cars], steering[0, cars] = mode.decode(rows, "actions")
                return speed, steering
        except (ValueError, EnvError):
            pass
        # Something is wrong with one of them: say with which.
        for agent in self.agents:
            action = actions[agent]
            if np.shape(action) != mode.shape:
                shape = np.shape(action)
                raise EnvError(f"action of {agent}: expected shape {mode.shape}, got {shape}")
            k = self._numbers[agent]
            speed[0, k], steering[0, k] = mode.decode(action, f"action of {agent}")
        return speed, steering

    def _infos(self, agents: list[str]) -> dict[str, Any]:
        """Errors, reward terms and whereabouts of cars."""
        formation = self._formation
        terms = formation.task.terms
        values = formation.task.rewards[0].tolist()
        errors = formation.task.error[0].tolist()
        tracking = formation.tracking_error()[0].tolist()
        tracked = formation.loop.view.ok[0].sum(axis=-1).tolist()
        contacts = formation.loop.swarm.contacts[0].tolist()
        present = formation.state.present[0].tolist()
        infos: dict[str, Any] = {}
        for agent in agents:
            k = self._numbers[agent]
            infos[agent] = info = {
                "formation_error": errors[k],
                "tracked": tracked[k],
                "collisions": int(contacts[k]),
                "present": present[k],
                "rewards": dict(zip(terms, values[k], strict=True)),
            }
            if tracked[k]:
                info["tracking_error"] = tracking[k]
        return infos

    def _show(self) -> None:
        if self.render_mode is not None:
            self._film.add(self._formation)
