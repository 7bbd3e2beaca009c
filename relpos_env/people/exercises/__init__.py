"""Exercises of a simulated person; a new one needs a file and a line here."""

from __future__ import annotations

from relpos_env.people.exercises.base import Bout, Exercise
from relpos_env.people.exercises.jumping_jacks import jumping_jacks
from relpos_env.people.exercises.squats import squats
from relpos_env.people.exercises.walking import walking
from relpos_env.registry import look_up

EXERCISES: dict[str, Exercise] = {
    "walking": walking,
    "jumping-jacks": jumping_jacks,
    "squats": squats,
}


def exercise(name: str) -> Exercise:
    """Return the exercise of a name.

    Raises:
        EnvError: There is no exercise of that name.
    """
    return look_up(EXERCISES, name, "exercise")


__all__ = ["EXERCISES", "Bout", "Exercise", "exercise"]
