"""Fixed-lag smoothing: what later measurements say about a moment, without touching the filter.

The positions and velocities of that moment are put into the state vector a second time. They
have no dynamics and no measurement looks at them, but they are correlated with the rest, so that
every correction moves them as well: what they hold after the later measurements is the smoothed
estimate, exactly as far as the filter itself is [1].

References:
    [1] Moore, Discrete-time fixed-lag smoothing algorithms, Automatica 9 (1973) 163.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64, I64
from tracking.constellation import Constellation
from tracking.estimate import Status, TeamEstimate
from tracking.filters.joint.records import Records
from tracking.filters.joint.state import JointState, room_to_wait


def with_clones(
    state: JointState, coefficients: Records, constellation: Constellation
) -> tuple[JointState, Records, I64]:
    """The best hypothesis of every environment, its motion doubled.

    Args:
        state: Of the filter; not changed.
        coefficients: COEFFICIENTS, (1).
        constellation: Who is in the group.

    Returns:
        State with one hypothesis and the clones behind the other states; its coefficients;
        the states that were cloned, (clone).
    """
    nodes, d = state.nodes[0], constellation.dimensions
    source = np.concatenate(
        [np.arange(at, at + d) for at in nodes["at_p"]]
        + [np.arange(at, at + d) for at in nodes["at_v"] if at >= 0]
    )
    envs = np.arange(len(state.x))
    best = state.group["best"][:, 0]
    n = state.x.shape[2]
    every = np.concatenate([np.arange(n), source])
    group = state.group.copy()
    group["best"], group["n_alive"] = 0, np.minimum(group["n_alive"], 1)
    wider = coefficients.copy()
    wider["n"] = len(every)
    clones = JointState(
        nodes=state.nodes.copy(),
        held=state.held.copy(),
        pre=state.pre.copy(),
        pairs=state.pairs.copy(),
        group=group,
        x=np.ascontiguousarray(state.x[envs, best][:, None, every]),
        P=np.ascontiguousarray(state.P[envs, best][:, None, every][..., every]),
        waiting=np.zeros((len(envs), 1, room_to_wait(len(every)), len(every))),
        n_waiting=np.zeros((len(envs), 1), dtype=np.int64),
        moved=np.zeros((len(envs), 1, len(every))),
        nlos=state.nlos[envs, best][:, None].copy(),
        alive=state.alive[envs, best][:, None].copy(),
        loglik=np.zeros((len(envs), 1)),
    )
    return clones, wider, source


def read_clones(
    clones: JointState, source: I64, estimate: TeamEstimate, n_states: int
) -> TeamEstimate:
    """The estimate with positions, velocities and covariances of the clones.

    Pairs that are not running keep what they had.

    Args:
        clones: After the later measurements.
        source: The states that were cloned, (clone).
        estimate: Of the moment, before them; (env, pair).
        n_states: Length of the filter's own state vector.
    """
    constellation = estimate.constellation
    n, d = constellation.n_nodes, constellation.dimensions
    x, W = clones.x[:, 0, n_states:], clones.waiting[:, 0, :, n_states:]  # noqa: N806
    waits = np.arange(W.shape[1]) < clones.n_waiting
    W = np.where(waits[..., None], W, 0.0)  # noqa: N806
    P = clones.P[:, 0, n_states:, n_states:] - np.swapaxes(W, -1, -2) @ W  # noqa: N806
    moving = np.nonzero(~constellation.is_static)[0]
    at_v = np.full(n, -1)
    at_v[moving] = n * d + d * np.arange(len(moving))
    take = np.zeros((constellation.n_pairs, 6, len(source)))
    for p, (i, j) in enumerate(constellation.pairs):
        for k in range(d):
            take[p, k, j * d + k], take[p, k, i * d + k] = 1.0, -1.0
            for node, sign in ((j, 1.0), (i, -1.0)):
                if at_v[node] >= 0:
                    take[p, 3 + k, at_v[node] + k] = sign
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
