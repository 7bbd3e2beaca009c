"""The arrays of the joint filter: what evolves, and what is derived once.

One state vector holds all nodes of a group, in one world frame:

    node           position (d) [m]; velocity (d) [m/s] of those that move
    moving node    acceleration bias (d) [m/s2]; in space, where it is turned about, offset of its
                   accelerometer, body frame (3) [m/s2]; heading error [rad]
    pair           fast and slow part of its range error [m], in small groups

in this order: what moves of all nodes, then what only fades. ``d`` is 2 or 3. The states of nodes
that are not in the group are decoupled, with unit variance. Axes: ``env``, independent groups;
``hyp``, the bank of hypotheses about rotation and mirror image.
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
    """Everything that evolves."""

    nodes: Records
    """NODE, (env, node)."""
    last_attitude_accel: F64
    """q_wb and accel_w [m/s2] of the last STATE event, the acceleration levelled where the
    carrier stays level, (env, node, 7)."""
    preintegrated: F64
    """Sums over inertial samples since the states' time, (env, node, N_PRE), see `ekf.columns`."""
    pairs: Records
    """PAIR, (env, pair)."""
    group: Records
    """GROUP, (env, 1)."""
    x: F64
    """States, (env, hyp, state)."""
    P: F64
    """Covariance, (env, hyp, state, state), before pending updates are applied."""
    pending_updates: F64
    """Corrections that wait, ``P - W^T W`` is the covariance, (env, hyp, correction, state)."""
    n_pending: I64
    """How many do, (env, hyp)."""
    accumulated_correction: F64
    """How far measurements moved the states since P last followed, (env, hyp, state)."""
    nlos: F64
    """Probability that a pair has no line of sight, (env, hyp, pair)."""
    bias_retention: F64
    """How much of the slow range error of a pair is still what it was at the states' time; the
    rest is forgotten when they are carried on, (env, hyp, pair)."""
    alive: Bool
    """True for hypotheses still considered, (env, hyp)."""
    loglik: F64
    """Log-likelihood of the measurements, (env, hyp)."""
    sensitivity: F64
    """In space, while the rotation of the group is unknown (`alignment_sensitivity`): derivatives
    of the states by the elements of the turn, (env, hyp, 9, state); the next three as well."""
    alignment_score: F64
    """Derivatives of the log-likelihood by them, (env, hyp, 9)."""
    alignment_information: F64
    """Its negative second derivatives, (env, hyp, 9, 9)."""
    alignment_cov: F64
    """How uncertain the elements are, each by itself, (env, hyp, 9, 9)."""


@kernel
def one_env(state: JointState, e: int) -> JointState:
    """The state of environment e; shares its memory."""
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
    """(node, node)"""
    antenna_b: F64
    """(antenna, 3) [m]"""
    rotations: F64
    """Starting rotations and mirror images, (hyp, 3, 3)."""


def make_layout(constellation: Constellation, params: JointParams) -> Layout:
    """Derive the tables of the kernels."""
    rotations = starting_rotations(constellation.dimensions, params.start.rotations_2d)
    return Layout(constellation.pair_index, constellation.antenna_offset_b, rotations)


def room_to_wait(n_states: int) -> int:
    """How many corrections may wait: none where the covariance fits the nearest cache.

    Room for a round of six nodes and what is known of their carriers.
    """
    return 24 if n_states > 48 else 0


def open_elements(dimensions: int) -> int:
    """Elements of the turn of a group: in the plane a bank of turns is followed instead."""
    return 9 if dimensions == 3 else 0


def make_state(
    constellation: Constellation, params: JointParams, n_envs: int, n_hyps: int
) -> JointState:
    """The state before any measurement."""
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
            "accuracy": 0.0 if static else params.accuracy or carrier.accuracy,
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
