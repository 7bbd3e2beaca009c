"""Who is compared: a driver by its name, and what it is shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from agents.comparison.trained import find_trained
from agents.controllers import CONTROLLERS, controller_builder
from agents.driver import Driver
from agents.errors import UsageError
from agents.policies import shipped_names
from relpos_env.errors import EnvError
from relpos_env.interface.observations import observation_mode


class Entry(Protocol):
    """What the name of a driver stands for."""

    @property
    def title(self) -> str:
        """For tables and records."""

    @property
    def trained_on(self) -> str | None:
        """Observation mode that it was trained on, None if it was not trained."""

    @property
    def history(self) -> int:
        """So many observations it sees in one."""

    @property
    def proximity(self) -> int | None:
        """Beams that it was trained with, None if it was not trained."""

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """Why it cannot drive so many cars on a mode of observations; None if it can."""

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """The driver of so many cars on a mode of observations."""


@dataclass(frozen=True, slots=True)
class ControllerEntry:
    """A controller: it takes the stretches that an observation has, whatever they are."""

    title: str
    trained_on: None = None
    history: int = 1
    proximity: None = None

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """A mode in which it cannot read what it needs."""
        try:
            self.driver(observation, n_cars, proximity)
        except UsageError as error:
            return str(error)
        return None

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """The controller of one mode."""
        fields = observation_mode(observation, n_cars, proximity).fields
        return controller_builder(self.title)(fields)


def find_controller(name: str) -> Entry | None:
    """A controller of that name, if there is one.

    Raises:
        UsageError: ``package.module:Name`` of what cannot be imported.
    """
    try:
        controller_builder(name)
    except EnvError as error:
        if ":" in name and not Path(name).exists():
            raise UsageError(str(error)) from error
        return None
    return ControllerEntry(name)


SOURCES: tuple[Callable[[str], Entry | None], ...] = (find_controller, find_trained)
"""Where drivers come from, asked one after the other; each gives None for names it does not
know."""


def find_entry(name: str) -> Entry:
    """What a name stands for.

    Args:
        name: One of `agents.controllers.CONTROLLERS`, or a policy as for
            `agents.policies.load_policy`.

    Raises:
        UsageError: Nothing, or a policy that cannot be used.
    """
    for find in SOURCES:
        entry = find(name)
        if entry is not None:
            return entry
    known = ", ".join((*CONTROLLERS, *shipped_names()))
    raise UsageError(f"NAME: expected one of {known} or the file of a policy, got {name!r}")


@dataclass(frozen=True, slots=True)
class Contender:
    """A driver and what it is shown."""

    name: str
    """What `find_entry` knows it by."""
    observation: str
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    title: str = ""
    """What tables call the driver; by default its name."""
    proximity: int = 0
    """Beams that measure distances round each car."""

    @property
    def called(self) -> str:
        """The driver, for tables and records."""
        return self.title or self.name

    @property
    def sees(self) -> str:
        """What it is shown, for tables."""
        return sees(self.observation, self.proximity)

    @property
    def label(self) -> str:
        """Driver and observations, for tables and pictures."""
        return f"{self.called} on {self.sees}"


def sees(observation: str, proximity: int) -> str:
    """A mode and its beams, for tables."""
    return f"{observation}, {proximity} beams" if proximity else observation


def line_up(
    names: Sequence[str], observations: Sequence[str], proximity: int | None = None
) -> list[Contender]:
    """Every driver on every mode of observations.

    Args:
        names: See `find_entry`.
        observations: Of `relpos_env.interface.observations.OBSERVATIONS`.
        proximity: Beams of all of them; by default each policy has its own, and controllers as
            many as any policy.

    Raises:
        UsageError: A name stands for nothing.
    """
    entries = [find_entry(name) for name in names]
    titles = [entry.title for entry in entries]
    most = max((entry.proximity or 0 for entry in entries), default=0)
    beams = [
        proximity if proximity is not None else most if entry.proximity is None else entry.proximity
        for entry in entries
    ]
    return [
        # Drivers of the same title are told apart by what they were asked for as.
        Contender(name, observation, title if titles.count(title) == 1 else name, n)
        for name, title, n in zip(names, titles, beams, strict=True)
        for observation in observations
    ]
