"""What a task is: wanted relative positions and velocities over time, and a reward."""

from __future__ import annotations

from typing import Protocol

from relpos_env.world import WorldState
from tracking.arrays import F64


class Task(Protocol):
    """A formation over time. Times count from the moment the cars are let go."""

    def reset(self, state: WorldState) -> None:
        """Begin from the cars' starting layout."""

    def target(self, t: float) -> F64:
        """Wanted position of every other car relative to every car, (car, other, 2) [m]."""

    def command(self, state: WorldState, t: float) -> F64:
        """Velocity that the operator, who sees the room, asks of every car, (car, 2) [m/s]."""

    def error(self, state: WorldState, t: float) -> F64:
        """Distance from the wanted relative positions, mean over the others, (car) [m]."""

    def rewards(self, state: WorldState, t: float, collided: F64) -> dict[str, F64]:
        """Named reward terms, (car) each; the reward is their sum."""
