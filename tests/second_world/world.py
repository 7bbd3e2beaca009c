"""What a run of the second world is: everything drawn at random before anything moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A car on a kinematic bicycle: its rear axle does not slide, whatever it does."""

    wheelbase: float
    """[m]"""
    ahead: float
    """[m] Tracker ahead of the rear axle."""
    aside: float
    """[m] Tracker left of the middle of the car."""
    top_speed: float
    """[m/s]"""
    acceleration: float
    """[m/s2] Along and across."""
    tilt: tuple[float, float, float]
    """[rad] Mounting error of the IMU: roll, pitch, yaw."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Imu:
    """A cheap or a good one."""

    hz: float
    gyr_noise: float
    """[rad/s] Of a sample."""
    gyr_bias: float
    """[rad/s]"""
    acc_noise: float
    """[m/s2] Of a sample."""
    acc_bias: float
    """[m/s2]"""
    vibration: float
    """[m/s2] Of a sample, at top speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """The magnetic field, and what the magnetometer adds."""

    level: float
    """[uT] Horizontal part, towards y."""
    down: float
    """[uT]"""
    bend: float
    """[uT] Standard deviation of an axis that steel adds, which changes with the place."""
    length: float
    """[m] Wavelength of that."""
    iron: float
    """[uT] What is left of the car's own after calibration."""
    noise: float
    """[uT]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Radio:
    """Ranges: white, slow and heavy-tailed errors."""

    hz: float
    """Of every pair."""
    white: float
    """[m]"""
    slow: float
    """[m]"""
    slow_time: float
    """[s] How long a slow error lasts, in motion or at rest."""
    long_share: float
    """[-] Share of the time at which ranges of a pair are long."""
    long_time: float
    """[s] For so long at a time."""
    long_excess: tuple[float, float]
    """[m]"""
    loss: float
    """[-]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """One run."""

    seed: int
    seconds: float
    vehicles: tuple[Vehicle, ...]
    imu: Imu
    field: Field
    radio: Radio
    radius: float
    """[m] Cars turn back from there."""
    at_rest: float
    """[s] Nothing moves before."""
    kind: str = "car"
    """Or `hand`, `drone`, `human`: three to six in space, a body with six nodes."""


def draw(
    seed: int, *, kind: str = "car", seconds: float = 60.0, long_share: float | None = None
) -> World:
    """Draw a world.

    Args:
        seed: Same seed and kind, same world.
        kind: What carries the nodes.
        seconds: Length of the run [s].
        long_share: Share of long ranges; drawn as well where None.
    """
    rng = np.random.default_rng([seed, 0])

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    vehicles = []
    for _ in range(int(rng.integers(3, 6))):
        wheelbase = between(0.2, 0.5)
        vehicles.append(
            Vehicle(
                wheelbase=wheelbase,
                ahead=between(-0.1, 1.1) * wheelbase,
                aside=between(-0.06, 0.06),
                top_speed=between(0.8, 3.0),
                acceleration=between(1.0, 4.0),
                tilt=tuple(rng.normal(0.0, np.radians([0.7, 0.7, 1.0])).tolist()),
            )
        )
    cheap = between(0.0, 1.0)
    imu = Imu(
        hz=float(rng.choice([50.0, 100.0, 104.0, 200.0])),
        gyr_noise=0.002 + 0.008 * cheap,
        gyr_bias=0.002 + 0.01 * cheap,
        acc_noise=0.02 + 0.08 * cheap,
        acc_bias=0.01 + 0.06 * cheap,
        vibration=between(0.0, 1.5),
    )
    field = Field(
        level=between(17.0, 25.0),
        down=between(35.0, 48.0),
        bend=between(0.0, 1.5),
        length=between(2.0, 8.0),
        iron=between(0.0, 0.5),
        noise=between(0.1, 0.5),
    )
    is_slow = rng.random() < 0.5
    radio = Radio(
        hz=between(8.0, 30.0),
        white=between(0.02, 0.10),
        slow=between(0.01, 0.06) if is_slow else 0.0,
        slow_time=between(3.0, 20.0),
        long_share=between(0.0, 0.1) if long_share is None else long_share,
        long_time=between(0.5, 4.0),
        long_excess=(0.5, 2.0),
        loss=between(0.0, 0.2),
    )
    world = World(
        seed=seed,
        seconds=seconds,
        vehicles=tuple(vehicles),
        imu=imu,
        field=field,
        radio=radio,
        radius=between(3.0, 8.0),
        at_rest=between(0.5, 4.0),
    )
    if kind == "car":
        return world
    n_nodes = 6 if kind == "human" else int(rng.integers(4, 7))
    carriers = [
        replace(
            vehicles[0],
            top_speed=between(1.0, 2.0) if kind != "drone" else between(1.5, 4.0),
            tilt=tuple(rng.normal(0.0, np.radians([0.7, 0.7, 1.0])).tolist()),
        )
        for _ in range(n_nodes)
    ]
    return replace(
        world,
        kind=kind,
        vehicles=tuple(carriers),
        imu=replace(imu, hz=max(imu.hz, 100.0), vibration=0.3 * imu.vibration),
        radius=between(1.5, 4.0),
    )
