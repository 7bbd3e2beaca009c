"""What commands can pass on their way to the simulated cars: the safety gate of real ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from relpos_env.interface.infos import Columns
from relpos_env.interface.views import AgentView
from relpos_env.registry import look_up
from tracking.arrays import F64

GATE = "hardware_bridge.safety.simulated:SimulatedGate"
"""Found by its name: the simulation needs nothing of the hardware."""


class CommandGate(Protocol):
    """Of a batch of rooms."""

    def reset(self, env: int) -> None:
        """Reset one room."""

    def allow(self, view: AgentView, speed: F64, steering: F64) -> tuple[F64, F64]:
        """Speed [m/s] and steering [rad] that the cars may do, each (env, car)."""

    def infos(self) -> Columns:
        """What infos say of it, (env, car)."""


def make_gate(n_envs: int, n_cars: int) -> CommandGate:
    """The gate of real cars, with its usual limits."""
    none: dict[str, Callable[[int, int], CommandGate]] = {}
    return look_up(none, GATE, "gate", group="relpos_env.gates")(n_envs, n_cars)
