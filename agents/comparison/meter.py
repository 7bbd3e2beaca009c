"""Metrics of an episode, simulated or with real cars."""

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
"""[m] A group is in formation while the error of every car is below this. Below the 0.4 m within
which tasks regard a slot as occupied (`relpos_env.tasks.moving.TOLERANCE`), and twice the mean
error on estimates, so that the share of time in formation measures how often a group fails."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeResult:
    """Metrics of one episode; scored time as in `Setting`, NaN for metrics without data."""

    __repr__ = short_repr

    seed: int
    """Seed of the episode; number of the round on real cars."""
    seconds: float
    """[s] Length of the episode."""
    done: bool
    """True if the episode ended because the task was accomplished."""
    formation_error: float
    """[m] Formation error of the task, mean over present cars and the scored time."""
    place_error: float
    """[m] Distance of the group's centre from that of its goals, mean over the scored time; NaN if
    the task has no goals."""
    tracking_error: float
    """[m] Error of the usable relative positions, mean over cars and the scored time."""
    disagreement: float
    """[m] Difference of two cars' estimates of each other, mean over cars and the scored time;
    NaN with one tracker for the group."""
    collisions_per_min: float
    """[1/min] Collisions (onsets of contact), summed over the cars, whole episode."""
    contact_time: float
    """[-] Share of the cars' time in contact, whole episode; unlike the number of collisions it
    also measures lasting contact."""
    time_in_formation: float
    """[-] Share of the scored time in which every present car's error is below `IN_FORMATION`."""
    energy: float
    """[J/min] Work of a car's motor at the wheels: acceleration of the nominal mass and rolling
    resistance, without recuperation; mean over present cars, whole episode."""
    error: F64
    """[m] Formation error after every control step, mean over present cars, (step,)."""


class Running(Protocol):
    """A batch of episodes in arrays over (env, car); unknown values are NaN."""

    @property
    def car(self) -> CarParams:
        """The nominal car."""

    @property
    def cycles(self) -> int:
        """Control steps of the longest episode."""

    @property
    def observations(self) -> F32:
        """Observations of the cars, (env, car, size)."""

    @property
    def present(self) -> Bool:
        """True for present cars, (env, car)."""

    @property
    def speed(self) -> F64:
        """Speed of the cars, (env, car) [m/s]; a new array after every control step."""

    @property
    def error(self) -> F64:
        """Formation error, (env, car) [m]."""

    @property
    def place_error(self) -> F64:
        """Distance of the group's centre from that of its goals, (env,) [m]."""

    @property
    def tracking_error(self) -> F64:
        """Error of the usable relative positions, (env, car) [m]."""

    @property
    def disagreement(self) -> F64:
        """Difference of two cars' estimates of each other, (env, car) [m]; NaN for one tracker."""

    @property
    def collisions(self) -> F64:
        """Collisions that began in the last control step, (env, car) [-]."""

    @property
    def clearance(self) -> F64:
        """Distance from a car to the nearest object, 0 in contact, (env, car) [m]."""

    @property
    def done(self) -> Bool:
        """True if the task is accomplished, (env,)."""

    @property
    def over(self) -> Bool:
        """True if the episode has ended, (env,)."""

    def step(self, actions: F32) -> None:
        """Run one control step of all cars, actions (env, car, 2)."""


class Meter:
    """Accumulates metrics after every control step, up to the end of each episode."""

    def __init__(self, running: Running) -> None:
        """Initialise the metrics.

        Args:
            running: Episodes that have just begun.
        """
        self._running = running
        mass = running.car.mass
        self._car = mass, running.car.rolling_resistance * mass * GRAVITY
        self._speed, self._present = running.speed, running.present.copy()
        e = len(self._present)
        self.going: Bool = np.ones(e, dtype=bool)
        """True for episodes that have not ended, (env,)."""
        self._cycles = np.zeros(e, dtype=np.int64)
        self._done = np.zeros(e, dtype=bool)
        self._error, self._place, self._worst = np.full((3, e, running.cycles), np.nan)
        self._tracking, self._disagreement = np.full((2, e, running.cycles), np.nan)
        self._collisions, self._touching, self._here = np.zeros((3, e))
        self._work, self._car_time = np.zeros((2, e))

    def read(self) -> None:
        """Record the state after the last control step."""
        r = self._running
        present, speed, error, collisions = r.present, r.speed, r.error, r.collisions
        touching = np.where(np.isnan(r.clearance), np.nan, r.clearance == 0.0)
        work = _work(self._speed, speed, *self._car)
        # Cars that joined or left during the step are not counted.
        driven = present & self._present
        tracking, disagreement, place = r.tracking_error, r.disagreement, r.place_error
        for e in np.flatnonzero(self.going).tolist():
            k, here = int(self._cycles[e]), present[e]
            if here.any():
                theirs = error[e, here]
                self._error[e, k], self._worst[e, k] = theirs.mean(), theirs.max()
                self._place[e, k] = place[e]
            known = np.isfinite(tracking[e])
            if known.any():
                self._tracking[e, k] = tracking[e, known].mean()
            known = np.isfinite(disagreement[e])
            if known.any():
                self._disagreement[e, k] = disagreement[e, known].mean()
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
        """Return the metrics of one episode.

        Args:
            env: Index of the environment.
            seed: Seed of the episode.
            first_scored: Index of the first control step whose errors are scored.
        """
        n = int(self._cycles[env])
        # Episodes that end earlier are scored by their last step, as in the demonstration.
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
            disagreement=_mean(self._disagreement[env, scored]),
            collisions_per_min=60.0 * self._collisions[env] / seconds,
            contact_time=self._touching[env] / max(self._here[env], 1.0),
            time_in_formation=_mean((worst < IN_FORMATION)[np.isfinite(worst)]),
            energy=60.0 * self._work[env] / max(self._car_time[env], DECISION),
            error=self._error[env, :n].copy(),
        )


def _work(before: F64, after: F64, mass: float, rolling: float) -> F64:
    """Return the work of the motor in a control step, 0 while braking, (env, car) [J].

    Args:
        before: Speed before the step, (env, car) [m/s].
        after: Speed after the step, (env, car) [m/s].
        mass: Mass of a car [kg].
        rolling: Rolling resistance [N].
    """
    kinetic = 0.5 * mass * (after**2 - before**2)
    return np.maximum(kinetic + rolling * 0.5 * (before + after) * DECISION, 0.0)


def _mean(values: Any) -> float:
    """Return the mean of the finite values, NaN if there are none."""
    found = values[np.isfinite(values)]
    return float(found.mean()) if len(found) else float("nan")
