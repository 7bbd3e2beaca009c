"""Sampling of events of a group: cars that leave and join, trackers that lose power.

Both are Poisson processes, evaluated in the order of time. Invariants: two cars are always
present; a car leaves only while present and joins only while absent; a tracker loses power only
while powered and its car is present, and regains it unless the car leaves before. A car joins
with its tracker on.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Literal

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.scenarios.randomisation import Interval, Randomisation
from relpos_env.timing import STAND_STILL
from tracking.arrays import Bool
from tracking.params.short_repr import short_repr

Happening = Literal["join", "leave", "power-off", "power-on"]
Pose = tuple[float, float, float]

LEAST = 2
"""[-] Minimum number of present cars."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeEvent:
    """Event of one car."""

    __repr__ = short_repr

    t: float
    """[s] Time since the start of the episode, with the time at rest."""
    car: int
    """Index of the car."""
    what: Happening
    """`join`: the car appears at `pose`, at rest and powered; `leave`: the car is removed;
    `power-off`, `power-on`: power of the tracker, while the car drives on."""
    pose: Pose | None = None
    """x, y, heading [m, m, rad] of a car that joins, clear of walls and of obstacles at their
    initial positions; other cars may be there."""

    def __post_init__(self) -> None:
        if (self.what == "join") != (self.pose is not None):
            raise EnvError(f"pose: expected one for a car that joins and only then, at {self.t:g}")


@dataclass(frozen=True, slots=True)
class _Draw:
    """Point of a process: time, a number in [0, 1) that selects the car, and duration."""

    t: float
    choice: float
    lasts: float


def draw_life(
    what: Randomisation,
    present: Bool,
    seconds: float,
    poses: list[Pose],
    leaving: np.random.Generator,
    power: np.random.Generator,
) -> tuple[LifeEvent, ...]:
    """Sample the events of an episode, by rising time.

    Args:
        what: Rates and durations.
        present: True for cars that are present at the start, (car); not changed.
        seconds: Length of the episode [s]. There are no events in the initial time at rest.
        poses: Poses of joining cars, used in turn; without any, cars do not leave.
        leaving: Generator for cars that leave and join.
        power: Generator for power losses.
    """
    rates = what.leave_rate if poses else (0.0, 0.0)
    group = _Group(present.copy())
    queue: list[tuple[float, int, str, _Draw, int]] = []
    for k, draw in enumerate(_process(rates, what.absence, seconds, leaving)):
        heapq.heappush(queue, (draw.t, 4 * k, "leave", draw, -1))
    for k, draw in enumerate(_process(what.power_off_rate, what.power_off_time, seconds, power)):
        heapq.heappush(queue, (draw.t, 4 * k + 1, "power-off", draw, -1))
    events: list[LifeEvent] = []
    joined = 0
    while queue:
        t, order, kind, draw, car = heapq.heappop(queue)
        if kind == "join":
            pose = poses[joined % len(poses)]
            joined += 1
            events.append(LifeEvent(t=t, car=group.join(draw.choice), what="join", pose=pose))
            continue
        chosen = group.happen(kind, draw.choice, car)
        if chosen is None:
            continue
        back = t + draw.lasts
        if kind == "leave":
            events.append(LifeEvent(t=t, car=chosen, what="leave"))
            if back < seconds:
                heapq.heappush(queue, (back, order + 2, "join", draw, -1))
        elif kind == "power-off":
            events.append(LifeEvent(t=t, car=chosen, what="power-off"))
            if back < seconds:
                outage = group.outages[chosen]
                heapq.heappush(queue, (back, order + 2, f"power-on {outage}", draw, chosen))
        else:
            events.append(LifeEvent(t=t, car=chosen, what="power-on"))
    return tuple(events)


class _Group:
    """Presence and tracker power of the cars."""

    def __init__(self, present: Bool) -> None:
        self.present, self.powered = present, np.ones(len(present), dtype=bool)
        self.outages = np.zeros(len(present), dtype=np.int64)
        """Counter per car that invalidates a pending power-on if the car has left, (car)."""

    def join(self, choice: float) -> int:
        car = _pick(~self.present, choice)
        self.present[car] = self.powered[car] = True
        return car

    def happen(self, kind: str, choice: float, car: int) -> int | None:
        """Apply an event and return its car; None if the event is not possible."""
        if kind == "leave":
            if self.present.sum() <= LEAST:
                return None
            car = _pick(self.present, choice)
            self.present[car] = False
        elif kind == "power-off":
            if not (self.present & self.powered).any():
                return None
            car = _pick(self.present & self.powered, choice)
            self.powered[car] = False
        elif kind != f"power-on {self.outages[car]}":
            return None
        else:
            self.powered[car] = True
            return car
        self.outages[car] += 1
        return car


def _pick(among: Bool, choice: float) -> int:
    cars = np.flatnonzero(among)
    return int(cars[int(choice * len(cars))])


def _process(
    rate: Interval, lasts: Interval, seconds: float, rng: np.random.Generator
) -> list[_Draw]:
    """Sample the points of a Poisson process, with a rate per minute sampled once."""
    if rate[1] == 0.0:
        return []
    per_second = rng.uniform(*rate) / 60.0
    draws: list[_Draw] = []
    t = STAND_STILL
    while True:
        t += rng.exponential() / max(per_second, 1e-12)
        if t >= seconds:
            return draws
        draws.append(_Draw(t, rng.random(), rng.uniform(*lasts)))
