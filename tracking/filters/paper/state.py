"""Arrays of the paper's filter: the state, and the constants of its kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64
from tracking.constellation import Constellation
from tracking.filters.paper.params import CHOICES, PaperParams
from tracking.records import Records, coefficients

NODE = np.dtype(
    [
        ("t_imu", "f8"),  # time of the last STATE event [s]; -inf before the first
        ("t_last_range", "f8"),  # time of the last range [s]; -inf before the first
        ("present", "?"),  # has filters
        ("static", "?"),  # constant
    ]
)
PAIR = np.dtype(
    [
        ("t", "f8"),  # time of the state [s]
        ("t_range", "f8"),  # time of the last accepted range [s]
        ("mean", "f8"),  # running average of accepted ranges [m]
        ("last", "f8"),  # last accepted range [m]
        ("rate", "f8"),  # low-passed derivative of the range [m/s]
        ("nis", "f8"),  # normalised innovation squared of the last accepted range [-]
        ("in_a_row", "i8"),  # ranges rejected since the last accepted one
        ("n_rejected", "i8"),  # ranges rejected in total
        ("first_sum", "f8"),  # sum of the first ranges of a pair without filter [m]
        ("first_n", "i8"),  # number of these ranges
        ("surveyed", "f8"),  # surveyed distance [m]; 0 for none
        ("i", "i8"),  # constant: node indices, i < j
        ("j", "i8"),
    ]
)
GROUP = np.dtype(
    [
        ("n_since_mds", "i8"),  # ranges accepted since the last MDS
        ("nis_sum", "f8"),  # sum of NIS over accepted ranges
        ("nis_n", "i8"),
    ]
)
REPLACE, UPDATE, NONE = range(3)
"""Values of `feedback`, as in `CHOICES`."""


class PaperState(NamedTuple):
    """State of the paper's filter."""

    nodes: Records
    """NODE, (env, node)."""
    accel: F64
    """World acceleration of each node, (env, node, 3) [m/s2]."""
    q: F64
    """Orientation q_wb of each node, (env, node, 4)."""
    pairs: Records
    """PAIR, (env, pair)."""
    group: Records
    """GROUP, (env, 1)."""
    x: F64
    """(x_ij, v_ij) of each pair, (env, pair, 1, 6) [m, m/s]."""
    P: F64
    """Covariance of `x`, (env, pair, 1, 6, 6)."""


class Layout(NamedTuple):
    """Tables derived once from the constellation and the parameters."""

    pair_index: I64
    """Pair index of two nodes, (node, node)."""
    first: F64
    """Positions that the first MDS is aligned to, (node, 3) [m]."""


def make_constants(constellation: Constellation, params: PaperParams) -> Records:
    """Derive the constants of the kernels, (1)."""
    return coefficients(
        [params],
        {"power": 0.5 if params.scaling == "root" else 0.25},
        d=constellation.dimensions,
        k=params.k,
        gate_reset=params.gate_reset,
        speed_is_norm=params.speed == "norm",
        feedback=CHOICES["feedback"].index(params.feedback),
        aligned=params.alignment == "procrustes",
        has_layout=params.first_layout is not None,
    )


def make_layout(constellation: Constellation, params: PaperParams) -> Layout:
    """Derive the tables of the kernels."""
    first = np.zeros((constellation.n_nodes, 3))
    if params.first_layout is not None:
        first[:] = params.first_layout
    return Layout(constellation.pair_index, first)


def make_state(constellation: Constellation, n_envs: int) -> PaperState:
    """Return the state before any measurement."""
    n, p = constellation.n_nodes, constellation.n_pairs
    nodes = np.zeros((n_envs, n), dtype=NODE)
    nodes["t_imu"] = nodes["t_last_range"] = -np.inf
    nodes["static"] = constellation.is_static
    q = np.zeros((n_envs, n, 4))
    q[..., 0] = 1.0
    pairs = np.zeros((n_envs, p), dtype=PAIR)
    pairs["i"], pairs["j"] = constellation.pairs.T
    return PaperState(
        nodes=nodes,
        accel=np.zeros((n_envs, n, 3)),
        q=q,
        pairs=pairs,
        group=np.zeros((n_envs, 1), dtype=GROUP),
        x=np.zeros((n_envs, p, 1, 6)),
        P=np.zeros((n_envs, p, 1, 6, 6)),
    )
