"""NLOS probability of a pair, and its effect on the slow range error.

LOS and NLOS are the states of a Markov chain. The state e of the pair's filter is the slow
range error, which includes the bias in NLOS. So without a transition a range is predicted as it
is; a transition to NLOS adds a bias ``N(m, s^2)``, one to LOS removes e. Bayes' rule with the
innovation and the difference of received and first-path power gives the probability of NLOS,
and e is reset by the probability of a transition. Outliers fit neither state.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import decay, exponential, likelihood
from tracking.models.nlos import nlos_posterior, outlier_density, transition_probs
from tracking.models.range_bias import slow_error_var

E = 6
"""Index of the range error in the state of a pair."""


@small_kernel
def decay_range_error(c, s, p, h, dt):
    """Predict the range error of a pair over dt [s]: it decays with the distance travelled."""
    x, P = s.x, s.P
    v0, v1, v2 = x[p, h, 3], x[p, h, 4], x[p, h, 5]
    way = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2 + c.least_speed * c.least_speed) * dt
    hidden = s.nlos[p, h]
    keep = decay(way * ((1.0 - hidden) / c.slow_length + hidden / c.nlos_bias_length))
    x[p, h, E] = keep * x[p, h, E] + (1.0 - keep) * hidden * c.nlos_bias
    for k in range(E):
        v = keep * P[p, h, k, E]
        P[p, h, k, E] = v
        P[p, h, E, k] = v
    var = c.slow_var + hidden * c.nlos_bias_var
    P[p, h, E, E] = keep * keep * P[p, h, E, E] + (1.0 - keep * keep) * var


@small_kernel
def update_nlos_posterior(c, s, p, h, dt, nu, variance, w_e, evidence):
    """Update the NLOS probability of a pair by Bayes' rule over its transitions.

    Args:
        c: Coefficients.
        s: FilterState of one environment.
        p: Pair.
        h: Hypothesis.
        dt: Time since the pair's last range [s].
        nu: Innovation [m].
        variance: Variance of the predicted range [m2].
        w_e: Covariance of the predicted range and e [m2].
        evidence: Log-likelihood ratio of NLOS against LOS from the powers.

    Returns:
        Probability of a transition; inlier probability of the range; log-likelihood.
    """
    enter, leave = transition_probs(c.los_to_nlos_rate, c.nlos_to_los_rate, dt)
    S = variance + c.range_var
    S_leave = S + max(s.P[p, h, E, E] - 2.0 * w_e, -0.9 * variance) + c.slow_var
    stays = likelihood(nu, S)
    s.nlos[p, h], switched, total, of_range = nlos_posterior(
        c,
        s.nlos[p, h],
        enter,
        leave,
        stays,
        likelihood(nu - c.nlos_bias, S + c.nlos_bias_var),
        likelihood(nu + s.x[p, h, E], S_leave),
        stays,
        exponential(evidence),
    )
    wild = outlier_density(c)
    return switched, total / (total + wild), math.log(of_range + wild)


@small_kernel
def reset_bias_on_transition(c, s, p, h, switched):
    """Mix the range error of a pair with a new one, weighted by the transition probability."""
    stays = 1.0 - switched
    for k in range(E):
        v = stays * s.P[p, h, k, E]
        s.P[p, h, k, E] = v
        s.P[p, h, E, k] = v
    hidden = s.nlos[p, h]
    new_var = slow_error_var(c.slow_var, hidden, c.nlos_bias, c.nlos_bias_var)
    off = s.x[p, h, E] - hidden * c.nlos_bias
    s.P[p, h, E, E] = stays * s.P[p, h, E, E] + switched * (new_var + stays * off * off)
    s.x[p, h, E] -= switched * off
