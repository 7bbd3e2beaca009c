"""Requirements of tasks on scenarios."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from relpos_env.errors import EnvError
from relpos_env.scenarios import Scenario

DEFAULT_SCENARIO: Mapping[str, str] = {
    "ring": "ring-nlos",
    "hold": "ring-nlos",
    "travel": "hall",
    "gap": "gap",
    "rendezvous": "hall",
    "follow": "hall",
    "observe": "hall",
    "escort": "open",
    "seek": "open",
    "inspect": "hall",
}
"""Task to its default scenario."""


def needs_of(task: object, scenario: Scenario) -> dict[str, Any]:
    """Return the options of a task that follow from the scenario.

    Raises:
        EnvError: The scenario does not meet the requirements of the task.
    """
    if task == "ring":
        return {"half_axes": scenario.ring}
    if task == "gap":
        if scenario.gap is None:
            raise EnvError(
                f"scenario: task 'gap' expected one with a gap, such as 'gap', "
                f"got {scenario.name!r}"
            )
        return {"gap": scenario.gap}
    return {}
