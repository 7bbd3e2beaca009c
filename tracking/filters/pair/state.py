"""Arrays of the pair filters: the state, and tables that are derived once.

Three axes recur: ``env``, independent groups; ``hyp``, the bank of hypotheses about rotation
and reflection that a group starts with, one of which survives; ``pair``. Numbers that belong
together are one record, so that kernels get few arguments. Kernels write the arrays in place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.filters.pair.params import PairEkfParams
from tracking.maths.starting_rotations import starting_rotations
from tracking.records import Records, coefficients
from tracking.vehicles import VEHICLES

NODE = np.dtype(
    [
        ("t_state", "f8"),  # time of the last STATE event [s]
        ("t_last_range", "f8"),  # time of the last range it took part in [s]
        ("has_state", "?"),  # after the first STATE event
        ("seen", "?"),  # after the first range
        ("present", "?"),  # in the group, with filters
        ("static", "?"),  # constant: never moves
        ("levelled", "?"),  # constant: its vehicle stays level
        ("yaw", "f8"),  # of the body [rad]
        ("yaw_rate", "f8"),  # low-passed [rad/s]
        ("t_sum", "f8"),  # time up to which its acceleration is integrated in dv0, dv1 [s]
        ("accel_noise", "f8"),  # additional noise density of its last sample [m/s2/sqrt(Hz)]
        ("psd", "f8"),  # constant: acceleration noise with an IMU [m/s2/sqrt(Hz)]
        ("sideways_var", "f8"),  # constant: of its rear axle's velocity [m2/s2]; 0 if it may slide
        ("ahead", "f8"),  # constants of its mount: means and variances
        ("ahead_var", "f8"),
        ("slip", "f8"),
        ("slip_var", "f8"),
        ("aside", "f8"),
    ]
)
PAIR = np.dtype(
    [
        ("t", "f8"),  # time of the state [s]
        ("t_range", "f8"),  # time of the last accepted range [s]
        ("nis", "f8"),  # NIS of that range in the best hypothesis [-]
        ("mean_distance", "f8"),  # running average of accepted ranges [m]
        ("start_r", "f8", (8,)),  # ring buffer of the newest ranges before the start [m]
        ("start_t", "f8", (8,)),  # times of these ranges [s]
        ("start_n", "i8"),  # number of ranges collected
        ("t_start", "f8"),  # time of the first of them [s]
        ("surveyed", "f8"),  # surveyed distance [m]; 0 for none
        ("t_used", "f8"),  # time of the last accepted range that was no outlier [s]
        ("interval", "f8"),  # running mean of the time between two ranges [s]
        ("n_ranges", "i8"),  # accepted ranges since the pair started
        ("n_rejected", "i8"),  # ranges rejected by the gate in total
        ("in_a_row", "i8"),  # ranges rejected since the last accepted one
        ("i", "i8"),  # constant: node indices, i < j
        ("j", "i8"),
    ]
)
GROUP = np.dtype(
    [
        ("started", "?"),
        ("flat", "?"),  # the layout was degenerate: its reflection was not observable
        ("n_alive", "i8"),  # number of hypotheses left
        ("best", "i8"),  # the hypothesis reported
        ("undecided", "?"),  # no hypothesis has been the likeliest yet
        ("t_mds", "f8"),  # time of the last refinement [s]
        ("t_wheels", "f8"),  # time of the last update with motion constraints [s]
        ("dv0", "f8"),  # accelerations integrated since then, sum over nodes [m/s]
        ("dv1", "f8"),
        ("misfit", "f8"),  # running mean of NIS [-]
        ("t_check", "f8"),  # time of the last check of the bank [s]
        ("nis_sum", "f8"),  # sum of NIS over accepted ranges, in the best hypothesis
        ("nis_n", "i8"),
    ]
)


class FilterState(NamedTuple):
    """State of the pair filters."""

    nodes: Records
    """NODE, (env, node)."""
    held: F64
    """q_wb and accel_w [m/s2] of the last STATE event, (env, node, 7)."""
    pairs: Records
    """PAIR, (env, pair)."""
    group: Records
    """GROUP, (env, 1)."""
    x: F64
    """Position [m], velocity [m/s] and range error [m], (env, pair, hyp, 7)."""
    P: F64
    """Covariance, (env, pair, hyp, 7, 7)."""
    alive: Bool
    """True for hypotheses that are left, (env, hyp)."""
    loglik: F64
    """Log-likelihood of the ranges and motion constraints, (env, hyp)."""
    nlos: F64
    """NLOS probability of a pair, (env, pair, hyp)."""
    mean_v: F64
    """Mean velocity of the group, horizontal, (env, hyp, 2) [m/s]."""
    mean_cov: F64
    """Covariance of `mean_v`, (env, hyp, 2, 2) [m2/s2]."""


class Layout(NamedTuple):
    """Tables derived once from the constellation."""

    pair_index: I64
    """Pair index of two nodes, (node, node)."""
    antenna_b: F64
    """Antenna positions in the body, (antenna, 3) [m]."""
    rotations: F64
    """Starting rotations and mirror images, (hyp, 3, 3)."""


def make_coefficients(
    constellation: Constellation, params: PairEkfParams, *, use_mds: bool
) -> Records:
    """Derive the constants of the kernels, (1)."""
    rows = 2 * constellation.dimensions * (constellation.n_nodes - 1)
    e, v, w, start = params.range_error, params.nlos, params.wheels, params.start
    derived = {
        "range_var": e.white_std**2,
        "slow_var": e.slow_std**2,
        "nlos_bias_var": v.nlos_bias_std**2,
        "nlos_white_var": v.white_std**2,
        "survey_var": params.survey_std**2,
        "group_speed_var": w.group_speed_std**2,
        "wheel_period": w.period,
        **{f"gate_{k}": getattr(params.gate, k) for k in params.gate.__slots__},
        # A refinement costs the cube of the group size: the period keeps its share of the time.
        "mds_period": params.mds.period * max(1.0, (rows / 30.0) ** 2),
        "mds_min_spread": params.mds.min_spread,
        "start_k": start.k,
        "start_max_age": start.max_age,
    }
    return coefficients(
        (e, v, w, start, params), derived, d=constellation.dimensions, use_mds=int(use_mds)
    )


def make_layout(constellation: Constellation, params: PairEkfParams) -> Layout:
    """Derive the tables of the kernels."""
    rotations = starting_rotations(constellation.dimensions, params.start.rotations_2d)
    return Layout(constellation.pair_index, constellation.antenna_offset_b, rotations)


def make_state(
    constellation: Constellation, params: PairEkfParams, n_envs: int, n_hyps: int
) -> FilterState:
    """Return the state before any measurement."""
    n, p = constellation.n_nodes, constellation.n_pairs
    nodes = np.zeros((n_envs, n), dtype=NODE)
    nodes["static"] = constellation.is_static
    vehicles = [VEHICLES[node.vehicle] for node in constellation.nodes]
    nodes["psd"] = [
        0.0 if node.kind == "static" else vehicle.pair_accel_psd
        for node, vehicle in zip(constellation.nodes, vehicles, strict=True)
    ]
    nodes["levelled"] = [vehicle.levelled for vehicle in vehicles]
    rolls = [
        vehicle.sideways_std is not None and node.kind == "moving"
        for node, vehicle in zip(constellation.nodes, vehicles, strict=True)
    ]
    nodes["sideways_var"] = np.where(rolls, params.wheels.std**2, 0.0)
    priors = [n.mount.prior(v) for n, v in zip(constellation.nodes, vehicles, strict=True)]
    ahead, ahead_std, slip, slip_std = np.array(priors).T
    nodes["ahead"], nodes["ahead_var"] = ahead, ahead_std**2
    nodes["slip"], nodes["slip_var"] = slip, slip_std**2
    nodes["aside"] = [node.mount.aside for node in constellation.nodes]
    held = np.zeros((n_envs, n, 7))
    held[..., 0] = 1.0
    pairs = np.zeros((n_envs, p), dtype=PAIR)
    pairs["i"], pairs["j"] = constellation.pairs.T
    return FilterState(
        nodes=nodes,
        held=held,
        pairs=pairs,
        group=np.zeros((n_envs, 1), dtype=GROUP),
        x=np.zeros((n_envs, p, n_hyps, 7)),
        P=np.zeros((n_envs, p, n_hyps, 7, 7)),
        alive=np.zeros((n_envs, n_hyps), dtype=bool),
        loglik=np.zeros((n_envs, n_hyps)),
        nlos=np.zeros((n_envs, p, n_hyps)),
        mean_v=np.zeros((n_envs, n_hyps, 2)),
        mean_cov=np.zeros((n_envs, n_hyps, 2, 2)),
    )
