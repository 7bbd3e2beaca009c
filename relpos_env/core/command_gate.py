"""Safety gate of the real cars for the commands of simulated ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from relpos_env.interface.infos import Columns
from relpos_env.interface.views import AgentView
from relpos_env.registry import look_up
from tracking.arrays import F64

GATE = "hardware_bridge.safety.simulated:SimulatedGate"
"""Name for look-up, so the simulation does not depend on `hardware_bridge`."""


class CommandGate(Protocol):
    """Safety gate of a batch of rooms."""

    def reset(self, env: int) -> None:
        """Reset one room."""

    def allow(self, view: AgentView, speed: F64, steering: F64) -> tuple[F64, F64]:
        """Return the allowed speed [m/s] and steering angle [rad] of the cars, each (env, car)."""

    def infos(self) -> Columns:
        """Return the columns of the gate for infos, (env, car)."""


def make_gate(n_envs: int, n_cars: int) -> CommandGate:
    """Return the gate of real cars with its default limits."""
    none: dict[str, Callable[[int, int], CommandGate]] = {}
    return look_up(none, GATE, "gate", group="relpos_env.gates")(n_envs, n_cars)
