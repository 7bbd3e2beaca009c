"""Scenarios: rooms, obstacles, cars or people, sensors, and the randomisation of episodes.

Scenarios with cars are the files in `files/`; a new one needs a file there. See
`docs/reference/scenarios.md`.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import TypeVar, cast

from relpos_env.errors import EnvError
from relpos_env.scenarios.base import Scenario
from relpos_env.scenarios.catalogue import SHIPPED, is_path, load_scenario
from relpos_env.scenarios.episode import Episode, draw_episode
from relpos_env.scenarios.levels import LEVELS
from relpos_env.scenarios.life import LifeEvent
from relpos_env.scenarios.people import HUMAN, HUMAN_MOCAP, HumanScenario
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.scenarios.rooms.gap import Gap
from relpos_env.scenarios.rooms.obstacle import Obstacle

Entry = TypeVar("Entry")

SCENARIOS: Mapping[str, Scenario] = SHIPPED
"""Scenarios with cars, for environments and recordings; each file is read at its first use."""

PEOPLE: dict[str, HumanScenario] = {
    "human": HUMAN,
    "human-mocap": HUMAN_MOCAP,
}
"""Scenarios with a person, for recordings only."""

RECORDABLE: Mapping[str, Scenario | HumanScenario] = ChainMap(
    # ChainMap looks up in this order and iterates in reverse order; it is never written to.
    cast(MutableMapping[str, Scenario | HumanScenario], PEOPLE),
    cast(MutableMapping[str, Scenario | HumanScenario], SCENARIOS),
)


def scenario(name: str | Path | Scenario) -> Scenario:
    """Return a scenario with cars, by name or from a file.

    Args:
        name: One of `SCENARIOS`, the path of a file that ends in `.toml`, or a scenario.

    Raises:
        EnvError: Unknown name, a scenario with a person, which has no cars, or an invalid file.
    """
    if isinstance(name, Scenario):
        return name
    if isinstance(name, Path) or is_path(name):
        return load_scenario(name)
    if name in PEOPLE:
        raise EnvError(
            f"scenario: {name!r} has a person and no cars to command, and can only be recorded; "
            f"expected one of {', '.join(SCENARIOS)}"
        )
    return _known(SCENARIOS, name)


def recordable(name: str) -> Scenario | HumanScenario:
    """Return any scenario by name, or one with cars from a file.

    Args:
        name: One of `RECORDABLE`, or the path of a file that ends in `.toml`.

    Raises:
        EnvError: Unknown name, or an invalid file.
    """
    return load_scenario(name) if is_path(name) else _known(RECORDABLE, name)


def _known(registry: Mapping[str, Entry], name: str) -> Entry:
    if name in registry:
        return registry[name]
    names = ", ".join(registry)
    raise EnvError(f"scenario: expected one of {names} or a file *.toml, got {name!r}")


__all__ = [
    "LEVELS",
    "PEOPLE",
    "RECORDABLE",
    "SCENARIOS",
    "Episode",
    "Gap",
    "HumanScenario",
    "LifeEvent",
    "Obstacle",
    "Randomisation",
    "Scenario",
    "draw_episode",
    "load_scenario",
    "recordable",
    "scenario",
]
