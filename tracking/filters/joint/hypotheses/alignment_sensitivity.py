"""Alignment of a group in space by linear sensitivities: one filter for all rotations.

Ranges give the layout in some frame, which is the world's rotated or reflected by an orthogonal
matrix M. Accelerations of the world enter that frame as ``M a``, linear in the nine elements of M.
So with M known the filter is linear in M as well, as far as it is linear at all: states are
``x + sum_k sensitivity_k (M - 1)_k``, gains do not depend on M, innovations ``nu + g . (M - 1)``.
One filter thus gives the log-likelihood of every M, a quadratic form in its elements,

    log L(M) = score . (M - 1) - (M - 1) . information (M - 1) / 2,

all rotations and reflections among them: `rotation_modes` finds its maxima, `alignment_modes`
follows them. This is Friedland's estimate of a constant bias by the sensitivities of a Kalman
filter [1]; the search among all matrices before rotations is that of Wahba's problem [2].

References:
    [1] Friedland, Treatment of bias in recursive filtering, IEEE Trans. Automatic Control 14
        (1969) 359.
    [2] Wahba, A least squares estimate of satellite attitude, SIAM Review 7 (1965) 409.
"""

from __future__ import annotations

import numpy as np

from tracking.filters.joint.ekf.columns import BY_HEADING_P, BY_HEADING_V, TILT_STEP, UP_P, UP_V
from tracking.filters.joint.ekf.imu_errors import propagate_gyro_bias_sensitivity
from tracking.filters.joint.ekf.propagation import moves, n_bias_states
from tracking.filters.joint.hypotheses.alignment import LINEAR, has_modes
from tracking.kernels.jit import allocating_kernel, kernel, small_kernel
from tracking.maths.covariance import STATES
from tracking.models.lever_arm import antenna_offset

LOOSE = 3.0
"""[-] Prior information about each element of M: its variance over all rotations is a third."""


@small_kernel
def has_linear_alignment(c, s):
    """True for groups in space of more than three nodes (`rare.actions_of`).

    A layout of three has too little information. Few nodes start, the others join soon after. A
    smoother, which has no sensitivities, keeps the rotation as it is.
    """
    return s.sensitivity.shape[1] > 0 and s.nodes.shape[0] > c.d


@allocating_kernel
def start_alignments(c, s, layout):
    """Start the alignment of every hypothesis, if the group is `LINEAR`."""
    if s.group[0].alignment == LINEAR:
        for h in range(s.alive.shape[0]):
            if s.alive[h]:
                start_alignment(c, s, layout, h)


@allocating_kernel
def start_alignment(c, s, layout, h):
    """Reset the information about the rotation of hypothesis h, which has no pending updates.

    The group is `LINEAR` or `CHALLENGED` already.

    The prior is that fixed nodes differ less in height than in width, as people place them.
    """
    s.alignment_score[h], s.alignment_information[h] = 0.0, 0.0
    attach_to_world(s, layout, h)
    mean, m = np.zeros(3), 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and s.nodes[i].static:
            mean += s.x[h, s.nodes[i].i_pos : s.nodes[i].i_pos + 3]
            m += 1
    mean /= max(m, 1)
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and s.nodes[i].static:
            out = s.x[h, s.nodes[i].i_pos : s.nodes[i].i_pos + 3] - mean
            for r in range(3):
                s.alignment_score[h, 3 * r + 2] -= out[r] * out[2] / c.height_var
                for q in range(3):
                    s.alignment_information[h, 3 * r + 2, 3 * q + 2] += (
                        out[r] * out[q] / c.height_var
                    )
    group = s.group[0]
    group.t_alignment = group.t
    update_alignment_cov(c, s, h)


@allocating_kernel
def update_alignment_cov(c, s, h):
    """Update the covariance of the elements of the rotation: of any, or of one near the mode."""
    if has_modes(s.group[0]):
        J = small_rotation_derivatives()
        H = J @ (s.alignment_information[h] @ J.T.copy()) + np.eye(3) / c.mode_std**2
        s.alignment_cov[h] = J.T.copy() @ (np.linalg.inv(H) @ J)
    else:
        s.alignment_cov[h] = np.linalg.inv(s.alignment_information[h] + LOOSE * np.eye(9))


