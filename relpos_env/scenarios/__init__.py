"""Scenarios: rooms, obstacles, cars and their sensors. Adding one: a file and a line here."""

from __future__ import annotations

from relpos_env.registry import look_up
from relpos_env.scenarios.base import Scenario
from relpos_env.scenarios.cars import CARS_LOS, CARS_NLOS
from relpos_env.scenarios.ring import RING_LOS, RING_NLOS

SCENARIOS: dict[str, Scenario] = {
    "cars-los": CARS_LOS,
    "cars-nlos": CARS_NLOS,
    "ring-los": RING_LOS,
    "ring-nlos": RING_NLOS,
}


def scenario(name: str) -> Scenario:
    """Look a scenario up.

    Raises:
        EnvError: No scenario of that name.
    """
    return look_up(SCENARIOS, name, "scenario")


__all__ = ["SCENARIOS", "Scenario", "scenario"]
