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
    """Environment on real cars, in real time: a step takes a tenth of a second.

    The cars execute the actions as limited by the gate. Infos have the keys of the simulation
    except `collisions`, which are not counted; formation errors and rewards are based on the
    estimates. Infos also have the gate's result for the last action: ``asked_speed`` and
    ``allowed_speed`` [m/s], ``allowed_steering`` [rad], ``gate``, the reason for a limit, and
    ``stopped``, True if the car is not armed, so that the policy did not cause the transition.
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
        """Create an environment on a swarm.

        Args:
            swarm: Trackers of the cars.
            feed: Ports and supervisor, or a recording.
            observation: One of `relpos_env.interface.observations.OBSERVATIONS`.
            history: Number of stacked observations, the newest first.
            actions: One of `relpos_env.interface.actions.ACTIONS`.
            max_cycles: Number of steps until truncation.
            prepare: Called at every reset, before the episode: see `Start`.

        Raises:
            EnvError: Unknown mode.
            BridgeError: The observation mode needs ground truth.
        """
        n = swarm.config.n_slots
        mode = observation_mode(observation, n, swarm.config.task.proximity)
        self.group = LiveGroup(swarm, feed, mode, history=history, max_cycles=max_cycles)
        super().__init__(self.group, mode.fields, action_mode(actions), n_cars=n, history=history)
        self.render_mode = None
        self._prepare = prepare

    def render(self) -> None:
        """Do nothing: `relpos live --view` shows the swarm."""

    def close(self) -> None:
        """Stop the cars; the environment can be reset again."""
        if self._begun:
            self.group.stop_cars()
        self.agents = []
        self._begun = False

    def _begin(self, options: Mapping[str, Any]) -> None:
        if options:
            raise EnvError(f"options: expected none on real cars, got {', '.join(options)}")
        self.group.begin()
        if self._prepare is not None:
            self._prepare(self.group)
            self.group.begin()
