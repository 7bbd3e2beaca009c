"""Arrays of the orientation stage: state and constants.

Every array of the state has the axes env and node first, so a slice of environments is a slice
of each (`OrientationState.of`). The kernels write the arrays in place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tracking.ahrs.gyro_bias import N_BIAS, N_REST, UNIT
from tracking.ahrs.lowpass import N_LOW_PASS
from tracking.ahrs.magnetometer import N_MAGNETIC
from tracking.ahrs.params import VQF_TAU_ACC, OrientationParams
from tracking.ahrs.stage import N_NODE
from tracking.ahrs.vqf import N_TILT
from tracking.arrays import F64, Bool
from tracking.constellation import Constellation
from tracking.records import Records, record_of
from tracking.sanity.imu import N_HEALTH, N_LIMIT
from tracking.vehicles import VEHICLES


class OrientationCoefficients(NamedTuple):
    """Constants derived once from `OrientationParams` and the constellation, (node, ...)."""

    dt: F64
    """Sample interval of the IMU, (node) [s]."""
    rate: F64
    """Sample rate of the IMU, (node) [Hz]."""
    mag_dt: F64
    """Sample interval of the magnetometer, (node) [s]."""
    tilt_pass: F64
    """Low pass of the specific force in the frame of the gyroscope, (node, N_LOW_PASS)."""
    rest_pass: F64
    """Low passes of the rest detection, (node, N_LOW_PASS)."""
    field_pass: F64
    """Low pass of length and dip of the field, (node, N_LOW_PASS)."""
    mag_gain: F64
    """Share of a heading error that one magnetometer reading corrects, (node)."""
    tau_mag: F64
    """Time constant of `mag_gain`, (node) [s]."""
    reference_gain: F64
    """Gain of a reading on the reference field, (node)."""
    rest: Records
    """`OrientationParams.rest`, (1)."""
    field: Records
    """`OrientationParams.magnetic`, (1)."""
    start_var: F64
    """Variance of a gyroscope's bias before any measurement, (node) [(0.01 deg/s)^2]."""
    drift_var: F64
    """Increase of a gyroscope bias variance per sample, (node) [(0.01 deg/s)^2]."""
    rest_var: F64
    """Variance of the bias measured at rest, (node) [(0.01 deg/s)^2]."""
    motion_var: F64
    """Variance of the horizontal bias measured in motion, (node) [(0.01 deg/s)^2]."""
    vertical_var: F64
    """Variance of the zero measured about the vertical in motion, (node) [(0.01 deg/s)^2]."""
    gravity_gain: F64
    """Gain of a sample at rest on the norm of gravity, (node)."""
    max_gap: F64
    """`OrientationParams.max_gap`, (node) [s]."""
    lost_after: F64
    """`OrientationParams.lost_after`, (node) [-]."""
    stamp_gain: F64
    """`OrientationParams.stamp_gain`, (node) [-]."""
    settling_samples: F64
    """Samples of `OrientationParams.settling`, (node); 0 for vehicles that stay level."""
    settling_accel: F64
    """`OrientationParams.settling_accel`, (node) [m/s2]."""
    heading: F64
    """Yaw of the body at the first sample, without magnetometer, (node) [rad]."""
    doubtful_psd: F64
    """`OrientationParams.doubtful_psd`, (node) [m/s2/sqrt(Hz)]."""
    levelled: Bool
    """True for vehicles that stay level, (node)."""
    sanity: Records
    """`OrientationParams.sanity`, (1)."""
    magnetic: Bool
    """True if the heading comes from the magnetometer, (node)."""


class OrientationState(NamedTuple):
    """State of the orientation stage; the columns are named in the kernels' modules."""

    node: F64
    """State of a node in addition to its VQF, (env, node, N_NODE)."""
    health: F64
    """Memory of `sanity.imu`, (env, node, N_HEALTH)."""
    limits: F64
    """Memory of `sanity.imu`, (env, node, N_LIMIT)."""
    tilt: F64
    """Rotations of VQF, (env, node, N_TILT)."""
    rest: F64
    """Rest detection of VQF, (env, node, N_REST)."""
    bias: F64
    """Gyroscope bias of VQF, (env, node, N_BIAS)."""
    magnetic: F64
    """Heading correction of VQF, (env, node, N_MAGNETIC)."""

    def of(self, envs: slice) -> OrientationState:
        """Return some environments, as views."""
        return OrientationState(*(array[envs] for array in self))

    def copy(self) -> OrientationState:
        """Return a copy that shares no memory."""
        return OrientationState(*(array.copy() for array in self))


