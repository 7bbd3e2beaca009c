"""Whether the ends of a range see each other, and what follows from that for its slow error.

It is judged by Bayes' rule, from the residual, from the gap between received and first-path power
where it is reported, and from what it was before: a Markov chain of two states for every pair and
hypothesis.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.scalar_update import covariance, scale_state
from tracking.kernels.jit import small_kernel
from tracking.maths.exponentials import exponential, likelihood
from tracking.models.nlos import nlos_posterior, outlier_density, transition_probs
from tracking.models.range_bias import slow_error_var


@small_kernel
def update_nlos_posterior(c, s, h, p, dt, nu, variance, sight, w):
    """Bayes' rule over what the sight was and is; updates the pair's NLOS probability.

    The slow error holds the excess while there is no sight. So in sight before and after, or
    in neither, the range is predicted as it is; entering adds an excess, leaving takes the
    slow error away. Most obstacles add little, some a lot: so the excess has two parts.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis.
        p: Pair.
        dt: Time since the pair's last range [s].
        nu: Innovation [m].
        variance: Of the prediction [m2].
        sight: As of `range_update`.
        w: ``P H``.

    Returns:
        Probability that the sight changed; that the range meant anything; likelihood; and
        probability that the excess, if any came, is one of the large ones.
    """
    at = s.pairs[p].i_range_error + 1
    evidence, los_to_nlos_rate, nlos_to_los_rate, large_share = sight
    enter, leave = transition_probs(los_to_nlos_rate, nlos_to_los_rate, dt)
    S = variance + s.group[0].white_var
    near = (1.0 - large_share) * likelihood(nu - c.nlos_bias, S + c.nlos_bias_var)
    far = large_share * likelihood(nu - c.nlos_bias_large, S + c.nlos_bias_large_var)
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
        # Without a state for the bias, NLOS is a range that is worse.
        stays if at > 0 else near + far,
        exponential(evidence),
    )
    wild = outlier_density(c)
    return switched, total / (total + wild), of_range + wild, far / max(near + far, 1e-300)


@small_kernel
def reset_bias_on_transition(c, s, h, p, switched, is_far):
    """Forget the slow error of a pair by the probability that its sight changed.

    A new one is of the large ones with the probability `is_far`, a mixture taken for a Gaussian.
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
    # Of the mixture of both; pending updates hold what has been taken off already.
    s.P[h, at, at] += switched * stays * before + switched * new_var + switched * stays * off * off
    s.x[h, at] -= switched * off
