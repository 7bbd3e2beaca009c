"""The Gymnasium environment: one controller for all cars.

The observations and actions of the cars stand one after the other; the reward is the mean over
the cars that take part.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding

from relpos_env.config import Parts, configure
from relpos_env.errors import EnvError
from relpos_env.formation import Formation
from relpos_env.interface.actions import ActionMode
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32
from relpos_env.render.film import Film, check_render_mode
from relpos_env.world import World
from tracking.arrays import F64


def team_observation_space(parts: Parts) -> spaces.Box:
    """Observations of all cars, one after the other, (car size)."""
    one = space_of(parts.mode.fields, parts.config.history)
    n = parts.n_cars
    return spaces.Box(np.tile(one.low, n), np.tile(one.high, n), dtype=np.float32)


def team_action_space(parts: Parts) -> spaces.Space[Any]:
    """Actions of all cars, one after the other, (car action)."""
    one, n = parts.actions.space(), parts.n_cars
    if isinstance(one, spaces.Discrete):
        return spaces.MultiDiscrete(np.full(n, one.n))
    assert isinstance(one, spaces.Box)
    return spaces.Box(np.tile(one.low, n), np.tile(one.high, n), dtype=np.float32)


def decode_team(
    actions: Any, mode: ActionMode, batch: tuple[int, ...], n_cars: int, where: str
) -> tuple[F64, F64]:
    """Commands of all cars, each (*batch, car), from actions (*batch, car action).

    Raises:
        EnvError: A wrong shape, or as `ActionMode.decode`.
    """
    shape = (*batch, n_cars * int(np.prod(mode.shape, dtype=int)))
    if np.shape(actions) != shape:
        raise EnvError(f"{where}: expected shape {shape}, got {np.shape(actions)}")
    return mode.decode(np.reshape(actions, (*batch, n_cars, *mode.shape)), where)


class FormationGymEnv(gymnasium.Env[F32, Any]):
    """``gymnasium.make("relpos_env/Formation-v0")``. Law as for `FormationEnv`."""

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
        self._parts = configure(arguments)
        self._formation = Formation(self._parts, physics="pymunk")
        self.observation_space: Any = team_observation_space(self._parts)
        self.action_space = team_action_space(self._parts)
        self._film = Film(render_mode, 10)
        self._begun = False

    @property
    def formation(self) -> Formation:
        """The running environment, a batch of one.

        Raises:
            EnvError: Before the first reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        return self._formation

    @property
    def world(self) -> World:
        """The pymunk space of the episode, to look into and to change; see `relpos_env.world`.

        Raises:
            EnvError: Before the first reset, or with ``physics="fast"``.
        """
        return self.formation.loop.swarm.world(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[F32, dict[str, Any]]:
        """Begin an episode; a seed makes this and all that follow it repeatable."""
        super().reset(seed=seed)
        if seed is not None or not self._begun:
            # Episodes have a generator of their own, so that `np_random` is the user's.
            self._formation.seed(0, seeding.np_random(int(self.np_random.integers(1 << 62)))[0])
        self._formation.begin(0)
        self._begun = True
        self._film.forget()
        self._show()
        return self._formation.observations[0].ravel().copy(), self._info()

    def step(self, action: Any) -> tuple[F32, float, bool, bool, dict[str, Any]]:
        """Drive for 0.1 s.

        Raises:
            EnvError: The action has a wrong shape, is not finite, or not in the space; or there
                was no reset.
        """
        formation = self.formation
        parts = self._parts
        speed, steering = decode_team(action, parts.actions, (), parts.n_cars, "action")
        formation.step(speed[None], steering[None])
        self._show()
        return (
            formation.observations[0].ravel().copy(),
            float(formation.team.reward[0]),
            bool(formation.terminated[0]),
            bool(formation.truncated[0]),
            self._info(),
        )

    def state(self) -> F64:
        """The truth, for critics; as in `FormationEnv.state`."""
        truth: F64 = self.formation.truth()[0]
        return truth

    def render(self) -> Any:
        """A picture of now, uint8 (height, width, 3); None without a mode or with a window."""
        return self._film.picture(self.formation)

    def close(self) -> None:
        """Release the window; the environment can be reset again."""
        self._film.close()
        self._begun = False

    def _info(self) -> dict[str, Any]:
        formation = self._formation
        active = formation.active[0]
        rewards = formation.task.rewards[0]
        n = max(int(active.sum()), 1)
        terms = (rewards * active[:, None]).sum(axis=0) / n
        tracking = formation.tracking_error()[0]
        known = np.isfinite(tracking)
        info: dict[str, Any] = {
            "formation_error": float(formation.team.error[0]),
            "collisions": int(formation.team.contacts[0]),
            "active": active.copy(),
            "rewards": dict(zip(formation.task.terms, terms.tolist(), strict=True)),
        }
        if known.any():
            info["tracking_error"] = float(tracking[known].mean())
        return info

    def _show(self) -> None:
        if self.render_mode is not None:
            self._film.add(self._formation)
