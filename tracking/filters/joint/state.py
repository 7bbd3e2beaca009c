"""Arrays of the joint filter: the state that evolves, and tables derived once.

One state vector holds all nodes of a group, in one world frame:

    node           position (d) [m]; velocity (d) [m/s] of moving nodes
    moving node    acceleration bias (d) [m/s2]; heading error [rad]; in space, if it rotates about
                   all axes, accelerometer offset [m/s2] and gyroscope bias [rad/s], body frame (3)
    pair           fast and slow part of its range error [m], in small groups

in this order: positions and velocities of all nodes, then states that decay. ``d`` is 2 or 3. The
states of nodes that are not in the group are decoupled, with unit variance. Axes: ``env``,
independent groups; ``hyp``, the bank of hypotheses about rotation and mirror image.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64, Bool, aligned
from tracking.constellation import Constellation
from tracking.filters.joint.coefficients import (
    count_motion,
    count_rows,
    has_mount,
    has_offset,
    has_range_errors,
    make_coefficients,
    moving_pairs,
)
from tracking.filters.joint.ekf.columns import N_PRE
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.records import GROUP, NODE, PAIR
from tracking.kernels.jit import kernel
from tracking.maths.starting_rotations import starting_rotations
from tracking.records import Records


class JointState(NamedTuple):
    """State of the filter: all that evolves."""

    nodes: Records
    """NODE, (env, node)."""
    last_attitude_accel: F64
    """q_wb and accel_w [m/s2] of the last STATE event, the acceleration levelled for level
    vehicles, (env, node, 7)."""
    preintegrated: F64
    """Preintegrated samples since the states' time, (env, node, N_PRE), see `ekf.columns`."""
    pairs: Records
    """PAIR, (env, pair)."""
    group: Records
    """GROUP, (env, 1)."""
    x: F64
    """States, (env, hyp, state)."""
    P: F64
    """Covariance, (env, hyp, state, state), before pending updates are applied."""
    pending_updates: F64
    """Pending updates W; the covariance is ``P - W^T W``, (env, hyp, update, state)."""
    n_pending: I64
    """Number of pending updates, (env, hyp)."""
    accumulated_correction: F64
    """Sum of corrections since the last shift of the null space, (env, hyp, state)."""
    nlos: F64
    """Probability of NLOS of a pair, (env, hyp, pair)."""
    bias_retention: F64
    """Share of the slow range error of a pair that is kept since the states' time; the next
    propagation removes the rest, (env, hyp, pair)."""
    alive: Bool
    """True for hypotheses in use, (env, hyp)."""
    loglik: F64
    """Log-likelihood of the measurements, (env, hyp)."""
    sensitivity: F64
    """In space, while the rotation of the group is unknown (`alignment_sensitivity`): derivatives
    of the states by the elements of the rotation, (env, hyp, 9, state); so are the next three."""
    alignment_score: F64
    """Derivatives of the log-likelihood by these elements, (env, hyp, 9)."""
    alignment_information: F64
    """Negative second derivatives of the log-likelihood by these elements, (env, hyp, 9, 9)."""
    alignment_cov: F64
    """Covariance of these elements, (env, hyp, 9, 9)."""


@kernel
def one_env(state: JointState, e: int) -> JointState:
    """Return the state of environment e; shares its memory."""
    return JointState(
        state.nodes[e],
        state.last_attitude_accel[e],
        state.preintegrated[e],
        state.pairs[e],
        state.group[e],
        state.x[e],
        state.P[e],
        state.pending_updates[e],
        state.n_pending[e],
        state.accumulated_correction[e],
        state.nlos[e],
        state.bias_retention[e],
        state.alive[e],
        state.loglik[e],
        state.sensitivity[e],
        state.alignment_score[e],
        state.alignment_information[e],
        state.alignment_cov[e],
    )


class Layout(NamedTuple):
    """Tables derived once from the constellation."""

    pair_index: I64
    """Pair of two nodes, (node, node)."""
    antenna_b: F64
    """Antenna positions in the body, (antenna, 3) [m]."""
    rotations: F64
    """Starting rotations and mirror images, (hyp, 3, 3)."""


def make_layout(constellation: Constellation, params: JointParams) -> Layout:
    """Return the tables of the kernels."""
    rotations = starting_rotations(constellation.dimensions, params.start.rotations_2d)
    return Layout(constellation.pair_index, constellation.antenna_offset_b, rotations)


def room_to_wait(n_states: int) -> int:
    """Return how many updates may be pending: 0 if the covariance fits the nearest cache.

    Otherwise the ranges of six nodes: room for more takes memory and saves no time.
    """
    return 16 if n_states > 48 else 0


def open_elements(dimensions: int) -> int:
    """Return the number of elements of the unknown rotation; 0 in the plane, which has a bank."""
    return 9 if dimensions == 3 else 0


