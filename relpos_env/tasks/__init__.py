"""Tasks: what a formation should be, and what is asked of each car."""

from __future__ import annotations

from collections.abc import Callable

from relpos_env.registry import look_up
from relpos_env.scenarios import Scenario
from relpos_env.tasks.base import Task
from relpos_env.tasks.ring import RingFormation

TASKS: dict[str, Callable[[Scenario], Task]] = {"ring": RingFormation}
"""Name to builder ``(scenario) -> Task``. Adding one: a file and a line here."""


def make_task(name: str, scenario: Scenario) -> Task:
    """Look a task up and build it.

    Raises:
        EnvError: No task of that name.
    """
    return look_up(TASKS, name, "task")(scenario)


__all__ = ["TASKS", "Task", "make_task"]
