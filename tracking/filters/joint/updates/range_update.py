"""A range: its model and the correction.

    z = |p_j + l_j - p_i - l_i| + fast + slow + noise

with the antenna offsets l rotated by the nodes' orientations and heading errors, and p at the time
of the range, predicted from states that may be a little older (`event_loop.predict_to`). NLOS adds
a bias (`range_errors`) and, in proportion to its probability, white noise. The noise is divided by
the probability that the range is no outlier, so an outlier hardly counts.
"""

from __future__ import annotations

import math

from tracking.filters.joint.ekf.observability import enforce_observability
from tracking.filters.joint.ekf.propagation import displacement_since_epoch, time_since_epoch
from tracking.filters.joint.ekf.scalar_update import (
    compute_pht,
    kalman_update,
    relative_variance_across,
    relative_variance_bound,
)
from tracking.filters.joint.hypotheses.alignment import is_linear
from tracking.filters.joint.hypotheses.alignment_sensitivity import (
    accumulate_alignment_information,
    innovation_sensitivity,
    lever_arm_sensitivity,
)
from tracking.filters.joint.updates.range_errors import (
    learn_white_noise,
    learns_noise,
    reset_bias_on_transition,
    update_nlos_posterior,
)
from tracking.kernels.jit import kernel, small_kernel
from tracking.models.lever_arm import lever_arm_slope, rotate_lever_arm
from tracking.models.range import range_model
from tracking.models.range_bias import range_bias_model

NEGLIGIBLE = 1e-3
"""[-] Share of the white variance up to which second-order variance is neglected."""


@small_kernel
def predict_range(c, s, h, p, lever_i, lever_j, idx, val):
    """Predict the range of pair p [m]; write its derivatives.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis.
        p: Pair.
        lever_i: Antenna of i relative to its node, world frame as measured, 3 numbers [m].
        lever_j: Antenna of j relative to its node, world frame as measured, 3 numbers [m].
        idx: States of the derivatives, written.
        val: Derivatives, written.

    Returns:
        Range, and number of derivatives.
    """
    pair = s.pairs[p]
    node_i, node_j = s.nodes[pair.i], s.nodes[pair.j]
    i0, i1 = lever_i[0], lever_i[1]
    j0, j1 = lever_j[0], lever_j[1]
    if not node_i.static and (i0 != 0.0 or i1 != 0.0):
        i0, i1 = rotate_lever_arm(s.x[h, node_i.i_heading], i0, i1)
    if not node_j.static and (j0 != 0.0 or j1 != 0.0):
        j0, j1 = rotate_lever_arm(s.x[h, node_j.i_heading], j0, j1)
    at_i, at_j = node_i.i_pos, node_j.i_pos
    r0 = s.x[h, at_j] - s.x[h, at_i] + j0 - i0
    r1 = s.x[h, at_j + 1] - s.x[h, at_i + 1] + j1 - i1
    r2 = lever_j[2] - lever_i[2]
    if c.d == 3:
        r2 += s.x[h, at_j + 2] - s.x[h, at_i + 2]
    T_i, T_j = time_since_epoch(s, pair.i), time_since_epoch(s, pair.j)
    if T_i > 0.0:
        way0, way1, way2 = displacement_since_epoch(c, s, h, pair.i)
        r0, r1, r2 = r0 - way0, r1 - way1, r2 - way2
    if T_j > 0.0:
        way0, way1, way2 = displacement_since_epoch(c, s, h, pair.j)
        r0, r1, r2 = r0 + way0, r1 + way1, r2 + way2
    distance, u0, u1, u2 = range_model(r0, r1, r2)
    idx[0], idx[1], idx[2], idx[3] = at_i, at_i + 1, at_j, at_j + 1
    val[0], val[1], val[2], val[3] = -u0, -u1, u0, u1
    m = 4
    if c.d == 3:
        idx[4], idx[5] = at_i + 2, at_j + 2
        val[4], val[5] = -u2, u2
        m = 6
    # Derivatives of the displacement by biases and heading errors are left out: below 1 mm.
    for node, T, sign in ((node_i, T_i, -1.0), (node_j, T_j, 1.0)):
        if T > 0.0:
            idx[m], idx[m + 1] = node.i_vel, node.i_vel + 1
            val[m], val[m + 1] = sign * T * u0, sign * T * u1
            m += 2
            if c.d == 3:
                idx[m], val[m] = node.i_vel + 2, sign * T * u2
                m += 1
    if not node_i.static and (i0 != 0.0 or i1 != 0.0):
        idx[m], val[m] = node_i.i_heading, -lever_arm_slope(i0, i1, u0, u1)
        m += 1
    if not node_j.static and (j0 != 0.0 or j1 != 0.0):
        idx[m], val[m] = node_j.i_heading, lever_arm_slope(j0, j1, u0, u1)
        m += 1
    if pair.i_range_error >= 0:
        idx[m], idx[m + 1] = pair.i_range_error, pair.i_range_error + 1
        bias, val[m], val[m + 1] = range_bias_model(
            s.x[h, pair.i_range_error], s.x[h, pair.i_range_error + 1]
        )
        m += 2
        distance += bias
    return distance, m


