"""`formation_v0` on real cars: the same agents, spaces, observations and actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hardware_bridge.live.group import Feed, LiveGroup
from hardware_bridge.live.swarm import LiveSwarm
from relpos_env.errors import EnvError
from relpos_env.interface.actions import action_mode
from relpos_env.interface.base_parallel_env import BaseFormationParallelEnv
from relpos_env.interface.observations import observation_mode


class HardwareFormationEnv(BaseFormationParallelEnv):
    """Cars that are moved by motors, in real time: a step takes a tenth of a second.

    What the gate allows is what happens. Infos have the keys of the simulation but `collisions`,
    which are not counted; formation errors and rewards are those of the estimates. They say
    what the gate made of the last action: ``asked_speed`` and ``allowed_speed`` [m/s],
    ``allowed_steering`` [rad], ``gate``, why that is less than asked, and ``stopped``, True where
    the car is not armed, so that the transition is not the policy's.
    """

    metadata = {**BaseFormationParallelEnv.metadata, "render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        swarm: LiveSwarm,
        feed: Feed,
        *,
        observation: str = "estimate",
        history: int = 1,
        actions: str = "continuous",
        max_cycles: int = 600,
        prepare: Callable[[LiveGroup], None] | None = None,
    ) -> None:
        """Give a swarm the face of the environment.

        Args:
            swarm: Trackers of the cars.
            feed: Ports and supervisor, or a recording.
            observation: One of `relpos_env.interface.observations.OBSERVATIONS`.
            history: So many observations in one, the newest first.
            actions: One of `relpos_env.interface.actions.ACTIONS`.
            max_cycles: Steps until truncation.
            prepare: Called at every reset, before the episode: see `Start`.

        Raises:
            EnvError: No such mode.
            BridgeError: A mode that needs the truth.
        """
        n = swarm.config.n_slots
        mode = observation_mode(observation, n, swarm.config.task.proximity)
        self.group = LiveGroup(swarm, feed, mode, history=history, max_cycles=max_cycles)
        super().__init__(self.group, mode.fields, action_mode(actions), n_cars=n, history=history)
        self.render_mode = None
        self._prepare = prepare

    def render(self) -> None:
        """Nothing: `relpos live --view` shows the swarm."""

    def close(self) -> None:
        """Let the cars stand; the environment can be reset again."""
        if self._begun:
            self.group.let_stand()
        self.agents = []
        self._begun = False

    def _begin(self, options: Mapping[str, Any]) -> None:
        if options:
            raise EnvError(f"options: expected none on real cars, got {', '.join(options)}")
        self.group.begin()
        if self._prepare is not None:
            self._prepare(self.group)
            self.group.begin()
