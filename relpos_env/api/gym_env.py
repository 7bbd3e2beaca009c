"""Gymnasium environment: one controller for all cars.

The observations and actions of the cars are concatenated; the reward is the mean over the
participating cars.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from relpos_env.api.state_space import state_space, truth_inside
from relpos_env.config import Parts, configure
from relpos_env.core.env_core import EnvCore
from relpos_env.core.reset_options import reset_options
from relpos_env.errors import EnvError
from relpos_env.interface.actions import ActionMode
from relpos_env.interface.infos import team_columns, team_info
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32
from relpos_env.interface.seeding import episode_rng
from relpos_env.render.film import Film, check_render_mode
from relpos_env.world.pymunk_space import PhysicsSpace
from tracking.arrays import F64


def team_observation_space(parts: Parts) -> spaces.Box:
    """Return the space of the concatenated observations of all cars, (car size)."""
    one = space_of(parts.mode.fields, parts.config.history)
    n = parts.n_cars
    return spaces.Box(np.tile(one.low, n), np.tile(one.high, n), dtype=np.float32)


def team_action_space(parts: Parts) -> spaces.Space[Any]:
    """Return the space of the concatenated actions of all cars, (car action)."""
    one, n = parts.actions.space(), parts.n_cars
    if isinstance(one, spaces.Discrete):
        return spaces.MultiDiscrete(np.full(n, one.n))
    assert isinstance(one, spaces.Box)
    return spaces.Box(np.tile(one.low, n), np.tile(one.high, n), dtype=np.float32)


def decode_team(
    actions: Any, mode: ActionMode, batch: tuple[int, ...], n_cars: int, where: str
) -> tuple[F64, F64]:
    """Return the commands of all cars, each (*batch, car), from actions (*batch, car action).

    Raises:
        EnvError: The shape is wrong, or as `ActionMode.decode`.
    """
    shape = (*batch, n_cars * int(np.prod(mode.shape, dtype=int)))
    if np.shape(actions) != shape:
        raise EnvError(f"{where}: expected shape {shape}, got {np.shape(actions)}")
    return mode.decode(np.reshape(actions, (*batch, n_cars, *mode.shape)), where)


class FormationGymEnv(gymnasium.Env[F32, Any]):
    """``gymnasium.make("relpos_env/Formation-v0")``. It has the property of `FormationEnv`."""

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(self, *, render_mode: str | None = None, **arguments: Any) -> None:
        """Build the environment.

        Args:
            render_mode: None, ``human`` or ``rgb_array``.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._spec: EnvSpec | None = None
        self._parts = configure(arguments)
        self._formation = EnvCore(self._parts, physics="pymunk")
        self.observation_space: Any = team_observation_space(self._parts)
        self.action_space = team_action_space(self._parts)
        self._film = Film(render_mode, 10)
        self._begun = self._seeded = self._over = False

    @property
    def formation(self) -> EnvCore:
        """The running environment, a batch of one.

        Raises:
            EnvError: Before the first reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        return self._formation

    @property
    def world(self) -> PhysicsSpace:
        """The pymunk space of the episode, to read and to change; see `world.pymunk_space`.

        Raises:
            EnvError: Before the first reset, or with ``physics="fast"``.
        """
        return self.formation.loop.swarm.world(0)

    @property
    def spec(self) -> EnvSpec | None:
        """Specification of the environment; `max_episode_steps` is that of its configuration."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        steps = self.max_episode_steps
        self._spec = None if spec is None else replace(spec, max_episode_steps=steps)

    @property
    def max_episode_steps(self) -> int:
        """Steps until truncation."""
        return self._parts.config.max_cycles

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[F32, dict[str, Any]]:
        """Start an episode; a seed makes this and all following episodes repeatable.

        Args:
            seed: Seed of the episode; None continues with the current generator.
            options: ``poses``, ``goals``, ``scenario``, see
                `relpos_env.core.reset_options.ResetOptions`.

        Raises:
            EnvError: An option is unknown or cannot be fulfilled.
        """
        super().reset(seed=seed)
        requested = reset_options(options, self._parts)
        if seed is not None or not self._seeded:
            # Episodes have a generator of their own, so that `np_random` is the user's.
            self._formation.seed(0, episode_rng(seed))
            self._seeded = True
        self._begun = False  # until all requests are fulfilled
        self._formation.begin([0], options=requested)
        self._begun, self._over = True, False
        self._film.forget()
        self._show()
        return self._formation.team_observations()[0], self._info()

    def step(self, action: Any) -> tuple[F32, float, bool, bool, dict[str, Any]]:
        """Drive for 0.1 s.

        Raises:
            EnvError: The action has a wrong shape, is not finite, or not in the space; or there
                was no reset, or the episode is over.
        """
        formation, parts = self.formation, self._parts
        if self._over:
            raise EnvError("the episode is over, the environment must be reset")
        speed, steering = decode_team(action, parts.actions, (), parts.n_cars, "action")
        formation.step(speed[None], steering[None])
        self._over = bool(formation.terminated[0] or formation.truncated[0])
        self._show()
        return (
            formation.team_observations()[0],
            float(formation.team.reward[0]),
            bool(formation.terminated[0]),
            bool(formation.truncated[0]),
            self._info(),
        )

    def state(self) -> F32:
        """Return the true state for critics, as in `FormationEnv.state`."""
        state: F32 = truth_inside(self.formation.state, state_space(self._parts))[0]
        return state

    def render(self) -> Any:
        """Return an image, uint8 (height, width, 3); None without a mode or with a window."""
        return self._film.picture(self.formation)

    def close(self) -> None:
        """Release the window; the environment can be reset again."""
        self._film.close()
        self._begun = False

    def _info(self) -> dict[str, Any]:
        return team_info(team_columns(self._formation.infos()), 0)

    def _show(self) -> None:
        if self.render_mode is not None:
            self._film.add(self._formation)