@small_kernel
def second_order_variance(c, s, h, p, val):
    """Return the variance of a range that accounts for the nonlinearity of its model [m2].

    To second order, a range is longer than predicted by ``tr(P_across) / (2 d)`` on average, with
    P_across the covariance of the relative position across the line of sight.
    """
    i, j = s.nodes[s.pairs[p].i].i_pos, s.nodes[s.pairs[p].j].i_pos
    r0, r1, r2 = s.x[h, j] - s.x[h, i], s.x[h, j + 1] - s.x[h, i + 1], 0.0
    if c.d == 3:
        r2 = s.x[h, j + 2] - s.x[h, i + 2]
    gain = 0.5 * c.nonlinearity_gain / math.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + 0.01)
    if (gain * relative_variance_bound(s, h, i, j, c.d)) ** 2 < NEGLIGIBLE * s.group[0].white_var:
        return 0.0
    u2 = val[5] if c.d == 3 else 0.0
    across = relative_variance_across(s, h, i, j, val[2], val[3], u2, c.d)
    return min(gain * max(across, 0.0), c.largest_bend) ** 2


@small_kernel
def lasting_error(s, h, p):
    """Return the estimated lasting error of the ranges of a pair [m]."""
    at = s.pairs[p].i_range_error
    return s.x[h, at] + s.x[h, at + 1] if at >= 0 else 0.0


@small_kernel
def distance_covariance(s, p, variance, w):
    """Return the covariance of a predicted range and its distance without lasting errors [m2].

    Args:
        s: JointState of one environment.
        p: Pair.
        variance: Variance of the range [m2].
        w: ``P H``.
    """
    at = s.pairs[p].i_range_error
    return variance - w[at] - w[at + 1] if at >= 0 else variance


@kernel
def range_update(c, s, h, p, dt, distance, levers, sight, work):
    """Correct hypothesis h with a range of pair p.

    Args:
        c: Coefficients.
        s: JointState of one environment, at the time of the range.
        h: Hypothesis.
        p: Pair.
        dt: Time since the pair's last range [s].
        distance: Range [m].
        levers: Antennas of i and j relative to their nodes, six numbers [m].
        sight: Log-likelihood ratio of NLOS from the powers, 0 if they are not reported; rates of
            transitions to NLOS and to LOS [1/s].
        work: Workspace.

    Returns:
        Innovation [m]; its square over the predicted variance; NIS with the noise after the NLOS
        update; probability that the range is no outlier; log-likelihood of the range [m], without
        a constant.
    """
    if s.group[0].heading_gauge_var > c.gauge_std * c.gauge_std:
        enforce_observability(c, s, h, work)
    predicted, m = predict_range(c, s, h, p, levers[:3], levers[3:], work.idx, work.val)
    nu = distance - predicted
    longer = nu + lasting_error(s, h, p)
    variance = compute_pht(s, h, m, work)
    open_var = 0.0
    if is_linear(s.group[0]):
        lever_arm_sensitivity(levers, work)
        open_var = innovation_sensitivity(s, h, m, work)
    bent = second_order_variance(c, s, h, p, work.val)
    expected = variance + open_var + bent
    S = expected + s.group[0].white_var
    switched, sane, likelihood, is_far = update_nlos_posterior(
        c, s, h, p, dt, nu, expected, sight, work.w
    )
    loglik = math.log(likelihood)
    if s.group[0].n_alive > 1:
        # Without determinants: covariances of hypotheses differ by linearisation errors only, and
        # wrong ones, with the largest, have the smallest covariance.
        s.loglik[h] += max(loglik + 0.5 * math.log(S), -0.5 * c.nis_cap)
    before, misfit = nu, nu * nu / S
    if switched < c.reset_at_once or s.pairs[p].i_range_error < 0:
        s.bias_retention[h, p] *= 1.0 - switched
    else:
        reset_bias_on_transition(c, s, h, p, switched, is_far)
        predicted, m = predict_range(c, s, h, p, levers[:3], levers[3:], work.idx, work.val)
        nu = distance - predicted
        variance = compute_pht(s, h, m, work)
        if is_linear(s.group[0]):
            open_var = innovation_sensitivity(s, h, m, work)
    R = s.group[0].white_var + bent + s.nlos[h, p] * c.nlos_white_var
    nis = nu * nu / (variance + open_var + R)
    # The larger the mean NIS of a pair, the less its ranges count.
    doubt = s.pairs[p].mean_nis / (c.contradiction_share * c.pair_nis_limit)
    trust = sane
    if doubt > 1.0:
        trust /= doubt**c.contradiction_power
    if learns_noise(c, s):
        gain = distance_covariance(s, p, variance, work.w) / (variance + R / max(trust, 1e-9))
        learn_white_noise(c, s.group[0], s.pairs[p], longer, longer - gain * nu, dt)
    if trust > c.least_trust:
        if is_linear(s.group[0]):
            accumulate_alignment_information(s, h, work, nu, variance + R / trust)
        kalman_update(s, h, work.w, nu, variance + R / trust)
    return before, misfit, nis, sane, loglik
