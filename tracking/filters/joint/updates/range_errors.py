"""What is learned of range errors: the NLOS probability of each pair, and the white noise of all.

**NLOS.** The probability follows from Bayes' rule, with the innovation, with the difference of
received and first-path power if these are reported, and with its earlier value: a Markov chain of
two states for every pair and hypothesis. A transition resets the slow range error.

**White noise** is learned from the value of the parameters upwards. Two successive ranges of a pair
differ by the predicted motion of the pair and by the difference of two white errors; lasting errors
cancel. Half of these differences are smaller than 0.67 times their standard deviation, whatever a
few obstacles add. So each moves the estimate a small step up or down: the recursive median [1]. It
does not depend on the share of an innovation that the filter assigns to a lasting error.

References:
    [1] Robbins, Monro, A stochastic approximation method, Annals of Mathematical Statistics 22
        (1951) 400.
"""

from __future__ import annotations

import math

from tracking.filters.joint.ekf.scalar_update import covariance, scale_state
from tracking.filters.joint.hypotheses.alignment import FILTERED
from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import exponential, likelihood
from tracking.models.nlos import nlos_posterior, outlier_density, transition_probs
from tracking.models.range_bias import slow_error_var


@small_kernel
def update_nlos_posterior(c, s, h, p, dt, nu, variance, sight, w):
    """Update the NLOS probability of pair p by Bayes' rule over the states before and after.

    The slow error holds the NLOS bias. So in LOS before and after, or in NLOS, the range is
    predicted as it is; a transition to NLOS adds a bias, one to LOS removes the slow error. Most
    biases are small, some are large: their density is a sum of two Gaussians.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis.
        p: Pair.
        dt: Time since the pair's last range [s].
        nu: Innovation [m].
        variance: Variance of the predicted range [m2].
        sight: Evidence and rates of NLOS, see `range_update`.
        w: ``P H``.

    Returns:
        Probability of a transition; probability of no outlier; likelihood; and probability that
        the bias after a transition to NLOS is a large one.
    """
    at = s.pairs[p].i_range_error + 1
    evidence, los_to_nlos_rate, nlos_to_los_rate = sight
    enter, leave = transition_probs(los_to_nlos_rate, nlos_to_los_rate, dt)
    S = variance + s.group[0].white_var
    near = (1.0 - c.nlos_large_share) * likelihood(nu - c.nlos_bias, S + c.nlos_bias_var)
    far = c.nlos_large_share * likelihood(nu - c.nlos_bias_large, S + c.nlos_bias_large_var)
    nu_leave, S_leave = nu, S
    if at > 0:
        nu_leave = nu + s.x[h, at]
        S_leave += max(covariance(s, h, at, at) - 2.0 * w[at], -0.9 * variance) + c.slow_var
    stays = likelihood(nu, S)
    s.nlos[h, p], switched, total, of_range = nlos_posterior(
        c,
        s.nlos[h, p],
        enter,
        leave,
        stays,
        near + far,
        likelihood(nu_leave, S_leave),
        # Without a state for the bias, every NLOS range has a new one.
        stays if at > 0 else near + far,
        exponential(evidence),
    )
    wild = outlier_density(c)
    return switched, total / (total + wild), of_range + wild, far / max(near + far, 1e-300)


@small_kernel
def reset_bias_on_transition(c, s, h, p, switched, is_far):
    """Reset the slow error of a pair by the probability of an NLOS transition.

    A new bias is a large one with probability `is_far`; the mixture is collapsed to one Gaussian.
    """
    at = s.pairs[p].i_range_error + 1
    if at <= 0:
        return
    stays = 1.0 - switched
    before = covariance(s, h, at, at)
    scale_state(s, h, c.n, at, stays)
    hidden = s.nlos[h, p]
    extra = c.nlos_bias_large - c.nlos_bias
    within = c.nlos_bias_var + is_far * (c.nlos_bias_large_var - c.nlos_bias_var)
    nlos_bias_var = within + is_far * (1.0 - is_far) * extra * extra
    excess = c.nlos_bias + is_far * extra
    new_var = slow_error_var(c.slow_var, hidden, excess, nlos_bias_var)
    off = s.x[h, at] - hidden * excess
    # Variance of the mixture; pending updates, scaled above, remain subtracted.
    s.P[h, at, at] += switched * stays * before + switched * new_var + switched * stays * off * off
    s.x[h, at] -= switched * off


MEDIAN = 0.6745 * math.sqrt(2.0)
"""[-] Median absolute difference of two white errors, over the standard deviation of one."""


@small_kernel
def learns_noise(c, s):
    """True if noise is learned and one hypothesis is left, whose residuals are range errors."""
    return c.learns > 0.0 and s.group[0].alignment == FILTERED and s.group[0].n_alive == 1


@small_kernel
def learn_white_noise(c, group, pair, before, after, dt):
    """Update the white noise by the difference of a range of a pair and its last one.

    Args:
        c: Coefficients.
        group: GROUP, `white_var` updated.
        pair: PAIR, updated.
        before: Range minus predicted distance [m].
        after: Range minus distance corrected with the range [m].
        dt: Time since the last range of the pair [s].
    """
    if pair.has_residual and dt < c.white_gap:
        std = math.sqrt(group.white_var)
        is_larger = abs(before - pair.residual) > MEDIAN * std
        std *= 1.0 + (c.white_step if is_larger else -c.white_step)
        group.white_var = min(max(std * std, c.white_var), c.white_var * c.most_learned**2)
    pair.residual, pair.has_residual = after, True
