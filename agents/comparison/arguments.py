"""Validation of the arguments of comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from agents.errors import UsageError
from relpos_env.errors import EnvError
from relpos_env.interface.observations import observation_mode

SHORTEST, LONGEST = 0.1, 3600.0
"""[s] Limits of the length of an episode."""
MOST_EPISODES = 10_000

Name = TypeVar("Name")


def modes(names: Sequence[str]) -> list[str]:
    """Return the observation modes in order, without duplicates.

    Raises:
        UsageError: A mode does not exist, or there is none.
    """
    chosen = each_once("--observation", names)
    try:
        for name in chosen:
            observation_mode(name, 2)
    except EnvError as error:
        raise UsageError(f"--{error}") from error
    return chosen


def each_once(option: str, names: Sequence[Name]) -> list[Name]:
    """Return the names in order, without duplicates.

    Raises:
        UsageError: There are no names; the message contains the option.
    """
    chosen = list(dict.fromkeys(names))
    if not chosen:
        raise UsageError(f"{option}: expected at least one, got none")
    return chosen


def check_numbers(episodes: int, first_seed: int, seconds: float, settle: float) -> None:
    """Check the ranges of numbers.

    Raises:
        UsageError: A number is out of range; the message contains the option.
    """
    if not 1 <= episodes <= MOST_EPISODES:
        raise UsageError(f"--episodes: expected 1 to {MOST_EPISODES}, got {episodes}")
    if first_seed < 0:
        raise UsageError(f"--first-seed: expected 0 or more, got {first_seed}")
    if not SHORTEST <= seconds <= LONGEST:
        raise UsageError(f"--seconds: expected {SHORTEST:g} to {LONGEST:g}, got {seconds:g}")
    if not 0.0 <= settle < seconds:
        raise UsageError(f"--settle: expected 0 to less than --seconds, got {settle:g}")
