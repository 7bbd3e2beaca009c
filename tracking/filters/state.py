"""The arrays of the pair filters: what evolves, and what is derived once.

Three axes recur: ``env``, independent groups; ``hyp``, the bank of hypotheses about rotation
and mirror image that a group is started with, one of which survives; ``pair``. The tuples are
passed to compiled kernels, which write them in place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import WHEELED, Constellation
from tracking.filters.params import PairEkfParams

SPEED_MODELS = {"none": 0, "range-rate": 1, "speed-norm": 2}


class NodeState(NamedTuple):
    """What is known of each node, (env, node, ...)."""

    q_wb: F64
    """Orientation, (env, node, 4)."""
    accel_w: F64
    """World acceleration held since the last STATE event, (env, node, 3) [m/s2]."""
    t_state: F64
    """Time of that event [s]."""
    has_state: Bool
    """True after the first STATE event."""
    t_heard: F64
    """Time of the last range the node took part in [s]."""
    heard: Bool
    """True after the first."""
    present: Bool
    """True while the node is in the group and has filters."""


class PairState(NamedTuple):
    """The filters of each pair, and the range statistics they share, (env, pair)."""

    x: F64
    """Position and velocity, (env, hyp, pair, 6) [m, m/s]."""
    P: F64
    """Covariance, (env, hyp, pair, 6, 6)."""
    t: F64
    """Time of the state [s]."""
    t_range: F64
    """Time of the last accepted range [s]."""
    n_ranges: I64
    """Accepted ranges since the pair started."""
    n_rejected: I64
    """Ranges the gate has refused, ever."""
    in_a_row: I64
    """Ranges refused since the last accepted one."""
    nis: F64
    """NIS of the last accepted range in the best hypothesis [-]."""
    mean_distance: F64
    """Running average of accepted ranges [m]."""
    last_distance: F64
    """The last accepted range [m]."""
    rate: F64
    """Low-passed derivative of the range [m/s]."""
    start_sum: F64
    """Sum of the first ranges of a pair that has not started [m]."""
    start_n: I64
    """How many."""
    start_t: F64
    """Time of the first of them [s]."""


class BankState(NamedTuple):
    """The bank of each group, (env) or (env, hyp)."""

    alive: Bool
    """True for hypotheses still considered, (env, hyp)."""
    loglik: F64
    """Log-likelihood of the ranges, (env, hyp)."""
    best: I64
    """The hypothesis reported, (env)."""
    t_mds: F64
    """Time of the last MDS refinement, (env) [s]."""
    flat: Bool
    """True since the layout was too flat to tell its mirror image, (env)."""
    t_check: F64
    """Time of the last look at the bank, (env) [s]."""
    nis_sum: F64
    """Sum of the NIS of accepted ranges, (env)."""
    nis_n: I64
    """How many, (env)."""


class Coefficients(NamedTuple):
    """Constants derived once from the constellation and the params."""

    d: int
    pairs: I64
    pair_index: I64
    is_static: Bool
    antenna_b: F64
    rotations: F64
    """Starting rotations and mirror images, (hyp, 3, 3)."""
    use_mds: bool
    speed_model: int
    accel_psd: F64
    """Of each node, (node)."""
    unaided_psd: float
    unaided_after: float
    range_var: float
    survey_var: float
    speed_var: float
    speed_tau: float
    lost_after: float
    leave_after: float
    gate_tau: float
    gate_floor: float
    gate_speed_gain: float
    gate_min_speed: float
    gate_max_rejected: int
    mds_period: float
    mds_var: float
    mds_min_spread: float
    start_k: int
    start_max_age: float
    prune: float
    merge_distance: float
    max_nis: float
    check_period: float


def make_coefficients(
    constellation: Constellation, params: PairEkfParams, *, use_mds: bool
) -> Coefficients:
    """Derive the constants of the kernels."""
    gate, mds, start = params.gate, params.mds, params.start
    return Coefficients(
        d=constellation.dimensions,
        pairs=constellation.pairs,
        pair_index=constellation.pair_index,
        is_static=constellation.is_static,
        antenna_b=constellation.antenna_offset_b,
        rotations=starting_rotations(constellation.dimensions, start.rotations_2d),
        use_mds=use_mds,
        speed_model=SPEED_MODELS[params.speed_model],
        accel_psd=np.array(
            [
                params.wheeled_accel_psd if node.vehicle in WHEELED else params.accel_psd
                for node in constellation.nodes
            ]
        ),
        unaided_psd=params.unaided_accel_psd,
        unaided_after=params.unaided_after,
        range_var=params.range_std**2,
        survey_var=params.survey_std**2,
        speed_var=params.speed_std**2,
        speed_tau=params.speed_tau,
        lost_after=params.lost_after,
        leave_after=params.leave_after,
        gate_tau=gate.tau,
        gate_floor=gate.floor,
        gate_speed_gain=gate.speed_gain,
        gate_min_speed=gate.min_speed,
        gate_max_rejected=gate.max_rejected,
        mds_period=mds.period,
        mds_var=mds.std**2,
        mds_min_spread=mds.min_spread,
        start_k=start.k,
        start_max_age=start.max_age,
        prune=start.prune,
        merge_distance=start.merge_distance,
        max_nis=start.max_nis,
        check_period=start.check_period,
    )


def starting_rotations(dimensions: int, n_planar: int) -> F64:
    """Rotations and mirror images that no layout is far from, (hyp, 3, 3).

    In the plane, evenly spaced; in space, the 24 rotations of a cube, of which every rotation
    is within 63 degrees of one.
    """
    if dimensions == 2:
        angles = 2.0 * np.pi * np.arange(n_planar) / n_planar
        turns = np.zeros((n_planar, 3, 3))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
        turns[:, 1, 0] = np.sin(angles)
        turns[:, 0, 1] = -np.sin(angles)
        turns[:, 2, 2] = 1.0
        mirror = np.diag([1.0, -1.0, 1.0])
    else:
        signed = [
            np.eye(3)[list(order)] * np.array(signs)[:, None]
            for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
            for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).reshape(3, 8).T
        ]
        turns = np.array([R for R in signed if np.linalg.det(R) > 0.0])
        mirror = np.diag([1.0, 1.0, -1.0])
    return np.concatenate([turns, turns @ mirror])


def make_state(
    constellation: Constellation, n_envs: int, n_hyps: int
) -> tuple[NodeState, PairState, BankState]:
    """The state before any measurement."""
    n, p = constellation.n_nodes, constellation.n_pairs
    q_wb = np.zeros((n_envs, n, 4))
    q_wb[..., 0] = 1.0

    def floats(*shape: int) -> F64:
        return np.zeros((n_envs, *shape))

    def ints(*shape: int) -> I64:
        return np.zeros((n_envs, *shape), dtype=np.int64)

    def bools(*shape: int) -> Bool:
        return np.zeros((n_envs, *shape), dtype=bool)

    nodes = NodeState(q_wb, floats(n, 3), floats(n), bools(n), floats(n), bools(n), bools(n))
    pairs = PairState(
        x=floats(n_hyps, p, 6),
        P=floats(n_hyps, p, 6, 6),
        t=floats(p),
        t_range=floats(p),
        n_ranges=ints(p),
        n_rejected=ints(p),
        in_a_row=ints(p),
        nis=floats(p),
        mean_distance=floats(p),
        last_distance=floats(p),
        rate=floats(p),
        start_sum=floats(p),
        start_n=ints(p),
        start_t=floats(p),
    )
    bank = BankState(
        bools(n_hyps), floats(n_hyps), ints(), floats(), bools(), floats(), floats(), ints()
    )
    return nodes, pairs, bank
