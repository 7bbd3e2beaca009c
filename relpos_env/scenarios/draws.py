"""Parameters of an episode: what the scenario says, times factors that are drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from relpos_env.scenarios.randomisation import Interval, Randomisation
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.world.car import CarParams
from tracking.arrays import F64

MOST_LOST = 0.9
"""[1] Share of messages lost, at most."""
LARGEST_CLOCK_OFFSET = 20e-6
"""[1] What crystals may be off by (IEEE 802.15.4)."""


def factor(interval: Interval, rng: np.random.Generator) -> float:
    """A factor, log-uniform; exactly the bound where both are the same."""
    low, high = interval
    share = rng.random()
    return low if low == high else math.exp((1.0 - share) * math.log(low) + share * math.log(high))


def draw_car(car: CarParams, what: Randomisation, rng: np.random.Generator) -> CarParams:
    """Grip and mass."""
    grip, load = factor(what.friction, rng), factor(what.mass, rng)
    return replace(car, friction=grip * car.friction, mass=load * car.mass)


def draw_mounts(n: int, what: Randomisation, rng: np.random.Generator) -> F64:
    """Draw where trackers sit: ahead and left of the centre of mass, and higher, (car, 3) [m]."""
    low, high = np.transpose([what.mount_ahead, what.mount_aside])
    in_plane = rng.uniform(low, high, (n, 2))
    return np.column_stack([in_plane, rng.uniform(*what.mount_height, n)])


def draw_imu(imu: ImuSimParams, what: Randomisation, rng: np.random.Generator) -> ImuSimParams:
    """Noise, biases and vibration."""
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
    """The building and what calibration left."""
    bent, hard = factor(what.mag_disturbance, rng), factor(what.mag_hard_iron, rng)
    return replace(mag, disturbance=bent * mag.disturbance, hard_iron=hard * mag.hard_iron)


def draw_odometer(
    odometer: OdometerSimParams, what: Randomisation, rng: np.random.Generator
) -> OdometerSimParams:
    """How far wheel radii are off."""
    scale = factor(what.odometer_scale, rng)
    return replace(odometer, scale_std=min(scale * odometer.scale_std, 1.0))


def draw_radio(
    radio: RadioSimParams, what: Randomisation, rng: np.random.Generator
) -> RadioSimParams:
    """Losses, errors of ranges, clocks and what calibration left of antenna delays."""
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
    """A value times a factor, but not brought beyond a limit by it."""
    return min(by * value, max(value, most))
