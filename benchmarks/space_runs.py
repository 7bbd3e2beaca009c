"""Simulated runs in space with raw sensors: a hand next to fixed nodes, and a swarm of drones.

For `measure_space.py`: half of the runs begin at rest, the others in motion; rooms are about 5 m
long, sensors cheap or good, ranges have correlated errors of 3 to 10 cm, and a tenth of them is
NLOS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from tracking import Constellation, NodeConfig
from tracking.arrays import F64
from tracking.constellation import Antenna
from tracking.geometry import GRAVITY
from tracking.measurements import Kind, MeasurementBlock

SECONDS = 60.0
"""[s] Length of a run."""
BEFORE = 5.0
"""[s] Time of motion before the start, for nodes that start in motion."""
SIZE = np.array([1.8, 2.3])
"""[m] Half the length and width of the area of motion."""
STEPS = 2.0 * np.pi * 1.8
"""[rad/s] Step frequency of a walking person."""


@dataclass(frozen=True, slots=True)
class Sensors:
    """Standard deviations of an IMU's errors, per axis."""

    offset: float
    """[m/s2] Constant offset of the accelerometer."""
    accel: float
    """[m/s2] Noise of an accelerometer sample."""
    bias: float
    """[deg/s] Constant bias of the gyroscope."""
    gyr: float
    """[deg/s] Noise of a gyroscope sample."""
    scale: float = 0.005
    """[-] Scale errors of both sensors."""
    vibration: float = 0.1
    """[m/s2] Vibration in an accelerometer sample, in motion."""


CHEAP, GOOD = Sensors(0.2, 0.04, 0.5, 0.6), Sensors(0.05, 0.02, 0.1, 0.1)


@dataclass(frozen=True)
class Mover:
    """Position and orientation of a moving node as functions of time."""

    path: CubicSpline
    turns: RotationSpline
    rest: float
    """[s] Start of motion; negative if already in motion."""
    gait: float
    """[m] Amplitude of the vertical motion of steps."""

    def moves(self, t: F64) -> F64:
        """Return 0 at rest, 1 in motion, (time,)."""
        return 1.0 / (1.0 + np.exp(-np.clip((t - self.rest - 0.5) / 0.2, -50.0, 50.0)))

    def position(self, t: F64) -> F64:
        """Return the positions, (time, 3) [m]."""
        p = self.path(t)
        p[:, 2] += self.gait * self.moves(t) * np.sin(STEPS * t)
        return np.asarray(p)

    def imu(self, t: F64, sensors: Sensors, rng: np.random.Generator) -> F64:
        """Return angular rate [rad/s] and specific force [m/s2] with errors, (time, 6)."""
        accel = self.path(t, 2)
        accel[:, 2] += GRAVITY - self.gait * STEPS**2 * self.moves(t) * np.sin(STEPS * t)
        force = self.turns(t).inv().apply(accel)
        jitter = sensors.vibration * self.moves(t)[:, None]
        force *= 1.0 + sensors.scale * rng.standard_normal(3)
        force += sensors.offset * rng.standard_normal(3)
        force += np.hypot(sensors.accel, jitter) * rng.standard_normal(force.shape)
        rates = self.turns(t, 1) * (1.0 + sensors.scale * rng.standard_normal(3))
        rates += np.radians(sensors.bias) * rng.standard_normal(3)
        rates += np.radians(sensors.gyr) * rng.standard_normal(rates.shape)
        return np.concatenate([rates, force], axis=1)


