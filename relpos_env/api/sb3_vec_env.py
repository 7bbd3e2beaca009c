"""Stable-Baselines3 environment: an agent slot per car and environment, one shared policy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from relpos_env.api.sb3_attributes import SharedAttributeVecEnv
from relpos_env.api.state_space import N_TRUTH, truth_of_each
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.core.reset_options import reset_options
from relpos_env.errors import EnvError
from relpos_env.interface.infos import car_infos
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32
from relpos_env.interface.seeding import episode_rng, seeds_of_batch
from relpos_env.render.film import Film, check_render_mode
from relpos_env.tasks import reward_weights
from relpos_env.tasks.options import flag
from tracking.arrays import F64, Bool


class FormationVecEnv(SharedAttributeVecEnv):
    """``n_envs`` environments; agent slot ``e * n_cars + k`` is car k of environment e.

    Seeds increase by 1 from environment to environment. A slot is done when the episode of its
    environment is over, or when its car leaves for good; its info then has the values of
    `relpos_env.interface.infos`, the last observation of the car as ``terminal_observation``, and
    ``TimeLimit.truncated``. A slot without a car has zeros as observations and rewards, and its
    info has ``active`` False at every step: plain algorithms of Stable-Baselines3 learn from these
    rows, too, unless they use `agents.training.ppo.buffer.SwarmRolloutBuffer`, which leaves them
    out.
    """

    def __init__(
        self,
        n_envs: int = 1,
        *,
        threads: int = 1,
        render_mode: str | None = None,
        with_truth: bool = False,
        **arguments: Any,
    ) -> None:
        """Build the environments.

        Args:
            n_envs: Number of environments.
            threads: Number of parts of the batch that are stepped at a time.
            render_mode: None, ``human`` or ``rgb_array``: images of the first environment.
            with_truth: True to append `relpos_env.api.state_space.truth_of_each` to every
                observation, for critics.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._parts = configure(arguments)
        self.formation = EnvCore(self._parts, n_envs, threads)
        self.n_cars = self._parts.n_cars
        self._film = Film(render_mode, 10)
        self._commands: tuple[F64, F64] | None = None
        self._next_seeds: list[int | None] = [None] * n_envs
        self._begun = False
        self.with_truth = flag("with_truth", with_truth)
        space = space_of(self._parts.mode.fields, self._parts.config.history)
        if with_truth:
            more = np.full(N_TRUTH * self.n_cars, np.inf, np.float32)
            space = Box(np.append(space.low, -more), np.append(space.high, more))
        super().__init__(n_envs * self.n_cars, space, self._parts.actions.space())

    @property
    def max_episode_steps(self) -> int:
        """Steps until truncation."""
        return self._parts.config.max_cycles

    @property
    def active(self) -> Bool:
        """Mask of the agent slots whose car participates, (slot)."""
        return self.formation.active.ravel()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed all environments from the next reset on; None keeps their generators."""
        if seed is not None:
            self._next_seeds = seeds_of_batch(seed, self.formation.n_envs)
        return [s for s in self._next_seeds for _ in range(self.n_cars)]

    def stagger(self, rng: np.random.Generator) -> None:
        """Randomise the elapsed steps of all episodes, so that they end at independent times.

        Args:
            rng: Generator of the elapsed steps, less than `max_cycles`.
        """
        cycles = self.formation.cycles
        cycles[:] = rng.integers(0, self._parts.config.max_cycles, len(cycles))

    def reweigh(self, weights: Mapping[str, float]) -> None:
        """Set the weights of reward terms from the next step on.

        Args:
            weights: Weights by term; other terms get the default weights of the task.

        Raises:
            EnvError: A term is unknown or a weight is not finite.
        """
        task = self._parts.config.task
        self.formation.weights[:] = reward_weights(task, self.formation.task, weights)

    def reset(self) -> F32:
        """Start an episode in every environment and return the observations, (slot, size).

        The options of `set_options` are those of the first agent slot of each room; see
        `relpos_env.core.reset_options`.

        Raises:
            EnvError: An option is unknown or cannot be fulfilled.
        """
        rooms = range(self.formation.n_envs)
        for env, seed in enumerate(self._next_seeds):
            if seed is not None or not self._begun:
                self.formation.seed(env, episode_rng(seed))
        self._begun = False  # until all requests are fulfilled
        requested = [reset_options(self._options[k * self.n_cars], self._parts) for k in rooms]
        if not any(self._options):
            self.formation.begin(rooms)
        else:
            for env, request in zip(rooms, requested, strict=True):
                self.formation.begin([env], options=request)
        self._reset_options()
        self._next_seeds = [None] * self.formation.n_envs
        self._begun = True
        self.reset_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self._film.forget()
        self._show()
        return self._observations()

    def step_async(self, actions: Any) -> None:
        """Store the actions of all agent slots, (slot, ...).

        Raises:
            EnvError: The actions have a wrong shape, are not finite or not in the space; or
                there was no reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        shape = (self.num_envs, *self._parts.actions.shape)
        if np.shape(actions) != shape:
            raise EnvError(f"actions: expected shape {shape}, got {np.shape(actions)}")
        rows = np.reshape(actions, (-1, self.n_cars, *self._parts.actions.shape))
        self._commands = self._parts.actions.decode(rows, "actions")

    def step_wait(self) -> tuple[F32, F32, Bool, list[dict[str, Any]]]:
        """Drive for 0.1 s and return observations, rewards, dones and infos of all agent slots."""
        assert self._commands is not None
        f = self.formation
        f.step(*self._commands)
        rewards = f.rewards.ravel().astype(np.float32)
        over = f.terminated | f.truncated
        dones = (over[:, None] | f.left).ravel()
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if not f.active.all():
            for slot in np.nonzero(~f.active.ravel())[0]:
                infos[slot] = {"active": False}
        if dones.any():
            last, columns = self._rows(f.observations), f.infos()
            for done in np.nonzero(dones)[0].tolist():
                of, car = divmod(done, self.n_cars)
                infos[done] = car_infos(columns, of, [car])[0] | {
                    "terminal_observation": last[done],
                    "TimeLimit.truncated": not f.terminated[of],
                }
            if over.any():
                f.begin(np.flatnonzero(over).tolist())
                if over[0]:
                    self._film.forget()
        self._show()
        return self._observations(), rewards, dones, infos

    def close(self) -> None:
        """Release threads and window."""
        self.formation.close()
        self._film.close()

    def get_images(self) -> list[Any]:
        """Return an image of the first environment."""
        return [self._film.picture(self.formation)]

    def render(self, mode: str | None = None) -> Any:
        """Return an image of the first environment; None without a mode or with a window."""
        return self._film.picture(self.formation)

    def _observations(self) -> F32:
        """Return the current observations of all agent slots; zeros for cars that have left."""
        return self._rows(self.formation.team_observations())

    def _rows(self, observations: F32) -> F32:
        """Return observations of all agent slots, with the truth if `with_truth`; a copy."""
        observations = observations.reshape(self.num_envs, -1)
        if self.with_truth:
            truth = (
                truth_of_each(self.formation.state).reshape(self.num_envs, -1).astype(np.float32)
            )
            return np.concatenate([observations, truth], axis=1)
        return observations.copy()

    def _show(self) -> None:
        if self.render_mode is not None:
            self._film.add(self.formation)

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 10}
