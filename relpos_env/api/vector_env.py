"""Native vector form of the Gymnasium environment: all environments in compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from relpos_env.api.gym_env import (
    decode_team,
    team_action_space,
    team_observation_space,
)
from relpos_env.api.state_space import state_space, truth_inside
from relpos_env.config import configure, whole_number
from relpos_env.core.env_core import MOST_ENVS, NO_OPTIONS, EnvCore
from relpos_env.core.reset_options import ResetOptions, checked_options, reset_options
from relpos_env.errors import EnvError
from relpos_env.interface.infos import team_columns, vector_infos
from relpos_env.interface.observations.base import F32
from relpos_env.interface.seeding import episode_rng, seeds_of_batch
from relpos_env.render.film import Film, check_render_mode
from tracking.arrays import F64, Bool


class FormationVectorEnv(VectorEnv[F32, Any, Any]):
    """``gymnasium.make_vec("relpos_env/Formation-v0", num_envs=64)``.

    It follows the contract of `gymnasium.vector.VectorEnv`: with the same autoreset mode it returns
    the results of `SyncVectorEnv` with single environments, infos included.

    Property: environment k with seed s equals the single environment with seed s + k and the same
    `physics`, bit for bit.
    """

    metadata = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 10,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        **arguments: Any,
    ) -> None:
        """Build the environments.

        Args:
            num_envs: Number of environments.
            autoreset_mode: ``NextStep``: an environment whose episode is over starts the next one
                in the next step; ``SameStep``: in the same step, the last observation is in
                ``infos["final_obs"]``; ``Disabled``: by ``reset(options={"reset_mask": ...})``.
            threads: Number of parts of the batch that are stepped at a time.
            render_mode: None or ``rgb_array``; `render` returns an image of each environment.
            max_episode_steps: Another name of ``max_cycles``; the smaller one applies.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        if render_mode == "human":
            raise EnvError("render_mode: expected None or rgb_array, got 'human'")
        self.num_envs, self.render_mode = num_envs, render_mode
        num_envs = whole_number("num_envs", num_envs, 1, MOST_ENVS)
        try:
            self.autoreset_mode = AutoresetMode(autoreset_mode)
        except ValueError as error:
            names = ", ".join(mode.value for mode in AutoresetMode)
            raise EnvError(
                f"autoreset_mode: expected one of {names}, got {autoreset_mode!r}"
            ) from error
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        if max_episode_steps is not None:
            steps = whole_number("max_episode_steps", max_episode_steps, 1, 800_000)
            arguments["max_cycles"] = min(steps, arguments.get("max_cycles", steps))
        self._parts = configure(arguments)
        self.formation = EnvCore(self._parts, num_envs, threads)
        self.single_observation_space = team_observation_space(self._parts)
        self.single_action_space = team_action_space(self._parts)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._state_space = state_space(self._parts)
        self._films = [Film(render_mode, 10, env=k) for k in range(num_envs)]
        self._seeded, self._begun = (np.zeros(num_envs, dtype=bool) for _ in range(2))
        self._over = np.zeros(num_envs, dtype=bool)

    @property
    def max_episode_steps(self) -> int:
        """Steps until truncation."""
        return self._parts.config.max_cycles

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[F32, dict[str, Any]]:
        """Start an episode in every environment.

        Args:
            seed: Seed of the first environment, to which others add their index; or one for each.
            options: ``reset_mask``, (env): mask of environments to reset; and the options of a
                single environment, the same for all.

        Raises:
            EnvError: Seeds or flags do not match the environments; the first reset leaves some out;
                or an option is unknown or cannot be fulfilled.
        """
        seeds = seeds_of_batch(seed, self.num_envs)
        options = dict(checked_options(options))
        mask = np.asarray(options.pop("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise EnvError(f"reset_mask: expected {self.num_envs} flags, some True, got {mask}")
        if not (self._begun | mask).all():
            raise EnvError("reset_mask: expected True everywhere at the first reset")
        requested = reset_options(options, self._parts)
        if seeds[0] is not None:
            self._np_random, self._np_random_seed = episode_rng(seeds[0]), seeds[0]
        for env in np.flatnonzero(mask).tolist():
            if seeds[env] is not None or not self._seeded[env]:
                self.formation.seed(env, episode_rng(seeds[env]))
                self._seeded[env] = True
        self._begin(mask, requested)
        return self._observations(), self._infos(None if mask.all() else mask)

    def step(self, actions: Any) -> tuple[F32, F64, Bool, Bool, dict[str, Any]]:
        """Drive all environments for 0.1 s.

        Raises:
            EnvError: The actions have a wrong shape, are not finite or not in the space; there
                was no reset; or an environment whose episode is over was not reset.
        """
        if not self._begun.all():
            raise EnvError("the environment must be reset first")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._over.any():
            over = int(self._over.argmax())
            raise EnvError(f"the episode of environment {over} is over, it must be reset")
        formation, parts = self.formation, self._parts
        commands = decode_team(actions, parts.actions, (self.num_envs,), parts.n_cars, "actions")
        resets = self._over.copy()
        if not resets.all():
            formation.step(*commands)
        rewards = formation.team.reward.copy()
        self._over = formation.terminated | formation.truncated
        if resets.any():
            self._begin(resets)
            rewards[resets] = 0.0
        terminated, truncated = formation.terminated.copy(), formation.truncated.copy()
        infos = self._infos()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            resets = self._over.copy()
            infos = self._begin_at_once(self._over.copy())
        if self.render_mode is not None:
            for film, was_begun in zip(self._films, resets, strict=True):
                if not was_begun:
                    film.add(formation)
        return self._observations(), rewards, terminated, truncated, infos

    def state(self) -> F32:
        """Return the true state for critics, (env, 8 car), as in `FormationEnv.state`."""
        return truth_inside(self.formation.state, self._state_space)

    def render(self) -> tuple[Any, ...] | None:
        """Return an image of every environment, or None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(film.picture(self.formation) for film in self._films)

    def close_extras(self, **kwargs: Any) -> None:
        """Release threads and images."""
        self.formation.close()
        for film in self._films:
            film.close()

    def _begin(self, envs: Bool, requested: ResetOptions = NO_OPTIONS) -> None:
        """Start an episode in some environments, (env)."""
        which = np.flatnonzero(envs).tolist()
        self._begun[envs] = False  # until all requests are fulfilled
        self.formation.begin(which, options=requested)
        self._begun[envs], self._over[envs] = True, False
        if self.render_mode is not None:
            for env in which:
                self._films[env].forget()
                self._films[env].add(self.formation)

    def _begin_at_once(self, over: Bool) -> dict[str, Any]:
        """Start the next episodes; return infos with the final observations and infos."""
        last, final = self._observations(), self._infos(over)
        final_obs = np.full(self.num_envs, None, dtype=object)
        for env in np.flatnonzero(over):
            final_obs[env] = last[env]
        self._begin(over)
        ends = {"final_obs": final_obs, "_final_obs": over, "final_info": final}
        return {**ends, "_final_info": over.copy(), **self._infos()}

    def _observations(self) -> F32:
        return self.formation.team_observations()

    def _infos(self, envs: Bool | None = None) -> dict[str, Any]:
        """Return the infos of some environments in vector form."""
        return vector_infos(team_columns(self.formation.infos()), envs)
