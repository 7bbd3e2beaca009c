"""Tasks: targets, reference velocities, reward terms and termination of a group of cars."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

from relpos_env.errors import EnvError
from relpos_env.registry import build, look_up
from relpos_env.tasks.base import DrivingTask, InformedTask, Task, Truth
from relpos_env.tasks.escort import Escort
from relpos_env.tasks.follow import follow
from relpos_env.tasks.gap import Gap
from relpos_env.tasks.geometry.reassignment import Reassignment
from relpos_env.tasks.hold import hold
from relpos_env.tasks.inspect import Inspect
from relpos_env.tasks.observe import observe
from relpos_env.tasks.rendezvous import Rendezvous
from relpos_env.tasks.ring import Ring
from relpos_env.tasks.seek import Seek
from relpos_env.tasks.travel import travel
from relpos_env.tasks.weights import DEFAULT_WEIGHTS, reward_weights

TaskBuilder = Callable[..., Task]

TASKS: dict[str, TaskBuilder] = {
    "ring": Ring,
    "hold": hold,
    "travel": travel,
    "gap": Gap,
    "rendezvous": Rendezvous,
    "follow": follow,
    "observe": observe,
    "escort": Escort,
    "seek": Seek,
    "inspect": Inspect,
}
"""Name to builder ``(n_cars, n_envs, room, **options) -> Task``. A new task needs a file, a line
here, and its weights in `DEFAULT_WEIGHTS`."""


def task_builder(name: str | TaskBuilder) -> TaskBuilder:
    """Return the builder of a task.

    Args:
        name: One of `TASKS`, ``package.module:Name``, a name among the entry points
            ``relpos_env.tasks``, or a builder.

    Raises:
        EnvError: There is no task of this name.
    """
    return look_up(TASKS, name, "task", group="relpos_env.tasks")


def make_task(
    name: str | TaskBuilder, n_cars: int, n_envs: int, room: tuple[float, float], /, **options: Any
) -> Task:
    """Build a task from its name or builder.

    Args:
        name: See `task_builder`.
        n_cars: Maximum number of cars, 2 to 20.
        n_envs: Number of environments.
        room: Width along x and depth along y [m]; the origin is the middle.
        options: Options of the task, by name.

    Raises:
        EnvError: Unknown task, unknown option, or an option out of range.
    """
    builder = task_builder(name)
    known = [p for p in signature(builder).parameters if p not in _ALWAYS]
    for option in options:
        if option not in known:
            raise EnvError(
                f"task_options: task {name!r} expected {', '.join(known) or 'none'}, got {option!r}"
            )
    return build(builder, name, (n_cars, n_envs, room), Task, _EXPECTED, options=options)


_EXPECTED = "task: expected a function (n_cars, n_envs, room, **options) that returns a Task"
_ALWAYS = ("n_cars", "n_envs", "room")

__all__ = [
    "DEFAULT_WEIGHTS",
    "TASKS",
    "DrivingTask",
    "InformedTask",
    "Reassignment",
    "Task",
    "Truth",
    "make_task",
    "reward_weights",
    "task_builder",
]
