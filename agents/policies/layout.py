"""Layout of a policy's observations: mode, number of cars, and number of stacked observations.

Two layouts with equal digests have the same numbers at the same indices, so a policy for one runs
on the other. A policy for more cars than an environment has observes the missing ones as absent.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from relpos_env.config import MOST_CARS, Parts, whole_number
from relpos_env.interface.observations import Field, index_table, observation_mode, total_size
from relpos_env.interface.observations.base import F32
from relpos_env.interface.rangefinders import MAX_RANGEFINDERS
from relpos_env.interface.views import make_view
from relpos_env.registry import name_of
from tracking.arrays import I64

MOST_HISTORY = 64
"""[-] Maximum number of stacked observations, as in an environment."""
MAX_ROWS = 3
"""[-] Maximum number of differences in a message."""


@dataclass(frozen=True)
class Layout:
    """Layout of an observation.

    Raises:
        EnvError: Unknown mode, or a number out of range.
    """

    observation: str
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    n_cars: int
    """[-] Maximum number of cars, the own one included."""
    history: int = 1
    """[-] Number of stacked observations, the newest first."""
    proximity: int = 0
    """[-] Number of distance sensors per car."""

    def __post_init__(self) -> None:
        whole_number("n_cars", self.n_cars, 2, MOST_CARS)
        whole_number("history", self.history, 1, MOST_HISTORY)
        whole_number("proximity", self.proximity, 0, MAX_RANGEFINDERS)
        observation_mode(self.observation, self.n_cars)

    @classmethod
    def of(cls, parts: Parts) -> Layout:
        """Return the layout of an environment's observations."""
        config = parts.config
        name = name_of(config.observation)
        return cls(name, parts.n_cars, config.history, config.proximity)

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """Fields of one observation."""
        return observation_mode(self.observation, self.n_cars, self.proximity).fields

    @property
    def one(self) -> int:
        """Length of one observation."""
        return total_size(self.fields)

    @property
    def size(self) -> int:
        """Length of all stacked observations."""
        return self.history * self.one

    @cached_property
    def index(self) -> list[dict[str, Any]]:
        """Index range, unit and limits of every field, see `index_table`."""
        return index_table(self.fields)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over names, sizes, units, limits and the history, in hexadecimal.

        The digest does not depend on the mode's name: ``estimate`` and ``truth`` are equal.
        """
        rows = [[f.name, f.size, f.unit, f.limit, f.signed] for f in self.fields]
        text = json.dumps([rows, self.history], separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def describe(self) -> str:
        """Return a description for messages."""
        times = "" if self.history == 1 else f", {self.history} in one"
        sensors = "" if self.proximity == 0 else f" with {self.proximity} distance sensors"
        return f"observation {self.observation!r} of {self.n_cars} cars{sensors}{times}"

    def differences(self, index: list[dict[str, Any]]) -> list[str]:
        """Return the differences of another table of fields from this layout's, one per row.

        Args:
            index: Table as `index`; the meaning of fields is not compared.
        """
        rows = []
        for k in range(max(len(index), len(self.index))):
            here = _row(self.index[k]) if k < len(self.index) else "nothing"
            there = _row(index[k]) if k < len(index) else "nothing"
            if here != there:
                rows.append(f"expected {here}, got {there}")
        if len(rows) > MAX_ROWS:
            rows[MAX_ROWS:] = [f"{len(rows) - MAX_ROWS} more"]
        return rows

    def refusal(self, other: Layout) -> str | None:
        """Return the reason why a policy of this layout cannot run on another; None if it can.

        Args:
            other: Layout of an environment, which may have fewer cars.
        """
        expected = f"expected {self.describe()}, got {other.describe()}"
        if other.n_cars > self.n_cars:
            return f"{expected}: there are more cars than the policy has slots for"
        if other.history != self.history:
            return f"{expected}: the history differs"
        if other.proximity != self.proximity:
            return f"{expected}: the numbers of distance sensors differ"
        same = replace(other, n_cars=self.n_cars)
        if same.digest != self.digest:
            return f"{expected}: the numbers differ"
        return None

    def padding_from(self, other: Layout) -> I64:
        """Return the index of every number of this layout in one of fewer cars, (size).

        The other cars are in the order of their indices in both layouts, so existing cars come
        first; the index is -1 for missing cars.

        Args:
            other: Layout that differs in the number of cars only.

        Raises:
            ValueError: The layout differs otherwise, or has more cars.
        """
        reason = self.refusal(other)
        if reason is not None:
            raise ValueError(reason)
        parts, first = [], 0
        for mine, theirs in zip(self.fields, other.fields, strict=True):
            place = np.full(mine.size, -1, dtype=np.int64)
            place[: theirs.size] = first + np.arange(theirs.size)
            first += theirs.size
            parts.append(place)
        one = np.concatenate(parts)
        steps = other.one * np.arange(self.history)[:, None]
        where: I64 = np.where(one < 0, -1, one + steps).ravel()
        return where

    def alone(self) -> F32:
        """Return the observation of a lone car with no estimates, (size)."""
        view = make_view(1, self.n_cars, self.proximity)
        view.present[0, 0] = True
        out = np.zeros((1, self.n_cars, self.one), dtype=np.float32)
        observation_mode(self.observation, self.n_cars, self.proximity).bind(view, out)()
        return np.tile(out[0, 0], self.history)


def _row(row: dict[str, Any]) -> str:
    """Return the description of a field."""
    limits = f"{row['low']:g} to {row['high']:g}"
    return f"{row['name']} at {row['first']} to {row['last']} in {row['unit']} from {limits}"
