"""Candidates of a comparison: a driver, found by its name, and its observation mode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from agents.comparison.trained import find_trained
from agents.controllers import CONTROLLERS, build_controller, controller_builder
from agents.driver import Driver
from agents.errors import UsageError
from agents.policies import shipped_names
from relpos_env.errors import EnvError
from relpos_env.interface.observations import observation_mode


class Entry(Protocol):
    """Source of a driver: a controller or a trained policy."""

    @property
    def title(self) -> str:
        """Name in tables and records."""

    @property
    def trained_on(self) -> str | None:
        """Observation mode that it was trained on, None if it was not trained."""

    @property
    def history(self) -> int:
        """Number of stacked observations."""

    @property
    def proximity(self) -> int | None:
        """Distance sensors that it was trained with, None if it was not trained."""

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """Return the reason for an incompatible mode or number of cars; None if compatible."""

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """Return the driver for an observation mode and a number of cars."""


@dataclass(frozen=True, slots=True)
class ControllerEntry:
    """A controller, which adapts to the fields of the observation."""

    title: str
    trained_on: None = None
    history: int = 1
    proximity: None = None

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """Return the fields that the mode lacks, as text; None if the mode is compatible."""
        try:
            self.driver(observation, n_cars, proximity)
        except UsageError as error:
            return str(error)
        return None

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """Return the controller for an observation mode."""
        fields = observation_mode(observation, n_cars, proximity).fields
        return build_controller(self.title, fields)


def find_controller(name: str) -> Entry | None:
    """Return the controller of a name, None if there is none.

    Raises:
        UsageError: ``package.module:Name`` cannot be imported.
    """
    try:
        controller_builder(name)
    except EnvError as error:
        if ":" in name and not Path(name).exists():
            raise UsageError(str(error)) from error
        return None
    return ControllerEntry(name)


SOURCES: tuple[Callable[[str], Entry | None], ...] = (find_controller, find_trained)
"""Lookup functions, called in order; each returns None for unknown names."""


def find_entry(name: str) -> Entry:
    """Return the source of the driver of a name.

    Args:
        name: One of `agents.controllers.CONTROLLERS`, or a policy as for
            `agents.policies.load_policy`.

    Raises:
        UsageError: The name is unknown, or the policy cannot be used.
    """
    for find in SOURCES:
        entry = find(name)
        if entry is not None:
            return entry
    known = ", ".join((*CONTROLLERS, *shipped_names()))
    raise UsageError(f"NAME: expected one of {known} or the file of a policy, got {name!r}")


@dataclass(frozen=True, slots=True)
class Contender:
    """A driver and its observations."""

    name: str
    """Name for `find_entry`."""
    observation: str
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    title: str = ""
    """Name of the driver in tables; `name` if empty."""
    proximity: int = 0
    """Number of distance sensors around each car."""

    @property
    def called(self) -> str:
        """Name of the driver in tables and records."""
        return self.title or self.name

    @property
    def sees(self) -> str:
        """Label of the observations for tables."""
        return sees(self.observation, self.proximity)

    @property
    def label(self) -> str:
        """Label of driver and observations for tables and pictures."""
        return f"{self.called} on {self.sees}"


def sees(observation: str, proximity: int) -> str:
    """Return the label of an observation mode and its distance sensors for tables."""
    return f"{observation}, {proximity} distance sensors" if proximity else observation


def line_up(
    names: Sequence[str], observations: Sequence[str], proximity: int | None = None
) -> list[Contender]:
    """Return every combination of driver and observation mode.

    Args:
        names: Names of drivers, see `find_entry`.
        observations: Modes of `relpos_env.interface.observations.OBSERVATIONS`.
        proximity: Distance sensors of all candidates; by default those that each policy was
            trained with, and for controllers the maximum of all policies.

    Raises:
        UsageError: A name is unknown.
    """
    entries = [find_entry(name) for name in names]
    titles = [entry.title for entry in entries]
    most = max((entry.proximity or 0 for entry in entries), default=0)
    proximities = [
        proximity if proximity is not None else most if entry.proximity is None else entry.proximity
        for entry in entries
    ]
    return [
        # Drivers with the same title are shown with their names instead.
        Contender(name, observation, title if titles.count(title) == 1 else name, n)
        for name, title, n in zip(names, titles, proximities, strict=True)
        for observation in observations
    ]
