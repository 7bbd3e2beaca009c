"""The arrays of the joint filter: what evolves, and what is derived once.

One state vector holds all nodes of a group, in one world frame:

    moving node    position (d) [m], velocity (d) [m/s], acceleration bias (d) [m/s2],
                   heading error [rad]
    static node    position (d) [m]
    pair           fast and slow part of its range error [m], in small groups

``d`` is 2 or 3. The states of nodes that are not in the group are decoupled, with unit
variance. Axes: ``env``, independent groups; ``hyp``, the bank of hypotheses about rotation and
mirror image.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import config
from numpy.typing import NDArray

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.filters.joint.params import JointParams
from tracking.filters.rotations import starting_rotations

N_PRE = 12
"""Columns of `JointState.pre`."""

NODE = np.dtype(
    [
        ("t_pre", "f8"),  # time up to which the inertial samples are summed [s]
        ("t_state", "f8"),  # time of the last STATE event [s]
        ("t_heard", "f8"),  # time of the last range it took part in [s]
        ("yaw", "f8"),  # of the last STATE event, as measured [rad]
        ("yaw_rate", "f8"),  # [rad/s]
        ("accel_mean", "f8"),  # running mean of |accel| [m/s2]
        ("accel_var", "f8"),  # running mean square of accel about its mean [m2/s4]
        ("turning", "f8"),  # running mean of the angular rate [rad/s]
        ("t_moved", "f8"),  # last time it was not at rest [s]
        ("has_state", "?"),
        ("heard", "?"),
        ("present", "?"),
        ("static", "?"),  # constant from here on
        ("levelled", "?"),
        ("rests", "?"),
        ("psd2", "f8"),
        ("turn_psd2", "f8"),
        ("bias_var", "f8"),
        ("bias_tau", "f8"),
        ("heading_var", "f8"),
        ("heading_tau", "f8"),
        ("speed_var", "f8"),
        ("sideways_var", "f8"),  # 0 for what may move sideways
        ("rear_axle", "f8"),
        ("at_p", "i8"),  # first state of its position
        ("at_v", "i8"),  # of its velocity; -1 for static nodes, like the next two
        ("at_b", "i8"),
        ("at_h", "i8"),
    ]
)
PAIR = np.dtype(
    [
        ("t_range", "f8"),  # time of the last range that counted [s]
        ("nis", "f8"),  # NIS of the last range in the best hypothesis [-]
        ("misfit", "f8"),  # running mean of it [-]
        ("start_sum", "f8"),  # sum of the first ranges of a pair not started [m]
        ("start_t", "f8"),  # time of the first of them [s]
        ("start_n", "i8"),  # how many
        ("n_ranges", "i8"),
        ("n_rejected", "i8"),  # ranges that hardly counted
        ("i", "i8"),  # constant: node indices, i < j
        ("j", "i8"),
        ("at_e", "i8"),  # constant: first state of its range error, -1 for none
    ]
)
GROUP = np.dtype(
    [
        ("started", "?"),
        ("flat", "?"),  # the layout was too flat to tell its mirror image
        ("n_alive", "i8"),
        ("best", "i8"),
        ("t", "f8"),  # time of the states [s]
        ("t_check", "f8"),
        ("t_carrier", "f8"),
        ("t_gauge", "f8"),
        ("misfit", "f8"),  # running mean of the NIS of ranges in the best hypothesis [-]
        ("fit", "f8"),  # running share of ranges that fit [-]
        ("nis_sum", "f8"),
        ("nis_n", "i8"),
    ]
)
_NUMBERS = (
    "bend_gain",
    "white_var",
    "fast_var",
    "fast_length",
    "slow_var",
    "slow_length",
    "enter_rate",
    "leave_rate",
    "excess",
    "excess_var",
    "excess_length",
    "excess_white_var",
    "gap_los",
    "gap_los_std",
    "gap_nlos",
    "gap_nlos_std",
    "gap_weight",
    "outlier_prob",
    "outlier_span",
    "start_k",
    "start_max_age",
    "rotation_var",
    "position_var",
    "start_speed_var",
    "prune",
    "merge_distance",
    "max_nis",
    "check_period",
    "unaided_psd2",
    "unaided_after",
    "static_drift2",
    "survey_var",
    "rest_accel",
    "rest_rate",
    "rest_after",
    "rest_var",
    "carrier_period",
    "lost_after",
    "leave_after",
    "ok_var",
    "doubt",
    "evidence",
)
COEFFICIENTS = np.dtype([("d", "i8"), ("n", "i8"), *((name, "f8") for name in _NUMBERS)])
"""Constants derived once from `JointParams`, under the same names; ``_var`` and ``2``: squared."""

Records = NDArray[Any]


class JointState(NamedTuple):
    """Everything that evolves."""

    nodes: Records
    """NODE, (env, node)."""
    held: F64
    """q_wb and accel_w [m/s2] of the last STATE event, the acceleration levelled where the
    carrier stays level, (env, node, 7)."""
    pre: F64
    """Sums over inertial samples since the states' time, (env, node, N_PRE): time [s]; velocity
    and way that they add [m/s, m]; cosine and sine that turn a bias, summed once and twice;
    square of the acceleration [m2/s3]."""
    pairs: Records
    """PAIR, (env, pair)."""
    group: Records
    """GROUP, (env, 1)."""
    x: F64
    """States, (env, hyp, state)."""
    P: F64
    """Covariance, (env, hyp, state, state)."""
    nlos: F64
    """Probability that a pair has no line of sight, (env, hyp, pair)."""
    alive: Bool
    """True for hypotheses still considered, (env, hyp)."""
    loglik: F64
    """Log-likelihood of the measurements, (env, hyp)."""


class Layout(NamedTuple):
    """Tables derived once from the constellation."""

    pair_index: I64
    """(node, node)"""
    antenna_b: F64
    """(antenna, 3) [m]"""
    rotations: F64
    """Starting rotations and mirror images, (hyp, 3, 3)."""


def as_records(array: Records) -> Records:
    """An array of records whose fields the interpreter, too, finds under their names."""
    return array.view(np.recarray) if config.DISABLE_JIT else array


def make_coefficients(constellation: Constellation, params: JointParams) -> Records:
    """Derive the constants of the kernels, (1)."""
    e, v, s = params.range_error, params.nlos, params.start
    has_states = constellation.n_nodes <= e.max_nodes
    white_var = e.white_std**2
    if not has_states:
        # What lasts counts as white noise of the same weight over a second of driving.
        white_var += 10.0 * (e.fast_std**2 + e.slow_std**2)
    values = {
        "white_var": white_var,
        "fast_var": e.fast_std**2,
        "slow_var": e.slow_std**2,
        "excess_var": v.excess_std**2,
        # Errors that last and have no state make successive ranges say the same thing.
        "evidence": 1.0 if has_states else 0.1,
        "excess_white_var": v.white_std**2 if has_states else v.repeats * v.excess_std**2,
        "start_k": s.k,
        "start_max_age": s.max_age,
        "rotation_var": (0.4 if constellation.dimensions == 3 else 2.4 / s.rotations_2d) ** 2,
        "position_var": s.position_std**2,
        "start_speed_var": s.speed_std**2,
        "unaided_psd2": params.unaided_accel_psd**2,
        "static_drift2": params.static_drift**2,
        "survey_var": params.survey_std**2,
        "rest_var": params.rest_std**2,
        "ok_var": params.ok_std**2,
    }
    c = np.zeros(1, dtype=COEFFICIENTS)
    c["d"] = constellation.dimensions
    c["n"] = count_states(constellation, params)
    for name in _NUMBERS:
        sources = [p for p in (e, v, s, params) if hasattr(p, name)]
        c[name] = values[name] if name in values else getattr(sources[0], name)
    return c


def count_states(constellation: Constellation, params: JointParams) -> int:
    """Length of the state vector."""
    d = constellation.dimensions
    n = sum(d if static else 3 * d + 1 for static in constellation.is_static)
    if constellation.n_nodes <= params.range_error.max_nodes:
        moving = ~constellation.is_static[constellation.pairs].all(axis=1)
        n += 2 * int(moving.sum())
    return n


def make_layout(constellation: Constellation, params: JointParams) -> Layout:
    """Derive the tables of the kernels."""
    rotations = starting_rotations(constellation.dimensions, params.start.rotations_2d)
    return Layout(constellation.pair_index, constellation.antenna_offset_b, rotations)


def make_state(
    constellation: Constellation, params: JointParams, n_envs: int, n_hyps: int
) -> JointState:
    """The state before any measurement."""
    n, p, d = constellation.n_nodes, constellation.n_pairs, constellation.dimensions
    n_states = count_states(constellation, params)
    nodes = np.zeros((n_envs, n), dtype=NODE)
    at = 0
    for k, node in enumerate(constellation.nodes):
        carrier = params.carriers[node.vehicle]
        static = node.kind == "static"
        initial = constellation.heading == "initial"
        heading_std = params.initial_heading_std if initial else carrier.heading_std
        constants = {
            "static": static,
            "levelled": carrier.levelled,
            "rests": carrier.rests,
            "psd2": carrier.accel_psd**2,
            "turn_psd2": carrier.turn_psd**2,
            "bias_var": carrier.bias_std**2,
            "bias_tau": carrier.bias_tau,
            "heading_var": heading_std**2,
            "heading_tau": params.initial_heading_tau if initial else carrier.heading_tau,
            "speed_var": carrier.speed_std**2,
            "sideways_var": (carrier.sideways_std or 0.0) ** 2,
            "rear_axle": carrier.rear_axle,
            "at_p": at,
            "at_v": -1 if static else at + d,
            "at_b": -1 if static else at + 2 * d,
            "at_h": -1 if static else at + 3 * d,
        }
        for name, value in constants.items():
            nodes[name][:, k] = value
        at += d if static else 3 * d + 1
    pairs = np.zeros((n_envs, p), dtype=PAIR)
    pairs["i"], pairs["j"] = constellation.pairs.T
    pairs["at_e"] = -1
    if n <= params.range_error.max_nodes:
        for pair in np.nonzero(~constellation.is_static[constellation.pairs].all(axis=1))[0]:
            pairs["at_e"][:, pair] = at
            at += 2
    held = np.zeros((n_envs, n, 7))
    held[..., 0] = 1.0
    P = np.zeros((n_envs, n_hyps, n_states, n_states))  # noqa: N806
    P[..., np.arange(n_states), np.arange(n_states)] = 1.0
    return JointState(
        nodes=nodes,
        held=held,
        pre=np.zeros((n_envs, n, N_PRE)),
        pairs=pairs,
        group=np.zeros((n_envs, 1), dtype=GROUP),
        x=np.zeros((n_envs, n_hyps, n_states)),
        P=P,
        nlos=np.zeros((n_envs, n_hyps, p)),
        alive=np.zeros((n_envs, n_hyps), dtype=bool),
        loglik=np.zeros((n_envs, n_hyps)),
    )
