"""Workspace: intermediate results of the joint filter's kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64, I64, aligned
from tracking.filters.joint.ekf.columns import N_PRE, N_STEP
from tracking.filters.joint.state import room_to_wait
from tracking.maths.covariance import ROOM, STATES

# Rare actions, compiled apart (`rare`), in the order in which a range needs them:
(
    NOTHING, TIME_OUT, SPAWN, STALE, SUPERVISED, TIME_OUT_LATER, MODES_STEP, SPLIT, REFLECT,
    CHALLENGE, REINITIALISE, START, JOIN, JOIN_OTHER, REMOVE,
) = range(15)  # fmt: skip

ENV, EVENT, OUT, DONE, NODE, FLAG = range(6)
"""Elements of `Workspace.cursor`."""


class Workspace(NamedTuple):
    """Arrays for intermediate results, so that most events allocate nothing."""

    cursor: I64
    """State of the loop over events: environment, event, estimate, last action of the event; its
    node and a flag of it (6)."""

    idx: I64
    """States of a measurement."""
    val: F64
    """Derivatives of a measurement by these states."""
    w: F64
    """``P H`` of a measurement, (state)."""
    share: F64
    """Weight of each pending update in a measurement, (update)."""
    scale: F64
    """Share of each state's error that stays in a step, (state)."""
    step: F64
    """The last step of each node, (node, N_STEP), see `columns`."""
    derivatives: F64
    """Derivatives of position and velocity by the other states of a node, see `covariance`."""
    speed: F64
    """Speed of each node, (node) [m/s]."""
    x: F64
    """States of an estimate, (1, state)."""
    P: F64
    """Covariance of an estimate, (1, state, state)."""
    preintegrated: F64
    """Preintegrated samples of an estimate, (node, N_PRE)."""
    t_pre: F64
    """Preintegration time of each node, saved during an estimate, (node) [s]."""
    nlos: F64
    """NLOS probabilities of an estimate, (1, pair)."""
    bias_retention: F64
    """Retained shares of slow range errors of an estimate, (1, pair)."""
    none_waiting: I64
    """Number of pending updates of an estimate: zero, (1)."""
    gradient: F64
    """Derivatives of an innovation by the unknown rotation, (9)."""
    direct: F64
    """Derivatives of a prediction by the unknown rotation with the states held, (9)."""
    turns: F64
    """``A``, ``P A`` and ``G`` of `observability.shift_nullspace`, (3, axis, state)."""


def make_workspace(n_nodes: int, n_pairs: int, n_states: int) -> Workspace:
    """Return the workspace of a group of the given size."""
    most = max(16, 3 * n_nodes)
    return Workspace(
        cursor=np.zeros(6, dtype=np.int64),
        idx=np.zeros(most, dtype=np.int64),
        val=np.zeros(most),
        w=aligned(n_states),
        share=np.zeros(room_to_wait(n_states)),
        scale=aligned(n_states),
        step=np.zeros((n_nodes, N_STEP)),
        derivatives=aligned(n_nodes, STATES + 1, ROOM),
        speed=np.zeros(n_nodes),
        x=aligned(1, n_states),
        P=aligned(1, n_states, n_states),
        preintegrated=np.zeros((n_nodes, N_PRE)),
        t_pre=np.zeros(n_nodes),
        nlos=np.zeros((1, n_pairs)),
        bias_retention=np.zeros((1, n_pairs)),
        none_waiting=np.zeros(1, dtype=np.int64),
        gradient=np.zeros(9),
        direct=np.zeros(9),
        turns=aligned(3, 3, n_states),
    )
