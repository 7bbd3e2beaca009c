"""What is known without measuring: cars do not slide sideways, a still node is still.

Also the gauge: ranges and accelerations say nothing about where the group as a whole is. Its
centre is moved back to the origin from time to time, with a fixed uncertainty that is
independent of all else; differences between nodes do not feel it.
"""

from __future__ import annotations

import math

from tracking.jit import small_kernel
from tracking.filters.joint._alignment_kernels import is_linear
from tracking.filters.joint._linear_kernels import absorb, covariance, project, settle, symmetrise
from tracking.filters.joint._open_kernels import tell_turn, turn_gradient
from tracking.filters.joint._sleep_kernels import rests

GLIDES = 9.0
"""[-] Square of the standard deviations by which a velocity differs from zero."""
CENTRE_VAR = 1.0
"""[m2] Variance of the centre after it was moved back."""


@small_kernel
def apply_carriers(c, s, h, t, dt, scratch):
    """Use what is known about the carriers, in hypothesis h.

    Args:
        c: Coefficients.
        s: JointState of one environment, at time t.
        h: Hypothesis.
        t: Time [s].
        dt: Time since the last use [s].
        scratch: Room.
    """
    hold_nodes(c, s, h, t, scratch)
    hold_speed(c, s, h, dt, scratch)


@small_kernel
def hold_nodes(c, s, h, t, scratch):
    """Nodes that rest do not move, and the axles of cars do not slide."""
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present or node.static or t - node.t_state > c.unaided_after:
            continue
        if rests(c, node, t):
            if glides(c, s, h, i):
                if h == s.group[0].best:
                    node.t_moved = t
                continue
            for k in range(c.d):
                scratch.idx[0], scratch.val[0] = node.at_v + k, 1.0
                if is_linear(s.group[0]):
                    scratch.direct[:] = 0.0
                judge(c, s, h, -s.x[h, node.at_v + k], 1, c.rest_var, scratch)
        elif node.sideways_var > 0.0:
            hold_on_wheels(c, s, h, i, scratch)


@small_kernel
def glides(c, s, h, i):
    """True if node i, whose IMU reads the same for a while, is known to move all the same.

    At a constant velocity, or slowly round a curve, an IMU reads what it reads at rest.
    """
    for k in range(c.d):
        at = s.nodes[i].at_v + k
        v = s.x[h, at]
        floor = GLIDES * c.rest_var
        if v * v > floor and v * v > floor + GLIDES * covariance(s, h, at, at):
            return True
    return False


@small_kernel
def judge(c, s, h, nu, m, variance, scratch):
    """Correct with a constraint, and let it speak for or against the hypothesis."""
    S, open_var = project(s, h, m, scratch) + variance, 0.0
    if is_linear(s.group[0]):
        open_var = turn_gradient(s, h, m, scratch)
        tell_turn(s, h, scratch, nu, max(S, nu * nu / 25.0))
    if s.group[0].n_alive > 1:
        s.loglik[h] -= 0.5 * min(nu * nu / (S + open_var), c.max_nis)
    if nu * nu > 25.0 * S:
        S = nu * nu / 25.0  # a jolt or a skid: it counts for less
    absorb(s, h, scratch.w, nu, S)


