"""PettingZoo environment: cars keep a formation with the estimates of their trackers.

Every step, a car observes the estimated positions of the others (or, in the mode ``truth``, the
true ones), and returns a speed and a steering angle. `docs/reference/environment.md` has the
tables of observations, actions and rewards.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from relpos_env.api.state_space import state_space, truth_inside
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.core.reset_options import reset_options
from relpos_env.core.tracked_world import TrackedWorld
from relpos_env.errors import EnvError
from relpos_env.interface.base_parallel_env import BaseFormationParallelEnv
from relpos_env.interface.observations.base import F32
from relpos_env.render.film import Film, check_render_mode
from relpos_env.scenarios import Scenario
from relpos_env.simulation.recorder import Recording
from relpos_env.tasks.options import flag
from relpos_env.world.pymunk_space import PhysicsSpace
from tracking.log import Log


class FormationEnv(BaseFormationParallelEnv):
    """Cars in a room that keep a formation with the estimates of the group's tracker.

    Agents join and leave as described in `BaseFormationParallelEnv`. `reset` takes the options of
    `relpos_env.core.reset_options.ResetOptions`: ``poses``, ``goals`` and ``scenario``.

    Property: equal arguments, seeds and actions give equal results, bit for bit.
    """

    def __init__(
        self,
        *,
        render_mode: str | None = None,
        record: bool = False,
        fixed_agents: bool = False,
        **arguments: Any,
    ) -> None:
        """Build the environment.

        Args:
            render_mode: None, ``human`` or ``rgb_array``.
            record: True to record measurements and truth of the episode, see `recorded_log`.
            fixed_agents: True to make every slot an agent for the whole episode, for tools that
                need a constant set of agents.
            arguments: Fields of `relpos_env.config.FormationConfig`.

        Raises:
            EnvError: An unknown name or a number out of range; the argument is named.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._parts = parts = configure(arguments)
        self._record = flag("record", record)
        self._formation = EnvCore(parts, physics="pymunk")
        history = parts.config.history
        super().__init__(
            self._formation,
            parts.mode.fields,
            parts.actions,
            n_cars=parts.n_cars,
            history=history,
            fixed_agents=flag("fixed_agents", fixed_agents),
        )
        self.state_space = state_space(parts)
        self._film = Film(render_mode, 10.0)
        self._recording: Recording | None = None

    @property
    def scenario(self) -> Scenario:
        """Room, obstacles, cars and sensors."""
        return self._parts.scenario

    @property
    def formation(self) -> EnvCore:
        """The running environment: truth, task, views of the cars; a batch of one.

        Raises:
            EnvError: Before the first reset.
        """
        if not self._begun:
            raise EnvError("the environment must be reset first")
        return self._formation

    @property
    def loop(self) -> TrackedWorld:
        """The running simulation with its trackers; a batch of one."""
        return self.formation.loop

    @property
    def world(self) -> PhysicsSpace:
        """The pymunk space of the episode, to read and to change; see `world.pymunk_space`.

        Raises:
            EnvError: Before the first reset, or with ``physics="fast"``.
        """
        return self.formation.loop.swarm.world(0)

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Drive for 0.1 s; see `BaseFormationParallelEnv`."""
        recorded = self._recording if self.agents else None
        results = super().step(actions)
        if recorded is not None:
            recorded.add_swarm(self.loop.swarm)
        return results

    @property
    def max_episode_steps(self) -> int:
        """Steps until truncation."""
        return self._parts.config.max_cycles

    def state(self) -> F32:
        """Return the true state for critics, (8 car), inside `state_space`; zeros for absent cars.

        Columns of each car: 1, x, y, cosine and sine of the heading, velocity x, y, yaw rate.
        """
        state: F32 = truth_inside(self.formation.state, self.state_space)[0]
        return state

    def recorded_log(self, name: str) -> Log:
        """Return the episode so far as a log with truth.

        Raises:
            EnvError: The environment was not made with ``record=True``, or not reset.
        """
        if self._recording is None:
            raise EnvError("record: expected True when the environment was made, and a reset")
        constellation = self.loop.swarm.constellation
        return self._recording.to_log(name, self.scenario.name, constellation, truth_every=2)

    def render(self) -> Any:
        """Return an image of the current state, uint8 (height, width, 3).

        None without a render mode, or with a window, which is updated at every step.

        Raises:
            EnvError: Before the first reset.
        """
        return self._film.picture(self.formation)

    def close(self) -> None:
        """Release the window; the environment can be reset again."""
        self._film.close()
        self.agents = []
        self._begun = False

    def _begin(self, options: Mapping[str, Any]) -> None:
        requested = reset_options(options, self._parts)
        self._recording = recording = Recording() if self._record else None
        self._formation.begin([0], None if recording is None else recording.add_swarm, requested)
        self._film.forget()

    def _show(self) -> None:
        if self.render_mode is not None:
            self._film.add(self._formation)
