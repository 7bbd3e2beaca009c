"""Fixed-lag smoothing: estimates with later measurements, without changing the filter.

The positions and velocities of a moment are added to the state vector as clones. They have no
dynamics and no measurement depends on them, but they are correlated with the other states, so that
every correction moves them as well: after the later measurements they are the smoothed estimate, as
exact as the filter itself [1].

References:
    [1] Moore, Discrete-time fixed-lag smoothing algorithms, Automatica 9 (1973) 163.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64, aligned, whole_lines
from tracking.estimate import Status, TeamEstimate
from tracking.filters.joint.hypotheses.alignment import freeze_alignment
from tracking.filters.joint.state import JointState, room_to_wait
from tracking.records import Records


def with_clones(state: JointState, coefficients: Records) -> tuple[JointState, Records]:
    """Return the best hypothesis of every environment, with clones of its motion.

    Args:
        state: State of the filter; not changed.
        coefficients: Constants (`make_coefficients`), (1).

    Returns:
        State with one hypothesis and the clones after the other states, in the same order; its
        coefficients.
    """
    envs = np.arange(len(state.x))
    best = state.group["best"][:, 0]
    n, n_motion = state.x.shape[2], int(coefficients[0]["n_motion"])
    every = np.concatenate([np.arange(n), np.arange(n_motion)])
    width = whole_lines(len(every))
    group = state.group.copy()
    freeze_alignment(group)
    wider = coefficients.copy()
    wider["n"] = width
    clones = JointState(
        nodes=state.nodes.copy(),
        last_attitude_accel=state.last_attitude_accel.copy(),
        preintegrated=state.preintegrated.copy(),
        pairs=state.pairs.copy(),
        group=group,
        x=aligned(len(envs), 1, width),
        P=aligned(len(envs), 1, width, width),
        pending_updates=aligned(len(envs), 1, room_to_wait(width), width),
        n_pending=np.zeros((len(envs), 1), dtype=np.int64),
        accumulated_correction=aligned(len(envs), 1, width),
        nlos=state.nlos[envs, best][:, None].copy(),
        bias_retention=state.bias_retention[envs, best][:, None].copy(),
        alive=state.alive[envs, best][:, None].copy(),
        loglik=np.zeros((len(envs), 1)),
        sensitivity=np.zeros((len(envs), 1, 0, width)),
        alignment_score=np.zeros((len(envs), 1, 0)),
        alignment_information=np.zeros((len(envs), 1, 0, 0)),
        alignment_cov=np.zeros((len(envs), 1, 0, 0)),
    )
    used = len(every)
    clones.x[:, 0, :used] = state.x[envs, best][:, every]
    clones.P[:, 0, :used, :used] = state.P[envs, best][:, every][..., every]
    return clones, wider


def read_clones(clones: JointState, estimate: TeamEstimate, n_states: int) -> TeamEstimate:
    """Return the estimate with positions, velocities and covariances of the clones.

    Pairs that do not run keep their values.

    Args:
        clones: State with clones, after the later measurements.
        estimate: Estimate of the moment, without these; (env, pair).
        n_states: Length of the filter's own state vector.
    """
    constellation, nodes = estimate.constellation, clones.nodes[0]
    d = constellation.dimensions
    x, W = clones.x[:, 0, n_states:], clones.pending_updates[:, 0, :, n_states:]  # noqa: N806
    waits = np.arange(W.shape[1]) < clones.n_pending
    W = np.where(waits[..., None], W, 0.0)  # noqa: N806
    P = clones.P[:, 0, n_states:, n_states:] - np.swapaxes(W, -1, -2) @ W  # noqa: N806
    take = np.zeros((constellation.n_pairs, 6, x.shape[1]))
    for p, (i, j) in enumerate(constellation.pairs):
        for k in range(d):
            for node, sign in ((j, 1.0), (i, -1.0)):
                take[p, k, nodes["i_pos"][node] + k] = sign
                if nodes["i_vel"][node] >= 0:
                    take[p, 3 + k, nodes["i_vel"][node] + k] = sign
    relative: F64 = np.einsum("pkc,ec->epk", take, x)
    cov = take @ P[:, None] @ np.swapaxes(take, -1, -2)
    cov = 0.5 * (cov + np.swapaxes(cov, -1, -2))
    runs = estimate.status >= Status.AMBIGUOUS
    return replace(
        estimate,
        pos_ij_w=np.where(runs[..., None], relative[..., :3], estimate.pos_ij_w),
        vel_ij_w=np.where(runs[..., None], relative[..., 3:], estimate.vel_ij_w),
        cov=np.where(runs[..., None, None], cov, estimate.cov),
    )