@small_kernel
def hold_on_wheels(c, s, h, i, scratch):
    """The rear axle moves sideways by the slip of its tyres only; wheeled nodes do not rise."""
    node = s.nodes[i]
    error = s.x[h, node.at_h]
    cos_e, sin_e = math.cos(error), math.sin(error)
    cos_y, sin_y = (
        node.cos_yaw * cos_e - node.sin_yaw * sin_e,
        node.sin_yaw * cos_e + node.cos_yaw * sin_e,
    )
    v0, v1 = s.x[h, node.at_v], s.x[h, node.at_v + 1]
    sideways, forward = -sin_y * v0 + cos_y * v1, cos_y * v0 + sin_y * v1
    # Its tyres need a slip angle for the force that a curve takes, v yaw_rate; so it drifts out.
    outwards = node.slip * node.yaw_rate * forward
    gain = 2.0 * outwards
    idx, val = scratch.idx, scratch.val
    idx[0], idx[1], idx[2] = node.at_v, node.at_v + 1, node.at_h
    val[0], val[1] = -sin_y + gain * cos_y, cos_y + gain * sin_y
    val[2] = -forward + gain * sideways
    nu = node.rear_axle * node.yaw_rate - outwards * forward - sideways
    if is_linear(s.group[0]):
        note_direct(s, h, node.at_v, val[0], val[1], 0.0, scratch)
    judge(c, s, h, nu, 3, node.sideways_var, scratch)
    if c.d == 3:
        idx[0], val[0] = node.at_v + 2, 1.0
        if is_linear(s.group[0]):
            note_direct(s, h, node.at_v, 0.0, 0.0, 1.0, scratch)
        judge(c, s, h, -s.x[h, node.at_v + 2], 1, node.sideways_var, scratch)


@small_kernel
def note_direct(s, h, at, g0, g1, g2, scratch):
    """Derivatives by the turn M of ``g . M^T v``, a velocity of the world, with v held."""
    for r in range(3):
        v = s.x[h, at + r]
        scratch.direct[3 * r], scratch.direct[3 * r + 1] = g0 * v, g1 * v
        scratch.direct[3 * r + 2] = g2 * v


@small_kernel
def hold_speed(c, s, h, dt, scratch):
    """The mean velocity of the moving nodes is that of things that are carried.

    Once a second by weight: `dt` spreads it evenly.
    """
    m, variance = 0, 0.0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present and not s.nodes[i].static:
            m += 1
            variance += s.nodes[i].speed_var
    if m == 0:
        return
    variance /= m * max(dt, 1e-3)
    for k in range(c.d):
        a, mean = 0, 0.0
        for i in range(s.nodes.shape[0]):
            if s.nodes[i].present and not s.nodes[i].static:
                at = s.nodes[i].at_v + k
                scratch.idx[a], scratch.val[a] = at, 1.0 / m
                mean += s.x[h, at] / m
                a += 1
        S = project(s, h, m, scratch) + variance
        if is_linear(s.group[0]):
            scratch.direct[:] = 0.0
            turn_gradient(s, h, m, scratch)
            tell_turn(s, h, scratch, -mean, S)
        absorb(s, h, scratch.w, -mean, S)


@small_kernel
def centre(c, s, h, w):
    """Move the centre of the group to the origin: ``p <- p - mean p``, and P with it.

    The covariance becomes ``T P T^T`` with the projection T, plus a common variance, so that
    it stays positive definite and bounded.
    """
    n_nodes = s.nodes.shape[0]
    present = 0
    for i in range(n_nodes):
        present += s.nodes[i].present
    if present == 0:
        return
    settle(s, h)
    for k in range(c.d):
        mean = 0.0
        for r in range(c.n):
            w[r] = 0.0
        for i in range(n_nodes):
            if s.nodes[i].present:
                at = s.nodes[i].at_p + k
                mean += s.x[h, at] / present
                for r in range(c.n):
                    w[r] += s.P[h, at, r] / present
        for i in range(n_nodes):
            if s.nodes[i].present:
                at = s.nodes[i].at_p + k
                s.x[h, at] -= mean
                for r in range(c.n):
                    s.P[h, at, r] -= w[r]
        for r in range(c.n):
            total = 0.0
            for i in range(n_nodes):
                if s.nodes[i].present:
                    total += s.P[h, r, s.nodes[i].at_p + k]
            for i in range(n_nodes):
                if s.nodes[i].present:
                    s.P[h, r, s.nodes[i].at_p + k] -= total / present
        for i in range(n_nodes):
            for j in range(n_nodes):
                if s.nodes[i].present and s.nodes[j].present:
                    s.P[h, s.nodes[i].at_p + k, s.nodes[j].at_p + k] += CENTRE_VAR
    symmetrise(s.P, h, c.n)
