"""The life of a group: cars that are taken away and come back, trackers that lose power.

Both are Poisson processes. What happens is decided in the order of time: who is present, who has
power, who is gone. Laws: two cars are always present; a car leaves only when present and joins
only when absent; a tracker loses power only while its car is present and it has some, and gets
it back unless the car leaves before. A car joins with its tracker on.
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
"""[-] So many cars are always present."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeEvent:
    """Something that happens to one car."""

    __repr__ = short_repr

    t: float
    """[s] Since the start of the episode, the time at rest included."""
    car: int
    """Its slot."""
    what: Happening
    """`join`: comes in at `pose`, at rest and with power; `leave`: is taken out; `power-off`
    and `power-on`: its tracker, while the car goes on driving."""
    pose: Pose | None = None
    """x, y, heading [m, m, rad] of a car that joins, free of walls and obstacles as they stood
    at the start; other cars may be there."""

    def __post_init__(self) -> None:
        if (self.what == "join") != (self.pose is not None):
            raise EnvError(f"pose: expected one for a car that joins and only then, at {self.t:g}")


@dataclass(frozen=True, slots=True)
class _Draw:
    """One point of a process: when, a number in [0, 1) that chooses the car, and for how long."""

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
    """Everything that happens in an episode, by rising time.

    Args:
        what: Rates and durations.
        present: Who is there at the start, (car); not changed.
        seconds: Length of the episode. Nothing happens while the cars stand at first.
        poses: Where cars join, one after the other and round again; without any, cars do not
            leave either.
        leaving: For cars that leave and join.
        power: For trackers without power.
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
    """Who is present and whose tracker has power."""

    def __init__(self, present: Bool) -> None:
        self.present, self.powered = present, np.ones(len(present), dtype=bool)
        self.outages = np.zeros(len(present), dtype=np.int64)
        """Changes of power of each car, so that what ended already does not end again, (car)."""

    def join(self, choice: float) -> int:
        car = _pick(~self.present, choice)
        self.present[car] = self.powered[car] = True
        return car

    def happen(self, kind: str, choice: float, car: int) -> int | None:
        """The car that it happens to; None where it cannot."""
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
    """Points at a rate per minute that is drawn once."""
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