def make_mover(rng: np.random.Generator, *, flies: bool) -> Mover:
    """Return a walking person with a tracker in one hand, or a drone."""
    rest = float(rng.uniform(2.0, 8.0)) if rng.random() < 0.5 else -BEFORE
    low = 0.0 if flies else float(rng.choice([0.0, 0.8, 1.0]))
    z = low if rest > 0.0 else 1.0
    place, way, side = np.array([*rng.uniform(-SIZE, SIZE), z]), rng.uniform(0.0, 7.0), 1.0
    t, places = [*np.arange(-BEFORE, max(rest, -BEFORE + 0.1), 0.5)], []
    places += [place] * len(t)
    while t[-1] < SECONDS + 3.0:
        t.append(t[-1] + rng.uniform(0.8, 1.6))
        side = -side if rng.random() < 0.1 else side
        way += side * rng.uniform(0.2, 1.2)
        speed = rng.uniform(0.3, 1.0) * (1.5 if flies else 1.0)
        step = speed * (t[-1] - t[-2]) * np.array([np.cos(way), np.sin(way)])
        place = np.array([*(place[:2] + step), place[2] + rng.normal(0.0, 0.6)])
        if (np.abs(place[:2]) > SIZE).any():
            way += 0.8 * side
        place[:2] = np.clip(place[:2], -SIZE, SIZE)
        height = rng.normal(1.1, 0.15) if rng.random() < 0.8 else rng.uniform(0.4, 2.0)
        place[2] = np.clip(place[2], 0.3, 2.8) if flies else height
        places.append(place)
    tilt_std, swing = (0.1, 0.05) if flies else (0.5, 0.2)
    held, yaw = rng.normal(0.0, tilt_std, 2), rng.uniform(-np.pi, np.pi)
    angles = [np.array([yaw, 0.0, 0.0])] * (t.index(next(x for x in t if x > rest)) + 1)
    while len(angles) < len(t):
        yaw += rng.normal(0.0, 0.6)
        angles.append(np.array([yaw, *(held + rng.normal(0.0, swing, 2))]))
    turns = RotationSpline(t, Rotation.from_euler("ZYX", angles))
    gait = 0.0 if flies else float(rng.uniform(0.01, 0.03))
    return Mover(CubicSpline(t, places), turns, rest, gait)


@dataclass(frozen=True)
class Run:
    """Measurements of a run, with ground truth."""

    constellation: Constellation
    block: MeasurementBlock
    positions: Callable[[F64], F64]
    """Positions of all nodes at given times, (time, node, 3) [m]."""
    heading: Callable[[float], float] | None = None
    """Heading of the first node at a time [rad], if it defines the world frame."""


def make_ranges(
    rng: np.random.Generator, t: F64, pair: F64, ends: F64, slow: float, white: float
) -> F64:
    """Simulate ranges with errors correlated over 1.5 m, and with NLOS, (range,) [m].

    Args:
        rng: Generator.
        t: Times, (range,) [s].
        pair: Index of the pair, (range,).
        ends: Vectors between the antennas, (range, 3) [m].
        slow: Standard deviation of the correlated error [m].
        white: Standard deviation of the white error [m].
    """
    z = np.linalg.norm(ends, axis=1) + rng.normal(0.0, white, len(t))
    for p in np.unique(pair):
        mine = np.nonzero(pair == p)[0]
        error, excess, last = rng.normal(0.0, slow), 0.0, mine[0]
        for k in mine:
            stays = np.exp(-np.linalg.norm(ends[k] - ends[last]) / 1.5)
            error = stays * error + np.sqrt(1.0 - stays**2) * rng.normal(0.0, slow)
            changes = 1.0 - np.exp(-(t[k] - t[last]) / (0.7 if excess > 0.0 else 6.0))
            if rng.random() < changes:
                excess = 0.0 if excess > 0.0 else rng.exponential(0.3)
            z[k] += error + excess
            last = k
    z += np.where(rng.random(len(t)) < 0.005, rng.uniform(0.0, 5.0, len(t)), 0.0)
    return np.maximum(z, 0.05)


