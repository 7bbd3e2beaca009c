"""Reset of an estimate of one time, and the check of a node for recent ranges."""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def has_recent_range(c, node, t):
    """True if the last range of a node is no older than `node_timeout`; otherwise it has left."""
    return node.seen and t - node.t_last_range <= c.node_timeout


@small_kernel
def clear_estimate(e, o, out):
    """Set an estimate to zeros, with all pairs absent and no orientations.

    Args:
        e: Index of the environment.
        o: Index of the time.
        out: pos, vel, cov, q, has_q, age, nis, nlos, status; (env, time, ...), written.
    """
    pos, vel, cov, q_wb, has_q, age, nis, nlos, status = out
    for p in range(pos.shape[2]):
        age[e, o, p] = nis[e, o, p] = nlos[e, o, p] = 0.0
        status[e, o, p] = 0
        for a in range(3):
            pos[e, o, p, a] = vel[e, o, p, a] = 0.0
        for a in range(6):
            for b in range(6):
                cov[e, o, p, a, b] = 0.0
    for n in range(has_q.shape[2]):
        has_q[e, o, n] = False
        for k in range(4):
            q_wb[e, o, n, k] = 0.0