@allocating_kernel
def small_rotation_derivatives():
    """Return the derivatives of the elements of a small rotation by its components, (3, 9)."""
    J = np.zeros((3, 9))
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        J[a, 3 * u + v], J[a, 3 * v + u] = -1.0, 1.0
    return J


@kernel
def propagate_sensitivity(c, s, h, work):
    """Propagate the sensitivities over the step that `predict` has just made with `work`."""
    first, last = c.n_motion, c.n
    for k in range(9):
        row, column = k // 3, k % 3
        z = s.sensitivity[h, k]
        for r in range(first, last):
            z[r] *= work.scale[r]
        for i in range(s.nodes.shape[0]):
            node = s.nodes[i]
            if not moves(node):
                continue
            p, v, b, w, F = (
                node.i_pos,
                node.i_vel,
                node.i_tilt_bias,
                work.step[i],
                work.derivatives[i],
            )
            for r in range(6):
                z[p + r] += F[STATES, r] * z[p + 3 + r] if r < 3 else 0.0
                for q in range(n_bias_states(node)):
                    z[p + r] += F[q, r] * z[b + q]
            if node.has_ahrs_feedback:
                propagate_gyro_bias_sensitivity(node, z, work.step, i, work.scale)
                z[b + row] += (w[TILT_STEP], w[TILT_STEP + 1], 0.0)[column]
            # The heading error and M rotate the same increments.
            z[p + row] += (w[BY_HEADING_P + 1], -w[BY_HEADING_P], w[UP_P])[column]
            z[v + row] += (w[BY_HEADING_V + 1], -w[BY_HEADING_V], w[UP_V])[column]


@small_kernel
def innovation_sensitivity(s, h, m, work):
    """Write the derivatives of an innovation by the rotation; return the variance they add.

    Args:
        s: JointState of one environment with sensitivities.
        h: Hypothesis.
        m: Number of derivatives by states.
        work: Workspace; `idx` and `val` hold states and derivatives of the prediction, `direct`
            its derivatives by the rotation with the states held; `gradient` is written.
    """
    g = work.gradient
    for k in range(9):
        g[k] = -work.direct[k]
        for a in range(m):
            g[k] -= work.val[a] * s.sensitivity[h, k, work.idx[a]]
    variance = 0.0
    for k in range(9):
        for q in range(9):
            variance += g[k] * s.alignment_cov[h, k, q] * g[q]
    return variance


@small_kernel
def lever_arm_sensitivity(levers, work):
    """Write the derivatives of a range by M, positions held: the antennas rotate with it."""
    u, direct = work.val, work.direct
    for k in range(3):
        lever = levers[3 + k] - levers[k]
        direct[k], direct[3 + k], direct[6 + k] = u[2] * lever, u[3] * lever, u[5] * lever


@small_kernel
def attach_to_world(s, layout, h):
    """Set the sensitivities of states that were estimated in the present rotation of hypothesis h.

    Ranges measure the position of a node's antenna in the frame, whatever M is: the origin of the
    node is an offset away that rotates with M. So does a bias of the accelerations, which is one of
    the world. Without this, ranges and rest would measure a rotation that they do not observe.
    """
    s.sensitivity[h] = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        offset = antenna_offset(s.last_attitude_accel, layout, i, node.antenna)
        for r in range(3):
            for q in range(3):
                s.sensitivity[h, 3 * r + q, node.i_pos + r] = -offset[q]
                if moves(node) and not node.levelled:
                    s.sensitivity[h, 3 * r + q, node.i_tilt_bias + r] = s.x[h, node.i_tilt_bias + q]


@small_kernel
def accumulate_alignment_information(s, h, work, nu, S):
    """Add score and information of the rotation from an innovation; update the sensitivities.

    Args:
        s: JointState of one environment with sensitivities.
        h: Hypothesis.
        work: Workspace; `w` is ``P H``, `gradient` as of `innovation_sensitivity`.
        nu: Innovation, not used yet for `kalman_update`.
        S: Variance of the innovation with the rotation known.
    """
    g, w = work.gradient, work.w
    for k in range(9):
        share = g[k] / S
        s.alignment_score[h, k] -= share * nu
        for q in range(9):
            s.alignment_information[h, k, q] += share * g[q]
        for r in range(s.sensitivity.shape[2]):
            s.sensitivity[h, k, r] += w[r] * share