def make_state(
    constellation: Constellation, params: JointParams, n_envs: int, n_hyps: int
) -> JointState:
    """Return the state before any measurement."""
    n, p, d = constellation.n_nodes, constellation.n_pairs, constellation.dimensions
    n_states = count_rows(constellation, params)
    nodes = np.zeros((n_envs, n), dtype=NODE)
    at, fades = 0, count_motion(constellation)
    for k, node in enumerate(constellation.nodes):
        carrier = params.vehicles[node.vehicle]
        static = node.kind == "static"
        initial, offset = constellation.heading == "initial", has_offset(constellation, params, k)
        heading_std = params.initial_heading_std if initial else carrier.heading_std
        ahead, ahead_std, slip, slip_std = node.mount.prior(carrier)
        mount = has_mount(constellation, params, k)
        first_heading_std = heading_std if initial else carrier.first_heading_std or heading_std
        constants = {
            "static": static,
            "levelled": carrier.levelled,
            "rests": carrier.rests,
            "psd2": carrier.accel_psd**2,
            "impact_threshold": carrier.impact_threshold or np.inf,
            "impact_noise_ratio": carrier.impact_noise_ratio,
            "bias_var": carrier.bias_std**2,
            "bias_tau": carrier.bias_tau,
            "bias_tau_with_ahrs_feedback": carrier.bias_tau_with_ahrs_feedback,
            "first_gyro_var": carrier.gyro_std**2,
            "gyro_drift2": carrier.gyro_drift**2,
            "by_gyroscope": initial,
            "vertical_bias_var": carrier.vertical_bias_std**2,
            "vertical_bias_tau": carrier.vertical_bias_tau,
            "initial_tilt_speed2": carrier.initial_tilt_speed**2,
            "offset_var": (carrier.offset_std or 0.0) ** 2,
            "offset_tau": carrier.offset_tau,
            "heading_var": heading_std**2,
            "first_heading_var": first_heading_std**2,
            "heading_tau": params.initial_heading_tau if initial else carrier.heading_tau,
            "speed_var": carrier.speed_std**2,
            "sideways_var": (carrier.sideways_std or 0.0) ** 2,
            "ahead": ahead,
            "ahead_var": ahead_std**2,
            "slip": slip,
            "slip_var": slip_std**2,
            "aside": node.mount.aside,
            "accuracy": params.accuracy or carrier.accuracy,
            "i_pos": at,
            "i_vel": -1 if static else at + d,
            "i_tilt_bias": -1 if static else fades,
            "i_acc_bias": fades + d if offset else -1,
            "i_heading": -1 if static else fades + d + 3 * offset,
            "i_gyro_bias": fades + d + 4 if offset else -1,
            "i_mount": fades + d + 1 if mount else -1,
        }
        for name, value in constants.items():
            nodes[name][:, k] = value
        at += d if static else 2 * d
        fades += 0 if static else d + 1 + 6 * offset + 2 * mount
    pairs = np.zeros((n_envs, p), dtype=PAIR)
    pairs["i"], pairs["j"] = constellation.pairs.T
    pairs["i_range_error"] = -1
    if has_range_errors(constellation, params):
        for pair in np.nonzero(moving_pairs(constellation))[0]:
            pairs["i_range_error"][:, pair] = fades
            fades += 2
    group = np.zeros((n_envs, 1), dtype=GROUP)
    group["white_var"] = make_coefficients(constellation, params)["white_var"]
    held = np.zeros((n_envs, n, 7))
    held[..., 0] = 1.0
    P = aligned(n_envs, n_hyps, n_states, n_states)  # noqa: N806
    P[..., np.arange(n_states), np.arange(n_states)] = 1.0
    return JointState(
        nodes=nodes,
        last_attitude_accel=held,
        preintegrated=np.zeros((n_envs, n, N_PRE)),
        pairs=pairs,
        group=group,
        x=aligned(n_envs, n_hyps, n_states),
        P=P,
        pending_updates=aligned(n_envs, n_hyps, room_to_wait(n_states), n_states),
        n_pending=np.zeros((n_envs, n_hyps), dtype=np.int64),
        accumulated_correction=aligned(n_envs, n_hyps, n_states),
        nlos=np.zeros((n_envs, n_hyps, p)),
        bias_retention=np.ones((n_envs, n_hyps, p)),
        alive=np.zeros((n_envs, n_hyps), dtype=bool),
        loglik=np.zeros((n_envs, n_hyps)),
        sensitivity=np.zeros((n_envs, n_hyps, open_elements(d), n_states)),
        alignment_score=np.zeros((n_envs, n_hyps, open_elements(d))),
        alignment_information=np.zeros((n_envs, n_hyps, open_elements(d), open_elements(d))),
        alignment_cov=np.zeros((n_envs, n_hyps, open_elements(d), open_elements(d))),
    )