def make_state(n_envs: int, n_nodes: int) -> OrientationState:
    """Allocate the state; `forget` initialises it."""
    columns = (N_NODE, N_HEALTH, N_LIMIT, N_TILT, N_REST, N_BIAS, N_MAGNETIC)
    return OrientationState(*(np.zeros((n_envs, n_nodes, n)) for n in columns))


def make_coefficients(
    constellation: Constellation, params: OrientationParams, *, follows_bias: bool = False
) -> OrientationCoefficients:
    """Derive the constants of the kernels.

    Args:
        constellation: Nodes of the group.
        params: Parameters of the stage.
        follows_bias: As `Filter.follows_bias`.
    """
    nodes = constellation.nodes
    dt = np.array([1.0 / node.imu_hz for node in nodes])
    mag_dt = np.array([1.0 / (node.mag_hz or node.imu_hz) for node in nodes])
    vehicles = [VEHICLES[node.vehicle] for node in nodes]
    with_bias = [v.ahrs_accel_tau_with_bias if follows_bias else None for v in vehicles]
    tau_acc = np.array(
        [b or v.ahrs_accel_tau or params.tau_acc for b, v in zip(with_bias, vehicles, strict=True)]
    )
    b = params.bias
    # Steady states of the bias filter, in its unit.
    drift_var = (b.drift_std / UNIT) ** 2 * dt / b.drift_time
    rest_sigma2 = (b.rest_std / UNIT) ** 2
    motion_sigma2 = (b.motion_std / UNIT) ** 2 * tau_acc / VQF_TAU_ACC
    motion_var = motion_sigma2**2 / drift_var + motion_sigma2
    return OrientationCoefficients(
        dt=dt,
        rate=np.array([node.imu_hz for node in nodes], dtype=np.float64),
        mag_dt=mag_dt,
        tilt_pass=np.array([low_pass_of(*pair) for pair in zip(tau_acc, dt, strict=True)]),
        rest_pass=np.array([low_pass_of(params.rest.tau, each) for each in dt]),
        field_pass=np.array([low_pass_of(params.magnetic.tau, each) for each in mag_dt]),
        mag_gain=1.0 - np.exp(-mag_dt / params.tau_mag),
        tau_mag=np.full(len(nodes), params.tau_mag),
        reference_gain=1.0 - np.exp(-mag_dt / params.magnetic.reference_tau),
        rest=record_of(params.rest),
        field=record_of(params.magnetic),
        start_var=np.full(len(nodes), (b.start_std / UNIT) ** 2),
        drift_var=drift_var,
        rest_var=rest_sigma2**2 / drift_var + rest_sigma2,
        motion_var=motion_var,
        vertical_var=motion_var / b.vertical_share,
        gravity_gain=dt / params.gravity_tau,
        max_gap=np.full(len(nodes), params.max_gap),
        lost_after=np.full(len(nodes), params.lost_after),
        stamp_gain=np.full(len(nodes), params.stamp_gain),
        settling_samples=np.where([v.levelled for v in vehicles], 0.0, params.settling / dt),
        settling_accel=np.full(len(nodes), params.settling_accel),
        heading=np.array([node.initial_heading or 0.0 for node in nodes]),
        doubtful_psd=np.full(len(nodes), params.doubtful_psd),
        levelled=np.array([v.levelled for v in vehicles]),
        sanity=params.sanity.as_record(),
        magnetic=np.full(len(nodes), constellation.heading == "magnetic"),
    )


def low_pass_of(tau: float, dt: float) -> F64:
    """Return the coefficients of a second-order Butterworth low pass, (N_LOW_PASS).

    The cut-off is at ``sqrt(2) / (2 pi tau)``, by the bilinear transform. Time constants shorter
    than half an interval pass everything.

    Args:
        tau: Time constant of the step response's decaying part [s].
        dt: Interval of the samples [s].
    """
    table = np.zeros(N_LOW_PASS)
    n_mean = max(1, math.floor(tau / dt) - 1)
    while n_mean * dt < tau:
        n_mean += 1
    if tau < 0.5 * dt:
        table[:] = 1.0, 0.0, 0.0, 0.0, 0.0, n_mean
        return table
    c = math.tan(dt / (math.sqrt(2.0) * tau))
    d = c * c + math.sqrt(2.0) * c + 1.0
    b0 = c * c / d
    a1, a2 = 2.0 * (c * c - 1.0) / d, (1.0 - math.sqrt(2.0) * c + c * c) / d
    table[:] = b0, 2.0 * b0, b0, a1, a2, n_mean
    return table
