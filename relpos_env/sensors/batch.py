"""Sensor state and measured events of all environments, as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relpos_env.scenarios.episode import Episode
from relpos_env.sensors._imu_kernels import start_imus
from relpos_env.sensors._magnetometer_kernels import N_WAVE, start_magnetometers
from relpos_env.sensors.imu import IMU, fill_imu
from relpos_env.sensors.magnetometer import MAG, fill_mag
from relpos_env.sensors.odometer import ODOMETER
from relpos_env.sensors.proximity import PROXIMITY, fill_proximity
from relpos_env.timing import DT
from relpos_env.world.parameter_records import fill_numbers
from tracking.arrays import I64, Bool
from tracking.measurements import N_VALUES
from tracking.records import as_records

Array = NDArray[Any]


class Sensors(NamedTuple):
    """State of all sensors, arrays over (env, ...)."""

    imu: Array
    """IMU, (env)."""
    imu_seed: Array
    bias: Array
    """Constant bias of the IMUs, (env, car, 6) [rad/s, m/s2]."""
    drift: Array
    """Slow bias of the IMUs, (env, car, 6) [rad/s, m/s2]."""
    mag: Array
    """MAG, (env)."""
    mag_seed: Array
    waves: Array
    """Waves of the magnetic field, (env, wave, N_WAVE)."""
    hard_iron: Array
    """Offsets of the magnetometers, (env, car, 3) [uT]."""
    mast: Array
    """Height of the antenna over the tracker [m], (env)."""
    mount: Array
    """Tracker forward and left of the centre of mass, antenna above `mast`, (env, car, 3) [m]."""
    odometer: Array
    """ODOMETER, (env)."""
    odometer_seed: Array
    proximity: Array
    """PROXIMITY, (env)."""
    proximity_seed: Array


class Events(NamedTuple):
    """Measured events, arrays over (env, event), as in `MeasurementBlock`."""

    t: Array
    kind: Array
    i: Array
    j: Array
    antenna_i: Array
    antenna_j: Array
    values: Array
    has_power: Array
    valid: Array
    nlos: Array
    """True for ranges across an obstacle (NLOS)."""
    used: Array
    """Number of events written, (env)."""
    pose: Array
    """True pose after every step: x, y, heading, roll, pitch; (env, step, car, 5)."""


def make_sensors(n_envs: int, n_cars: int, n_waves: int) -> Sensors:
    """Return zeroed sensor arrays."""
    e, n = n_envs, n_cars
    return Sensors(
        imu=np.zeros(e, dtype=IMU),
        imu_seed=np.zeros(e, dtype=np.uint64),
        bias=np.zeros((e, n, 6)),
        drift=np.zeros((e, n, 6)),
        mag=np.zeros(e, dtype=MAG),
        mag_seed=np.zeros(e, dtype=np.uint64),
        waves=np.zeros((e, n_waves, N_WAVE)),
        hard_iron=np.zeros((e, n, 3)),
        mast=np.zeros(e),
        mount=np.zeros((e, n, 3)),
        odometer=np.zeros(e, dtype=ODOMETER),
        odometer_seed=np.zeros(e, dtype=np.uint64),
        proximity=np.zeros(e, dtype=PROXIMITY),
        proximity_seed=np.zeros(e, dtype=np.uint64),
    )


def start_sensors(s: Sensors, env: int, episode: Episode, rng: np.random.Generator) -> None:
    """Draw residual sensor errors of an environment and the magnetic field of its building.

    Args:
        s: Arrays of the sensors, written.
        env: Index of the environment.
        episode: Parameters of the sensors.
        rng: Source of the seeds of IMUs, magnetometers and odometers.
    """
    s.imu_seed[env], s.mag_seed[env], s.odometer_seed[env] = rng.integers(1 << 62, size=3)
    fill_imu(s.imu[env], episode.imu, DT)
    fill_mag(s.mag[env], episode.mag)
    fill_numbers(s.odometer[env], episode.odometer)
    fill_proximity(s.proximity[env], episode.proximity)
    start_imus(as_records(s.imu)[env], s.imu_seed[env], s.bias, s.drift, env)
    start_magnetometers(as_records(s.mag)[env], s.mag_seed[env], s.waves, s.hard_iron, env)
    s.mast[env] = episode.radio.antenna_height
    s.mount[env] = episode.mounts


def make_events(n_envs: int, n_cars: int, n_steps: int, n_ranges: int) -> Events:
    """Return an empty event buffer, large enough for a number of steps.

    Args:
        n_envs: Number of environments.
        n_cars: Number of cars.
        n_steps: Number of steps.
        n_ranges: Largest number of ranges in a step.
    """
    shape = (n_envs, n_steps * (2 * n_cars + n_ranges))

    def ints() -> I64:
        return np.zeros(shape, dtype=np.int64)

    def flags() -> Bool:
        return np.zeros(shape, dtype=bool)

    return Events(
        t=np.zeros(shape),
        kind=ints(),
        i=ints(),
        j=ints(),
        antenna_i=ints(),
        antenna_j=ints(),
        values=np.zeros((*shape, N_VALUES)),
        has_power=flags(),
        valid=flags(),
        nlos=flags(),
        used=np.zeros(n_envs, dtype=np.int64),
        pose=np.zeros((n_envs, n_steps, n_cars, 5)),
    )