def hand(seed: int) -> Run:
    """Simulate a hand-held node among four to eight fixed nodes with surveyed distances."""
    rng = np.random.default_rng(seed)
    sensors, hz = (CHEAP, GOOD)[rng.integers(2)], float(rng.choice([80.0, 100.0]))
    n, mover = int(rng.integers(4, 9)), make_mover(rng, flies=False)
    tiers = np.where(np.arange(n) % 2 == 0, 0.2, 2.3) + rng.normal(0.0, 0.1, n)
    heights = (tiers, rng.uniform(0.0, 2.5, n), rng.uniform(0.8, 2.0, n))[rng.integers(3)]
    fixed = np.column_stack([rng.uniform(-2.5, 2.5, n), rng.uniform(-3.0, 3.0, n), heights])
    lever = rng.normal(0.0, 0.05, 3)

    def heading(t: float) -> float:
        return float(mover.turns(t).as_euler("ZYX")[0])

    constellation = Constellation(
        nodes=(
            NodeConfig(id=1, vehicle="hand", imu_hz=hz, initial_heading=heading(0.0)),
            *(NodeConfig(id=100 + k, kind="static") for k in range(n)),
        ),
        heading="initial",
        antennas=(
            Antenna(id=1, node=1, offset_b=(lever[0], lever[1], lever[2])),
            *(Antenna(id=100 + k, node=100 + k, offset_b=(0.0, 0.0, 0.0)) for k in range(n)),
        ),
    )
    t = np.arange(0.0, SECONDS, 1.0 / hz)
    t_range = np.arange(0.01, SECONDS, 1.0 / rng.uniform(60.0, 170.0))
    other = np.arange(len(t_range)) % n
    antenna = mover.position(t_range) + mover.turns(t_range).apply(lever)
    errors = float(rng.uniform(0.03, 0.1)), float(rng.uniform(0.02, 0.06))
    z = make_ranges(rng, t_range, other, fixed[other] - antenna, *errors)
    i, j = np.triu_indices(n, 1)
    surveyed = np.linalg.norm(fixed[i] - fixed[j], axis=1) + rng.normal(0.0, 0.02, len(i))
    of_kind, none = MeasurementBlock.of_kind, np.zeros(len(t_range), dtype=np.int64)
    blocks = [
        of_kind(Kind.IMU, t, np.zeros(len(t), dtype=np.int64), mover.imu(t, sensors, rng)),
        of_kind(Kind.SURVEY, np.zeros(len(i)), i + 1, surveyed[:, None], j=j + 1),
        of_kind(Kind.RANGE, t_range, none, z[:, None], j=other + 1),
    ]

    def positions(t: F64) -> F64:
        still = np.broadcast_to(fixed, (len(t), n, 3))
        return np.concatenate([mover.position(t)[:, None], still], axis=1)

    return Run(constellation, MeasurementBlock.concatenate(blocks).sorted(), positions, heading)


def drones(seed: int) -> Run:
    """Simulate five drones with magnetometers in one room, 150 ranges per second."""
    rng, n, hz = np.random.default_rng(seed), 5, 100.0
    movers = [make_mover(rng, flies=True) for _ in range(n)]
    nodes = tuple(NodeConfig(id=k, vehicle="drone", imu_hz=hz, mag_hz=25.0) for k in range(n))
    constellation = Constellation(nodes=nodes)
    t, t_mag = np.arange(0.0, SECONDS, 1.0 / hz), np.arange(0.0, SECONDS, 0.04)
    of_kind, blocks = MeasurementBlock.of_kind, []
    for k, mover in enumerate(movers):
        north = np.array([0.0, 20.0, -40.0]) + rng.normal(0.0, 1.0, 3)
        field = mover.turns(t_mag).inv().apply(np.tile(north, (len(t_mag), 1)))
        field += rng.normal(0.0, 0.3, 3) + rng.normal(0.0, 0.4, field.shape)
        imu = mover.imu(t, GOOD, rng)
        blocks.append(of_kind(Kind.IMU, t, np.full(len(t), k), imu))
        blocks.append(of_kind(Kind.MAG, t_mag, np.full(len(t_mag), k), field))
    t_range = np.arange(0.01, SECONDS, 1.0 / 150.0)
    pair = rng.integers(0, constellation.n_pairs, len(t_range))
    i, j = constellation.pairs[pair].T

    def positions(t: F64) -> F64:
        return np.stack([mover.position(t) for mover in movers], axis=1)

    where, k = positions(t_range), np.arange(len(t_range))
    z = make_ranges(rng, t_range, pair, where[k, j] - where[k, i], 0.05, 0.04)
    blocks.append(of_kind(Kind.RANGE, t_range, i, z[:, None], j=j))
    return Run(constellation, MeasurementBlock.concatenate(blocks).sorted(), positions)
