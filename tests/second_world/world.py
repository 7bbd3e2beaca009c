"""Parameters of a run of the second world, all drawn at random before the simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A car as a kinematic bicycle: its rear axle never slides."""

    wheelbase: float
    """[m] Wheelbase."""
    ahead: float
    """[m] Tracker ahead of the rear axle."""
    aside: float
    """[m] Tracker left of the centre line of the car."""
    top_speed: float
    """[m/s] Top speed."""
    acceleration: float
    """[m/s2] Largest longitudinal and lateral acceleration."""
    tilt: tuple[float, float, float]
    """[rad] Mounting error of the IMU: roll, pitch, yaw."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Imu:
    """Standard deviations of the errors of an IMU, per axis."""

    hz: float
    gyr_noise: float
    """[rad/s] Noise of a gyroscope sample."""
    gyr_bias: float
    """[rad/s] Gyroscope bias."""
    acc_noise: float
    """[m/s2] Noise of an accelerometer sample."""
    acc_bias: float
    """[m/s2] Accelerometer bias."""
    vibration: float
    """[m/s2] Vibration in an accelerometer sample, at top speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """The magnetic field, and the errors of the magnetometer."""

    level: float
    """[uT] Horizontal component, towards y."""
    down: float
    """[uT] Vertical component."""
    bend: float
    """[uT] Standard deviation of the position-dependent disturbance by steel, per axis."""
    length: float
    """[m] Wavelength of the disturbance by steel."""
    iron: float
    """[uT] Residual hard-iron error of the car after calibration, per axis."""
    noise: float
    """[uT] Noise of a magnetometer sample, per axis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Radio:
    """Ranges: white, slow and heavy-tailed errors."""

    hz: float
    """[Hz] Range rate of every pair."""
    white: float
    """[m] Standard deviation of the white error."""
    slow: float
    """[m] Standard deviation of the slow error."""
    slow_time: float
    """[s] Correlation time of the slow error, in motion or at rest."""
    long_share: float
    """[-] Share of the time in which ranges of a pair are NLOS."""
    long_time: float
    """[s] Mean duration of NLOS."""
    long_excess: tuple[float, float]
    """[m] Limits of the NLOS bias."""
    loss: float
    """[-] Share of lost ranges."""


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
    """[m] Distance from the origin at which cars turn back."""
    at_rest: float
    """[s] Time at rest at the start."""
    kind: str = "car"
    """Vehicle of the nodes: `car` (3 to 5), `hand` or `drone` (4 to 6), `human` (6 on one body)."""


def draw(
    seed: int, *, kind: str = "car", seconds: float = 60.0, long_share: float | None = None
) -> World:
    """Draw a world.

    Args:
        seed: Seed of the world.
        kind: Vehicle of the nodes.
        seconds: Length of the run [s].
        long_share: Share of NLOS ranges [-]; None to draw it.
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
