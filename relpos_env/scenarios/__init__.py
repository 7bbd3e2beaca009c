"""Scenarios: rooms, obstacles, who moves, and the sensors. Adding one: a file and a line here."""

from __future__ import annotations

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.scenarios.base import Scenario
from relpos_env.scenarios.cars import CARS_LOS, CARS_NLOS
from relpos_env.scenarios.people import HUMAN, HUMAN_MOCAP, HumanScenario
from relpos_env.scenarios.ring import RING_LOS, RING_NLOS

SCENARIOS: dict[str, Scenario] = {
    "cars-los": CARS_LOS,
    "cars-nlos": CARS_NLOS,
    "ring-los": RING_LOS,
    "ring-nlos": RING_NLOS,
}
"""With cars: for environments and recordings."""

PEOPLE: dict[str, HumanScenario] = {
    "human": HUMAN,
    "human-mocap": HUMAN_MOCAP,
}
"""With a person: for recordings only."""

RECORDABLE: dict[str, Scenario | HumanScenario] = {**SCENARIOS, **PEOPLE}


def scenario(name: str) -> Scenario:
    """Look a scenario with cars up.

    Raises:
        EnvError: No scenario of that name, or one with a person, whom nobody can drive.
    """
    if name in PEOPLE:
        raise EnvError(
            f"scenario: {name!r} has a person and no cars to command, and can only be recorded; "
            f"expected one of {', '.join(SCENARIOS)}"
        )
    return look_up(SCENARIOS, name, "scenario")


def recordable(name: str) -> Scenario | HumanScenario:
    """Look any scenario up.

    Raises:
        EnvError: No scenario of that name.
    """
    return look_up(RECORDABLE, name, "scenario")


__all__ = [
    "PEOPLE",
    "RECORDABLE",
    "SCENARIOS",
    "HumanScenario",
    "Scenario",
    "recordable",
    "scenario",
]
