"""Parameters of an episode: those of the scenario times sampled factors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from relpos_env.scenarios.randomisation import Interval, Randomisation
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.world.car import CarParams
from tracking.arrays import F64
from tracking.mount import Mount

MOST_LOST = 0.9
"""[1] Upper limit of the message loss rate."""
LARGEST_CLOCK_OFFSET = 20e-6
"""[1] Maximum crystal frequency error (IEEE 802.15.4)."""


def factor(interval: Interval, rng: np.random.Generator) -> float:
    """Sample a log-uniform factor; exactly the bound if both bounds are equal."""
    low, high = interval
    share = rng.random()
    return low if low == high else math.exp((1.0 - share) * math.log(low) + share * math.log(high))


def draw_car(car: CarParams, what: Randomisation, rng: np.random.Generator) -> CarParams:
    """Sample the tyre friction and mass of the cars."""
    grip, load = factor(what.friction, rng), factor(what.mass, rng)
    return replace(car, friction=grip * car.friction, mass=load * car.mass)


def draw_mounts(
    n: int, given: Sequence[Mount], car: CarParams, what: Randomisation, rng: np.random.Generator
) -> F64:
    """Sample tracker positions, forward, left and up of the centre of mass, (car, 3) [m].

    Args:
        n: Number of cars.
        given: Mounts of the first cars, which keep them.
        car: Car, for the distance of its rear axle.
        what: Intervals of the others.
        rng: Generator.
    """
    low, high = np.transpose([what.mount_ahead, what.mount_aside])
    in_plane = rng.uniform(low, high, (n, 2))
    mounts = np.column_stack([in_plane, rng.uniform(*what.mount_height, n)])
    for drawn, mount in zip(mounts, given, strict=False):
        drawn[1:] = mount.aside, mount.height
        if mount.ahead is not None:
            drawn[0] = mount.ahead - car.rear_axle
    return mounts


def draw_imu(imu: ImuSimParams, what: Randomisation, rng: np.random.Generator) -> ImuSimParams:
    """Sample the noise, biases and vibration of the IMUs."""
    noise, bias = factor(what.imu_noise, rng), factor(what.imu_bias, rng)
    shake = factor(what.imu_vibration, rng)
    return replace(
        imu,
        gyr_noise=noise * imu.gyr_noise,
        acc_noise=noise * imu.acc_noise,
        gyr_bias=bias * imu.gyr_bias,
        acc_bias=bias * imu.acc_bias,
        gyr_drift=bias * imu.gyr_drift,
        acc_drift=bias * imu.acc_drift,
        vibration=shake * imu.vibration,
        gyr_vibration=shake * imu.gyr_vibration,
    )


def draw_mag(mag: MagSimParams, what: Randomisation, rng: np.random.Generator) -> MagSimParams:
    """Sample the magnetic disturbance of the building and the residual hard-iron offset."""
    bent, hard = factor(what.mag_disturbance, rng), factor(what.mag_hard_iron, rng)
    return replace(mag, disturbance=bent * mag.disturbance, hard_iron=hard * mag.hard_iron)


def draw_odometer(
    odometer: OdometerSimParams, what: Randomisation, rng: np.random.Generator
) -> OdometerSimParams:
    """Sample the std of the wheel radius error."""
    scale = factor(what.odometer_scale, rng)
    return replace(odometer, scale_std=min(scale * odometer.scale_std, 1.0))


def draw_radio(
    radio: RadioSimParams, what: Randomisation, rng: np.random.Generator
) -> RadioSimParams:
    """Sample message loss, range errors, clock offsets and residual antenna delays."""
    loss, hidden = factor(what.radio_loss, rng), factor(what.radio_loss_nlos, rng)
    noise, excess = factor(what.range_noise, rng), factor(what.range_excess, rng)
    clocks = factor(what.clock_offset, rng)
    delay = float(rng.uniform(*what.antenna_delay))
    c = radio.channel
    channel = replace(
        c,
        loss=_at_most(MOST_LOST, c.loss, loss),
        loss_nlos=_at_most(MOST_LOST, c.loss_nlos, hidden),
        stamp_std=noise * c.stamp_std,
        fast=noise * c.fast,
        slow=noise * c.slow,
        excess=(c.excess[0], c.excess[1], excess * c.excess[2]),
    )
    return replace(
        radio,
        channel=channel,
        clock_offset=_at_most(LARGEST_CLOCK_OFFSET, radio.clock_offset, clocks),
        antenna_delay_std=radio.antenna_delay_std + delay,
    )


def _at_most(most: float, value: float, by: float) -> float:
    """Return a value times a factor, limited to the larger of `most` and the value."""
    return min(by * value, max(value, most))
