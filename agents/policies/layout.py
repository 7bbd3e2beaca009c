"""What a policy sees: a mode, slots for cars, and how many observations in one.

Two layouts whose digests are equal have the same numbers in the same places, so a policy for one
runs on the other. A policy for more cars than an environment has sees the missing ones as cars
that are absent.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from relpos_env.config import MOST_CARS, Parts, whole_number
from relpos_env.interface.beams import MOST_BEAMS
from relpos_env.interface.observations import Field, index_table, observation_mode, total_size
from relpos_env.interface.observations.base import F32
from relpos_env.interface.views import make_view
from relpos_env.registry import name_of
from tracking.arrays import I64

MOST_HISTORY = 64
"""[-] Observations in one at most, as in an environment."""
TOLD_ROWS = 3
"""[-] So many differences are told in a message."""


@dataclass(frozen=True)
class Layout:
    """The layout of an observation.

    Raises:
        EnvError: No such mode, or a number out of range.
    """

    observation: str
    """One of `relpos_env.interface.observations.OBSERVATIONS`."""
    n_cars: int
    """[-] Slots for cars, the own one included."""
    history: int = 1
    """[-] So many observations in one, the newest first."""
    proximity: int = 0
    """[-] Beams that measure distances round the car."""

    def __post_init__(self) -> None:
        whole_number("n_cars", self.n_cars, 2, MOST_CARS)
        whole_number("history", self.history, 1, MOST_HISTORY)
        whole_number("proximity", self.proximity, 0, MOST_BEAMS)
        observation_mode(self.observation, self.n_cars)

    @classmethod
    def of(cls, parts: Parts) -> Layout:
        """What the cars of an environment see."""
        config = parts.config
        name = name_of(config.observation)
        return cls(name, parts.n_cars, config.history, config.proximity)

    @cached_property
    def fields(self) -> tuple[Field, ...]:
        """The stretches of one of the observations."""
        return observation_mode(self.observation, self.n_cars, self.proximity).fields

    @property
    def one(self) -> int:
        """Numbers in one of the observations."""
        return total_size(self.fields)

    @property
    def size(self) -> int:
        """Numbers in all of them."""
        return self.history * self.one

    @cached_property
    def index(self) -> list[dict[str, Any]]:
        """Where every stretch stands, with units and limits, see `index_table`."""
        return index_table(self.fields)

    @cached_property
    def digest(self) -> str:
        """SHA-256 over names, sizes, units, limits and the history, in hexadecimal.

        The name of the mode has no part in it: ``estimate`` and ``truth`` are the same.
        """
        rows = [[f.name, f.size, f.unit, f.limit, f.signed] for f in self.fields]
        text = json.dumps([rows, self.history], separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def describe(self) -> str:
        """In words, for messages."""
        times = "" if self.history == 1 else f", {self.history} in one"
        beams = "" if self.proximity == 0 else f" with {self.proximity} beams"
        return f"observation {self.observation!r} of {self.n_cars} cars{beams}{times}"

    def differences(self, index: list[dict[str, Any]]) -> list[str]:
        """How a table of stretches differs from this layout's, one sentence each.

        Args:
            index: As `index`; what the stretches mean is not compared.
        """
        told = []
        for k in range(max(len(index), len(self.index))):
            here = _row(self.index[k]) if k < len(self.index) else "nothing"
            there = _row(index[k]) if k < len(index) else "nothing"
            if here != there:
                told.append(f"expected {here}, got {there}")
        if len(told) > TOLD_ROWS:
            told[TOLD_ROWS:] = [f"{len(told) - TOLD_ROWS} more"]
        return told

    def refusal(self, other: Layout) -> str | None:
        """Why a policy with this layout cannot drive cars that see another; None if it can.

        Args:
            other: Of an environment. It may have fewer cars.
        """
        expected = f"expected {self.describe()}, got {other.describe()}"
        if other.n_cars > self.n_cars:
            return f"{expected}: there are more cars than the policy has slots for"
        if other.history != self.history:
            return f"{expected}: the history differs"
        if other.proximity != self.proximity:
            return f"{expected}: the beams differ"
        same = replace(other, n_cars=self.n_cars)
        if same.digest != self.digest:
            return f"{expected}: the numbers differ"
        return None

    def padding_from(self, other: Layout) -> I64:
        """Where every number of this layout stands in one of fewer cars, (size).

        The others come in the order of their numbers in both, so the cars that there are have the
        first places; -1 in the places of the rest.

        Args:
            other: The same but for the number of cars.

        Raises:
            ValueError: It is not.
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
        """What a car sees that is the only one, and of which nothing else is known, (size)."""
        view = make_view(1, self.n_cars, self.proximity)
        view.present[0, 0] = True
        out = np.zeros((1, self.n_cars, self.one), dtype=np.float32)
        observation_mode(self.observation, self.n_cars, self.proximity).bind(view, out)()
        return np.tile(out[0, 0], self.history)


def _row(row: dict[str, Any]) -> str:
    """A stretch in words."""
    limits = f"{row['low']:g} to {row['high']:g}"
    return f"{row['name']} at {row['first']} to {row['last']} in {row['unit']} from {limits}"
