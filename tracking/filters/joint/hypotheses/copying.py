"""Copies of hypotheses, rotated or reflected."""

from __future__ import annotations

from tracking.filters.joint.ekf.gauge import group_centre
from tracking.kernels.jit import allocating_kernel


@allocating_kernel
def copy_hypothesis(s, h):
    """Copy a hypothesis to a free place of the bank; return its index, -1 if there is none."""
    for free in range(s.alive.shape[0]):
        if not s.alive[free]:
            s.alive[free] = True
            s.loglik[free] = s.loglik[h]
            s.x[free] = s.x[h]
            s.P[free] = s.P[h]
            s.pending_updates[free] = s.pending_updates[h]
            s.n_pending[free] = s.n_pending[h]
            s.accumulated_correction[free] = s.accumulated_correction[h]
            s.nlos[free] = s.nlos[h]
            s.bias_retention[free] = s.bias_retention[h]
            s.sensitivity[free] = s.sensitivity[h]
            s.alignment_score[free] = s.alignment_score[h]
            s.alignment_information[free] = s.alignment_information[h]
            s.alignment_cov[free] = s.alignment_cov[h]
            s.group[0].n_alive += 1
            return free
    return -1


@allocating_kernel
def rotate_hypothesis(c, s, h, M):
    """Rotate or reflect the layout of a hypothesis about its centre, velocities as well.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis without pending updates, updated.
        M: Orthogonal, (d, d).
    """
    mean, mean_v = group_centre(c, s, h)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if node.present:
            rotate_block(s, c.n, h, node.i_pos, mean, M)
            if not node.static:
                rotate_block(s, c.n, h, node.i_vel, mean_v, M)
    s.accumulated_correction[h, :] = 0.0


@allocating_kernel
def rotate_block(s, n, h, at, mean, M):
    """Rotate a vector of the state about a mean, and its rows and columns of the covariance."""
    d = M.shape[0]
    x, P, out = s.x, s.P, s.x[h, at : at + d] - mean
    for r in range(d):
        x[h, at + r] = mean[r]
        for k in range(d):
            x[h, at + r] += M[r, k] * out[k]
    for r in range(n):
        for k in range(d):
            out[k] = P[h, at + k, r]
        for k in range(d):
            P[h, at + k, r] = 0.0
            for q in range(d):
                P[h, at + k, r] += M[k, q] * out[q]
    for r in range(n):
        for k in range(d):
            out[k] = P[h, r, at + k]
        for k in range(d):
            P[h, r, at + k] = 0.0
            for q in range(d):
                P[h, r, at + k] += M[k, q] * out[q]
