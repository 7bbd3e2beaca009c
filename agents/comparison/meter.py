"""What is measured in an episode, of a simulation or of real cars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from relpos_env.interface.observations.base import F32
from relpos_env.timing import DECISION
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool
from tracking.geometry import GRAVITY
from tracking.params.short_repr import short_repr

IN_FORMATION = 0.3
"""[m] A group is in formation while the error of every car is below this. Tighter than the 0.4 m
within which tasks call a single place taken (`relpos_env.tasks.moving.TOLERANCE`), and twice what
estimates and tyres leave as a mean, so that it says how often something goes wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeResult:
    """One episode; lengths and times as of `Setting`, NaN where there was nothing to score."""

    __repr__ = short_repr

    seed: int
    """On real cars the number of the round."""
    seconds: float
    """[s] Length."""
    done: bool
    """Whether it ended because the task was accomplished."""
    formation_error: float
    """[m] As the task says, mean over present cars and the scored time."""
    place_error: float
    """[m] Distance of the group's middle from where the task wants it, mean over the scored time;
    NaN where the task gives no places."""
    tracking_error: float
    """[m] Error of the relative positions that cars could use, mean over cars and scored time."""
    collisions_per_min: float
    """[1/min] Contacts begun, summed over the cars, over the whole episode."""
    contact_time: float
    """[-] Share of the cars' time in which they touch something, over the whole episode: collisions
    begun do not tell who presses on."""
    time_in_formation: float
    """[-] Share of the scored time in which every present car's error is below `IN_FORMATION`."""
    energy: float
    """[J/min] Work of a car's motor at the wheels: what speeds the nominal mass up and what
    rolling takes, without what braking would give back; mean over present cars, whole episode."""
    error: F64
    """[m] Formation error after every decision, mean over present cars, (cycle)."""


class Running(Protocol):
    """Episodes side by side, in arrays over (env, car); what is not known is NaN."""

    @property
    def car(self) -> CarParams:
        """The nominal car."""

    @property
    def cycles(self) -> int:
        """Decisions of the longest episode."""

    @property
    def observations(self) -> F32:
        """What the cars see, (env, car, size)."""

    @property
    def present(self) -> Bool:
        """Who is in the room, (env, car)."""

    @property
    def speed(self) -> F64:
        """How fast the cars are, (env, car) [m/s]; another array after every decision."""

    @property
    def error(self) -> F64:
        """Formation error, (env, car) [m]."""

    @property
    def place_error(self) -> F64:
        """Distance of the group's middle from that of its goals, (env) [m]."""

    @property
    def tracking_error(self) -> F64:
        """Of the relative positions that cars could use, (env, car) [m]."""

    @property
    def collisions(self) -> F64:
        """That cars began in the last decision, (env, car) [-]."""

    @property
    def clearance(self) -> F64:
        """Way between a car and what is nearest to it, 0 at a touch, (env, car) [m]."""

    @property
    def done(self) -> Bool:
        """Whether the task is accomplished, (env)."""

    @property
    def over(self) -> Bool:
        """Whether the episode has ended, (env)."""

    def step(self, actions: F32) -> None:
        """One decision of all cars, (env, car, 2)."""


class Meter:
    """Reads episodes after every decision; those that are over are left alone."""

    def __init__(self, running: Running) -> None:
        """Begin to read.

        Args:
            running: Episodes that have just begun.
        """
        self._running = running
        mass = running.car.mass
        self._car = mass, running.car.rolling_resistance * mass * GRAVITY
        self._speed, self._present = running.speed, running.present.copy()
        e = len(self._present)
        self.going: Bool = np.ones(e, dtype=bool)
        """Which still go on, (env)."""
        self._cycles = np.zeros(e, dtype=np.int64)
        self._done = np.zeros(e, dtype=bool)
        self._error, self._place, self._tracking, self._worst = np.full(
            (4, e, running.cycles), np.nan
        )
        self._collisions, self._touching, self._here = np.zeros((3, e))
        self._work, self._car_time = np.zeros((2, e))

    def read(self) -> None:
        """Take down what the last decision led to."""
        r = self._running
        present, speed, error, collisions = r.present, r.speed, r.error, r.collisions
        touching = np.where(np.isnan(r.clearance), np.nan, r.clearance == 0.0)
        work = _work(self._speed, speed, *self._car)
        # A car that came in or was taken out in between was not driven there.
        driven = present & self._present
        tracking, place = r.tracking_error, r.place_error
        for e in np.flatnonzero(self.going).tolist():
            k, here = int(self._cycles[e]), present[e]
            if here.any():
                theirs = error[e, here]
                self._error[e, k], self._worst[e, k] = theirs.mean(), theirs.max()
                self._place[e, k] = place[e]
            known = np.isfinite(tracking[e])
            if known.any():
                self._tracking[e, k] = tracking[e, known].mean()
            self._collisions[e] += collisions[e].sum()
            self._touching[e] += touching[e, here].sum()
            self._here[e] += here.sum()
            self._work[e] += work[e, driven[e]].sum()
            self._car_time[e] += DECISION * driven[e].sum()
        self._cycles += self.going
        self._done |= self.going & r.done
        self.going &= ~r.over
        self._speed, self._present = speed, present.copy()

    def result(self, env: int, seed: int, first_scored: int) -> EpisodeResult:
        """The figures of one episode.

        Args:
            env: Which.
            seed: Its own.
            first_scored: Number of the first decision whose errors count.
        """
        n = int(self._cycles[env])
        # What ends before it is scored is scored by its end, as in the demonstration.
        scored = slice(min(first_scored, n - 1), n)
        worst = self._worst[env, scored]
        seconds = n * DECISION
        return EpisodeResult(
            seed=seed,
            seconds=seconds,
            done=bool(self._done[env]),
            formation_error=_mean(self._error[env, scored]),
            place_error=_mean(self._place[env, scored]),
            tracking_error=_mean(self._tracking[env, scored]),
            collisions_per_min=60.0 * self._collisions[env] / seconds,
            contact_time=self._touching[env] / max(self._here[env], 1.0),
            time_in_formation=_mean((worst < IN_FORMATION)[np.isfinite(worst)]),
            energy=60.0 * self._work[env] / max(self._car_time[env], DECISION),
            error=self._error[env, :n].copy(),
        )


def _work(before: F64, after: F64, mass: float, rolling: float) -> F64:
    """Work of the motor in a decision, none where the car is braked, (env, car) [J].

    Args:
        before: Speed, (env, car) [m/s].
        after: A decision later.
        mass: [kg]
        rolling: Resistance [N].
    """
    kinetic = 0.5 * mass * (after**2 - before**2)
    return np.maximum(kinetic + rolling * 0.5 * (before + after) * DECISION, 0.0)


def _mean(values: Any) -> float:
    """Mean of what there is, NaN for nothing."""
    found = values[np.isfinite(values)]
    return float(found.mean()) if len(found) else float("nan")
