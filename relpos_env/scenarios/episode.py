"""Sampling of an episode from a scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.scenarios.base import Scenario
from relpos_env.scenarios.checks import MOST_CARS
from relpos_env.scenarios.draws import (
    draw_car,
    draw_imu,
    draw_mag,
    draw_mounts,
    draw_odometer,
    draw_radio,
)
from relpos_env.scenarios.life import LifeEvent, Pose, draw_life
from relpos_env.scenarios.rooms.clutter import draw_clutter
from relpos_env.scenarios.rooms.floor import Floor
from relpos_env.scenarios.rooms.obstacle import Obstacle, boxes_of
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.proximity import ProximitySimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.world.car import CarParams
from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

KINDS = ("number", "clutter", "car", "imu", "mag", "odometer", "radio", "leaving", "power", "joins",
         "mounts")  # fmt: skip
"""Sampled quantities, each with its generator. New ones go to the end, to keep the others."""
DOORS = 8
"""[-] Number of poses for joining cars, used in turn."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Episode:
    """Sampled parameters of one episode of one environment."""

    __repr__ = short_repr

    obstacles: tuple[Obstacle, ...]
    """Obstacles of the scenario, then the sampled ones."""
    start: F64
    """Initial x, y, heading, (car, 3) [m, m, rad]; 0 for cars that are absent at the start."""
    present: Bool
    """True for cars that are present at the start, (car): the first ones."""
    events: tuple[LifeEvent, ...]
    """Events by rising time."""
    car: CarParams
    mounts: F64
    """Tracker positions, forward, left and up, (car, 3) [m]; see `Randomisation`."""
    imu: ImuSimParams
    mag: MagSimParams
    odometer: OdometerSimParams
    proximity: ProximitySimParams
    radio: RadioSimParams


def draw_episode(
    scenario: Scenario, n_slots: int, seconds: float, rng: np.random.Generator
) -> Episode:
    """Sample an episode.

    Invariants: equal scenario and generator give equal episodes; without randomisation the
    episode is the scenario with the poses of `Scenario.start(rng)`; enabling one kind of
    randomisation does not change the samples of another.

    Args:
        scenario: Scenario to sample from.
        n_slots: Maximum number of cars at the start; cars that are absent then can join later.
        seconds: Length of the episode, with the time at rest [s].
        rng: Generator of the initial poses; its children generate everything else.

    Raises:
        EnvError: `n_slots` or `seconds` is out of range, or the cars do not fit.
    """
    if not 2 <= n_slots <= MOST_CARS:
        raise EnvError(f"n_slots: expected 2 to {MOST_CARS}, got {n_slots}")
    if not 0.0 < seconds <= 86400.0:
        raise EnvError(f"seconds: expected above 0 and at most 86400, got {seconds}")
    s, what = scenario, scenario.randomisation
    rngs = dict(zip(KINDS, rng.spawn(len(KINDS)), strict=True))
    n = _number(s, n_slots, rngs["number"])
    obstacles, poses, joins = s.obstacles, None, None
    if what.obstacles[1] > 0 or what.has_life:
        floor = Floor(s.room, s.car, boxes_of(obstacles))
        obstacles += draw_clutter(s, floor, n_slots, rngs["clutter"])
        poses = s.scattered(floor, n, rng) if s.layout == "scattered" else None
        joins = floor
    if poses is None:
        poses = s.start(rng, n)
    start = np.zeros((n_slots, 3))
    start[:n] = poses
    present = np.arange(n_slots) < n
    mounts = draw_mounts(n_slots, s.mounts, s.car, what, rngs["mounts"])
    for array in (start, present, mounts):
        array.setflags(write=False)
    places = _places_to_join(s, joins, poses, rngs["joins"]) if what.has_life and joins else []
    return Episode(
        obstacles=obstacles,
        start=start,
        present=present,
        events=draw_life(what, present, seconds, places, rngs["leaving"], rngs["power"]),
        car=draw_car(s.car, what, rngs["car"]),
        mounts=mounts,
        imu=draw_imu(s.imu, what, rngs["imu"]),
        mag=draw_mag(s.mag, what, rngs["mag"]),
        odometer=draw_odometer(s.odometer, what, rngs["odometer"]),
        proximity=s.proximity,
        radio=draw_radio(s.radio, what, rngs["radio"]),
    )


def _number(s: Scenario, n_slots: int, rng: np.random.Generator) -> int:
    """Sample the number of cars at the start."""
    low, high = s.randomisation.n_cars or (s.n_cars, s.n_cars)
    if low > n_slots:
        raise EnvError(
            f"n_slots: expected at least {low}, the cars of scenario {s.name!r}, got {n_slots}"
        )
    return int(rng.integers(low, min(high, n_slots), endpoint=True))


def _places_to_join(s: Scenario, floor: Floor, taken: F64, rng: np.random.Generator) -> list[Pose]:
    """Sample free poses for joining cars, if possible away from the initial poses."""
    poses = floor.scatter(DOORS, s.start_area, taken[:, :2], rng)
    if not len(poses):
        poses = floor.scatter(DOORS, s.start_area, np.zeros((0, 2)), rng)
    return [(float(x), float(y), float(heading)) for x, y, heading in poses]
