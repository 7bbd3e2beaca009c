"""The native vector form of the Gymnasium environment: all environments in compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from relpos_env.config import configure, whole_number
from relpos_env.errors import EnvError
from relpos_env.formation import MOST_ENVS, Formation
from relpos_env.gym_env import (
    decode_team,
    team_action_space,
    team_observation_space,
)
from relpos_env.interface.observations.base import F32
from relpos_env.render.film import Film, check_render_mode
from tracking.arrays import F64, Bool


class FormationVectorEnv(VectorEnv[F32, Any, Any]):
    """``gymnasium.make_vec("relpos_env/Formation-v0", num_envs=64)``.

    An environment whose episode is over begins the next one in the same step; its last
    observation is in ``infos["final_obs"]``. Infos are arrays over environments.

    Law: environment k with seed s is the single environment with seed s + k, bit for bit.
    """

    metadata = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 10,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        threads: int = 1,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        """Build the environments.

        Args:
            num_envs: How many.
            threads: The batch is stepped in so many parts at a time.
            render_mode: None or ``rgb_array``; `render` gives a picture of each environment.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        if render_mode == "human":
            raise EnvError("render_mode: expected None or rgb_array, got 'human'")
        self.num_envs, self.render_mode = num_envs, render_mode
        num_envs = whole_number("num_envs", num_envs, 1, MOST_ENVS)
        self._parts = configure(arguments)
        self.formation = Formation(self._parts, num_envs, threads)
        self.single_observation_space = team_observation_space(self._parts)
        self.single_action_space = team_action_space(self._parts)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._films = [Film(render_mode, 10, env=k) for k in range(num_envs)]
        self._begun = False

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[F32, dict[str, Any]]:
        """Begin an episode in every environment.

        Args:
            seed: Of the first environment, the others count on; or one for each.
            options: ``reset_mask``, (env): only these begin anew.

        Raises:
            EnvError: Not as many seeds or flags as environments; or some begin, others never did.
        """
        seeds: list[int | None]
        if seed is None or isinstance(seed, int | np.integer):
            seeds = [None if seed is None else int(seed) + k for k in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise EnvError(f"seed: expected {self.num_envs} seeds, got {len(seeds)}")
        mask = np.ones(self.num_envs, dtype=bool)
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"], dtype=bool)
            if mask.shape != (self.num_envs,) or not mask.any():
                raise EnvError(f"reset_mask: expected {self.num_envs} flags, some True, got {mask}")
        if not (self._begun or mask.all()):
            raise EnvError("reset_mask: expected True everywhere at the first reset")
        for env in np.nonzero(mask)[0]:
            chosen = seeds[env]
            if chosen is not None or not self._begun:
                # The seed of the single environment, drawn as it draws it.
                own, _ = seeding.np_random(chosen)
                rng, _ = seeding.np_random(int(own.integers(1 << 62)))
                self.formation.seed(int(env), rng)
            self._begin(int(env))
        self._begun = True
        return self._observations(), self._infos()

    def step(self, actions: Any) -> tuple[F32, F64, Bool, Bool, dict[str, Any]]:
        """Drive all environments for 0.1 s.

        Raises:
            EnvError: The actions have a wrong shape, are not finite or not in the space; or
                there was no reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        formation, parts = self.formation, self._parts
        batch = (self.num_envs,)
        formation.step(*decode_team(actions, parts.actions, batch, parts.n_cars, "actions"))
        rewards = formation.team.reward.copy()
        terminated, truncated = formation.terminated.copy(), formation.truncated.copy()
        infos = self._infos()
        over = terminated | truncated
        if over.any():
            last = self._observations()
            infos["final_obs"] = np.empty(self.num_envs, dtype=object)
            for env in np.nonzero(over)[0]:
                infos["final_obs"][env] = last[env]
            infos["_final_obs"] = over
            infos["final_info"] = {k: v for k, v in infos.items() if "final" not in k}
            infos["_final_info"] = over
            for env in np.nonzero(over)[0]:
                self._begin(int(env))
            # Those of the episodes that go on, or have just begun.
            infos.update(self._infos())
        if self.render_mode is not None:
            for film in self._films:
                film.add(formation)
        return self._observations(), rewards, terminated, truncated, infos

    def state(self) -> F64:
        """The truth, for critics, (env, 8 car); as in `FormationEnv.state`."""
        return self.formation.truth()

    def render(self) -> tuple[Any, ...] | None:
        """A picture of every environment, or None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(film.picture(self.formation) for film in self._films)

    def close_extras(self, **kwargs: Any) -> None:
        """Release threads and pictures."""
        self.formation.close()
        for film in self._films:
            film.close()

    def _begin(self, env: int) -> None:
        self.formation.begin(env)
        if self.render_mode is not None:
            self._films[env].forget()
            self._films[env].add(self.formation)

    def _observations(self) -> F32:
        observations: F32 = self.formation.observations.reshape(self.num_envs, -1).copy()
        return observations

    def _infos(self) -> dict[str, Any]:
        """Formation error and contacts of every environment, without a dict for any."""
        f = self.formation
        everyone = np.ones(self.num_envs, dtype=bool)
        return {
            "formation_error": f.team.error.copy(),
            "_formation_error": everyone,
            "collisions": f.team.contacts.copy(),
            "_collisions": everyone,
            "active": f.active.copy(),
            "_active": everyone,
        }
