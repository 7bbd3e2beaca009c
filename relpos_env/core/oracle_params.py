"""Filter parameters that match the simulated world, for bounds and consistency tests.

Filters and worlds have parameters of different types on purpose; only this module translates.
Noise of sensors follows from their parameters. The errors of the attitude filter (heading and slow
acceleration errors), tyre slip beyond the model of the filter and the rates of NLOS transitions
were measured on simulated runs, as noted next to the numbers (`benchmarks/measure_world.py`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from relpos_env.scenarios import HumanScenario, Scenario
from relpos_env.sensors.radio.channel import ChannelParams
from relpos_env.timing import DT
from tracking.filters.joint.params import (
    JointParams,
    JointStartParams,
    NlosParams,
    NoiseLearningParams,
    RangeErrorParams,
)
from tracking.ranging.frames.timestamps import SPEED_OF_LIGHT
from tracking.vehicles import VEHICLES

STAMPS = 0.61
"""[-] White noise of a range, from three receive stamps, over that of one stamp as a distance."""
ENTER_RATE, LEAVE_RATE = 0.15, 0.3
"""[1/s] Rates from LOS to NLOS and back of a pair of cars in `cars-nlos`; used for other rooms with
obstacles and for bodies, too."""
NEVER = 1e-9
"""[1/s, -] Rate or probability of an event that never occurs; the filter takes its logarithm."""
SIDEWAYS = 0.035
"""[m/s] Slip of rear axles not explained by mount and cornering stiffness, as white noise at 20 Hz
with the same mean over 8 s, from 40 drives. In half of them it is below 0.015; crashes are most
of it."""


def matched_params(scenario: Scenario | HumanScenario) -> JointParams:
    """Return the parameters of the joint filter that match a scenario."""
    channel, imu = scenario.radio.channel, scenario.imu
    mean, std = excess_moments(channel)
    hidden = can_hide(scenario)
    power_diff_los_std, power_diff_nlos_std = (
        math.hypot(x, channel.gap_noise) for x in channel.gap_place
    )
    white = STAMPS * channel.stamp_std * SPEED_OF_LIGHT
    carriers = dict(VEHICLES)
    if isinstance(scenario, HumanScenario):
        carriers["human"] = replace(
            carriers["human"],
            accel_psd=math.hypot(imu.acc_noise, 0.6 * imu.vibration) * math.sqrt(DT),
            # Tilt error of VQF under limb accelerations, over three seconds: 0.03 to 0.1 m/s2.
            bias_std=0.08,
            bias_tau=5.0,
            # Yaw error of VQF: 1 to 3 degrees, and constant offsets of up to 5 degrees.
            heading_std=0.07,
            heading_tau=15.0,
        )
    else:
        carriers["car"] = replace(
            carriers["car"],
            accel_psd=math.hypot(imu.acc_noise, imu.vibration) * math.sqrt(DT),
            bias_std=math.hypot(imu.acc_bias, imu.acc_drift),
            bias_tau=imu.drift_tau,
            # Yaw error of VQF: 0.6 to 1.4 degrees around offsets of a degree; 6 degrees before the
            # first motion, 2 degrees around the mean of three cars ten seconds later.
            first_heading_std=0.1,
            heading_std=0.022,
            heading_tau=8.0,
            sideways_std=SIDEWAYS,
        )
    nlos = NlosParams(
        los_to_nlos_rate=ENTER_RATE if hidden else NEVER,
        nlos_to_los_rate=LEAVE_RATE,
        los_to_nlos_rate_with_power=ENTER_RATE if hidden else NEVER,
        nlos_to_los_rate_with_power=LEAVE_RATE,
        nlos_bias=max(mean, 1e-3),
        nlos_bias_std=max(std, 1e-3),
        nlos_bias_length=channel.excess_length,
        white_std=1e-3,
        power_diff_los=channel.gap,
        power_diff_los_std=max(power_diff_los_std, 0.1),
        power_diff_nlos=channel.gap + max(channel.gap_nlos, 0.1),
        power_diff_nlos_std=max(power_diff_nlos_std, 0.1),
        # Simulated radios lose ranges but give no outliers.
        outlier_prob=NEVER,
    )
    return JointParams(
        vehicles=carriers,
        range_error=RangeErrorParams(
            white_std=max(white, 1e-3),
            fast_std=max(channel.fast, 1e-4),
            fast_length=channel.fast_length,
            slow_std=max(channel.slow, 1e-4),
            slow_length=channel.slow_length,
        ),
        nlos=nlos,
        nlos_in_space=nlos,
        noise_learning=NoiseLearningParams(learns=False),  # the noise is known
        # The mean NIS is 1 if the noise model is correct.
        start=JointStartParams(respawn_nis=2.0),
    )


def can_hide(scenario: Scenario | HumanScenario) -> bool:
    """Return whether obstacles (of the scenario or drawn) or bodies can occlude a pair of nodes."""
    if isinstance(scenario, HumanScenario):
        return True
    return bool(scenario.obstacles) or scenario.randomisation.obstacles[1] > 0


def excess_moments(channel: ChannelParams) -> tuple[float, float]:
    """Return mean and standard deviation of the excess (NLOS bias) behind an obstacle [m]."""
    mu, sigma, cap = channel.excess
    z, weight = np.polynomial.hermite_e.hermegauss(64)
    excess = cap / (1.0 + np.exp(-(mu + sigma * z)))
    weight = weight / weight.sum()
    mean = float(weight @ excess)
    return mean, math.sqrt(max(float(weight @ excess**2) - mean**2, 0.0))
