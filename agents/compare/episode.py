"""Episodes of one contender in one setting, a batch at a time, and what is measured in them.

Law: the figures of an episode follow from contender, setting and seed alone, bit for bit;
neither the episodes beside it in the batch nor the number of jobs change them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from agents.compare.contender import Contender, find_entry
from agents.compare.setting import Setting
from agents.driver import Driver
from agents.frames import FrameRecorder
from relpos_env.config import Parts
from relpos_env.formation import Formation
from relpos_env.timing import DECISION
from tracking.arrays import F64, Bool
from tracking.geometry import GRAVITY

IN_FORMATION = 0.3
"""[m] A group is in formation while the error of every car is below this. Tighter than the 0.4 m
within which tasks call a single place taken (`relpos_env.tasks.moving.TOLERANCE`), and twice what
estimates and tyres leave as a mean, so that it says how often something goes wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeResult:
    """One episode; lengths and times as of `Setting`, NaN where there was nothing to score."""

    seed: int
    seconds: float
    """[s] Length."""
    done: bool
    """Whether it ended because the task was accomplished."""
    formation_error: float
    """[m] As the task says, mean over present cars and the scored time."""
    tracking_error: float
    """[m] Error of the relative positions that cars could use, mean over cars and scored time."""
    collisions_per_min: float
    """[1/min] Contacts begun, summed over the cars, over the whole episode."""
    time_in_formation: float
    """[-] Share of the scored time in which every present car's error is below `IN_FORMATION`."""
    energy: float
    """[J/min] Work of a car's motor at the wheels: what speeds the nominal mass up and what
    rolling takes, without what braking would give back; mean over present cars, whole episode."""
    error: F64
    """[m] Formation error after every decision, mean over present cars, (cycle)."""


def run_episodes(
    contender: Contender, setting: Setting, seeds: Sequence[int]
) -> list[EpisodeResult]:
    """Drive one episode for each seed, side by side.

    Args:
        contender: Drives all cars.
        setting: Where.
        seeds: Of the episodes.

    Raises:
        EnvError: The setting makes no sense.
        UsageError: No driver of that name.
    """
    formation, driver = _begin(contender, setting, seeds)
    meter = _Meter(formation)
    while meter.going.any():
        _decide(formation, driver)
        meter.read()
    formation.close()
    return [meter.result(e, seed, setting.first_scored) for e, seed in enumerate(seeds)]


def film_episode(contender: Contender, setting: Setting, seed: int) -> dict[str, Any]:
    """Frames of one episode for the animation, see `agents.frames`.

    Args:
        contender: Drives all cars.
        setting: Where.
        seed: Of the episode.
    """
    formation, driver = _begin(contender, setting, [seed])
    recorder = FrameRecorder(formation)
    while not (formation.terminated[0] or formation.truncated[0]):
        _decide(formation, driver)
        recorder.add()
    formation.close()
    return recorder.frames


def _begin(
    contender: Contender, setting: Setting, seeds: Sequence[int]
) -> tuple[Formation, Driver]:
    """Environments with an episode each, and who drives in them."""
    entry = find_entry(contender.name)
    parts = setting.parts(contender.observation, entry.history, contender.proximity)
    formation = Formation(parts, len(seeds))
    for env, seed in enumerate(seeds):
        formation.seed(env, seeding.np_random(seed)[0])
        formation.begin(env)
    return formation, entry.driver(contender.observation, parts.n_cars, contender.proximity)


def _decide(formation: Formation, driver: Driver) -> None:
    """One decision of all cars."""
    # One environment at a time: sums over a batch may be rounded otherwise than alone.
    actions = np.stack([driver.act(seen) for seen in formation.observations])
    formation.step(*formation.parts.actions.decode(actions, "actions"))


class _Meter:
    """Reads a batch after every decision; episodes that are over are left alone."""

    def __init__(self, formation: Formation) -> None:
        self._formation = formation
        self._car = _car(formation.parts)
        e, cycles = formation.n_envs, formation.parts.config.max_cycles
        self.going: Bool = np.ones(e, dtype=bool)
        self._cycles = np.zeros(e, dtype=np.int64)
        self._done = np.zeros(e, dtype=bool)
        self._error, self._tracking, self._worst = np.full((3, e, cycles), np.nan)
        self._contacts, self._work, self._car_time = np.zeros((3, e))
        self._speed = _speeds(formation)
        self._present = formation.state.present.copy()

    def read(self) -> None:
        """Take down what the last decision led to."""
        f = self._formation
        present, speed = f.state.present, _speeds(f)
        work = _work(self._speed, speed, *self._car)
        # A car that came in or was taken out in between was not driven there.
        driven = present & self._present
        tracking = f.tracking_error()
        for e in np.flatnonzero(self.going).tolist():
            k, here = int(self._cycles[e]), present[e]
            if here.any():
                error = f.task.error[e, here]
                self._error[e, k], self._worst[e, k] = error.mean(), error.max()
            known = np.isfinite(tracking[e])
            if known.any():
                self._tracking[e, k] = tracking[e, known].mean()
            self._contacts[e] += f.loop.swarm.contacts[e].sum()
            self._work[e] += work[e, driven[e]].sum()
            self._car_time[e] += DECISION * driven[e].sum()
        self._cycles += self.going
        self._done |= self.going & f.task.done
        self.going &= ~(f.terminated | f.truncated)
        self._speed, self._present = speed, present.copy()

    def result(self, env: int, seed: int, first_scored: int) -> EpisodeResult:
        """The figures of one environment."""
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
            tracking_error=_mean(self._tracking[env, scored]),
            collisions_per_min=60.0 * self._contacts[env] / seconds,
            time_in_formation=_mean((worst < IN_FORMATION)[np.isfinite(worst)]),
            energy=60.0 * self._work[env] / max(self._car_time[env], DECISION),
            error=self._error[env, :n].copy(),
        )


def _car(parts: Parts) -> tuple[float, float]:
    """Mass [kg] and rolling resistance [N] of the scenario's car, whatever mass is drawn."""
    car = parts.scenario.car
    return car.mass, car.rolling_resistance * car.mass * GRAVITY


def _speeds(formation: Formation) -> F64:
    """How fast the cars are, (env, car) [m/s]."""
    speeds: F64 = np.hypot(formation.state.vel_w[..., 0], formation.state.vel_w[..., 1])
    return speeds


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
