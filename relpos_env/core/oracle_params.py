"""What a filter would believe if it knew the simulated world: for bounds and consistency tests.

Filters and worlds have parameters of different types on purpose. This is the one place that
translates. Noise of sensors follows from their parameters; what the orientation stage makes of
them (heading and slow acceleration errors), how tyres slip beyond what the filter knows and how
often sight is lost were measured on simulated runs, as written next to the numbers
(`benchmarks/measure_world.py`).
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
"""[-] White noise of a range over that of its three receive stamps' worth of way."""
ENTER_RATE, LEAVE_RATE = 0.15, 0.3
"""[1/s] How often a pair of cars loses sight of each other behind the box of `cars-nlos`, and how
often it gets it back; taken for other rooms with obstacles and for bodies, too."""
NEVER = 1e-9
"""[1/s] or [-] What does not happen; the filter takes logarithms of it."""
SIDEWAYS = 0.035
"""[m/s] Slip of rear axles that no mount and cornering stiffness explains, as white noise 20 times
a second: what is white and has the same mean over 8 s, 40 drives. In half of them it is below
0.015; a crash is most of it."""


def matched_params(scenario: Scenario | HumanScenario) -> JointParams:
    """Parameters of the joint filter that are those of a scenario."""
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
            # Tilt of VQF under limb accelerations, over three seconds: 0.03 to 0.1 m/s2.
            bias_std=0.08,
            bias_tau=5.0,
            # World yaw of VQF against the truth: 1 to 3 degrees and constant offsets to 5.
            heading_std=0.07,
            heading_tau=15.0,
        )
    else:
        carriers["car"] = replace(
            carriers["car"],
            accel_psd=math.hypot(imu.acc_noise, imu.vibration) * math.sqrt(DT),
            bias_std=math.hypot(imu.acc_bias, imu.acc_drift),
            bias_tau=imu.drift_tau,
            # World yaw of VQF against the truth: 0.6 to 1.4 degrees round offsets of a degree; 6
            # degrees before the first move, 2 about the mean of three cars ten seconds later.
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
        # Simulated radios lose ranges; none of those that come means nothing.
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
        noise_learning=NoiseLearningParams(learns=False),  # it is known
        # The NIS is 1 where noise is what it is believed to be.
        start=JointStartParams(respawn_nis=2.0),
    )


def can_hide(scenario: Scenario | HumanScenario) -> bool:
    """Whether something may stand between two nodes: obstacles, those of episodes, bodies."""
    if isinstance(scenario, HumanScenario):
        return True
    return bool(scenario.obstacles) or scenario.randomisation.obstacles[1] > 0


def excess_moments(channel: ChannelParams) -> tuple[float, float]:
    """Mean and standard deviation of what is added behind an obstacle [m]."""
    mu, sigma, cap = channel.excess
    z, weight = np.polynomial.hermite_e.hermegauss(64)
    excess = cap / (1.0 + np.exp(-(mu + sigma * z)))
    weight = weight / weight.sum()
    mean = float(weight @ excess)
    return mean, math.sqrt(max(float(weight @ excess**2) - mean**2, 0.0))
