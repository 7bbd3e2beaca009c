"""Whether a range was line of sight, and what its lasting error does meanwhile.

A pair is in sight or not, a Markov chain of two states. The state e of its filter is the part
of the range's error that lasts; behind an obstacle it holds the excess as well. So in sight
before and after, or in neither, a range is predicted as it is; entering adds an excess
``N(m, s^2)``, leaving takes e away. Bayes' rule with the innovation and with the gap between
received and first-path power gives the probability of no sight, and e is forgotten by the
probability that the sight changed. A few ranges mean nothing and fit neither case.
"""

from __future__ import annotations

import math

from tracking.jit import small_kernel
from tracking.maths.exponentials import decay, exponential, likelihood

E = 6
"""Place of the range error in the state."""
MIN_PROB = 1e-4
SQRT_2PI = math.sqrt(2.0 * math.pi)


@small_kernel
def power_evidence(c, gap):
    """Log-likelihood ratio of no sight against sight, of a power gap [dB]."""
    los = max(gap - c.gap_los, 0.0) / c.gap_los_std
    nlos = min(gap - c.gap_nlos, 0.0) / c.gap_nlos_std
    ratio = 0.5 * (los * los - nlos * nlos) - math.log(c.gap_nlos_std / c.gap_los_std)
    return min(max(c.gap_weight * ratio, -4.0), 4.0)


@small_kernel
def decay_range_error(c, s, p, h, dt):
    """Carry the range error of a pair over dt [s]: it fades with the way travelled."""
    x, P = s.x, s.P
    v0, v1, v2 = x[p, h, 3], x[p, h, 4], x[p, h, 5]
    way = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2 + c.least_speed * c.least_speed) * dt
    hidden = s.nlos[p, h]
    keep = decay(way * ((1.0 - hidden) / c.slow_length + hidden / c.excess_length))
    x[p, h, E] = keep * x[p, h, E] + (1.0 - keep) * hidden * c.excess
    for k in range(E):
        v = keep * P[p, h, k, E]
        P[p, h, k, E] = v
        P[p, h, E, k] = v
    var = c.slow_var + hidden * c.excess_var
    P[p, h, E, E] = keep * keep * P[p, h, E, E] + (1.0 - keep * keep) * var


@small_kernel
def update_nlos_posterior(c, s, p, h, dt, nu, variance, w_e, evidence):
    """Bayes' rule over what the sight was and is; updates the pair's NLOS probability.

    Args:
        c: Coefficients.
        s: FilterState of one environment.
        p: Pair.
        h: Hypothesis.
        dt: Time since the pair's last range [s].
        nu: Innovation [m].
        variance: Of the prediction [m2].
        w_e: Covariance of the prediction and e [m2].
        evidence: Of the power gap.

    Returns:
        Probability that the sight changed; that the range meant anything; log-likelihood.
    """
    before = s.nlos[p, h]
    rates = c.enter_rate + c.leave_rate
    changes = (1.0 - exponential(-rates * dt)) / rates
    enter, leave = c.enter_rate * changes, c.leave_rate * changes
    S = variance + c.range_var
    nu_leave = nu + s.x[p, h, E]
    S_leave = S + max(s.P[p, h, E, E] - 2.0 * w_e, -0.9 * variance) + c.slow_var
    hidden = exponential(evidence)
    stays = likelihood(nu, S)
    los_los = (1.0 - before) * (1.0 - enter) * stays
    los_nlos = (1.0 - before) * enter * likelihood(nu - c.excess, S + c.excess_var)
    nlos_los = before * leave * likelihood(nu_leave, S_leave)
    nlos_nlos = before * (1.0 - leave) * stays
    los_nlos *= hidden
    nlos_nlos *= hidden
    wild = SQRT_2PI * c.outlier_prob / c.outlier_span
    total = los_los + los_nlos + nlos_los + nlos_nlos
    if total < 1e-300:
        return 0.0, 0.0, math.log(wild)
    after = min(max((los_nlos + nlos_nlos) / total, MIN_PROB), 1.0 - MIN_PROB)
    s.nlos[p, h] = after
    # The power says nothing about where the nodes are: it is no evidence for a hypothesis.
    norm = 1.0 + after * (hidden - 1.0) if hidden > 1.0 else 1.0
    return (los_nlos + nlos_los) / total, total / (total + wild), math.log(total / norm + wild)


@small_kernel
def reset_bias_on_transition(c, s, p, h, switched):
    """Forget the range error of a pair by the probability that its sight changed."""
    stays = 1.0 - switched
    for k in range(E):
        v = stays * s.P[p, h, k, E]
        s.P[p, h, k, E] = v
        s.P[p, h, E, k] = v
    hidden = s.nlos[p, h]
    new_var = c.slow_var + hidden * c.excess_var + hidden * (1.0 - hidden) * c.excess * c.excess
    off = s.x[p, h, E] - hidden * c.excess
    s.P[p, h, E, E] = stays * s.P[p, h, E, E] + switched * (new_var + stays * off * off)
    s.x[p, h, E] -= switched * off
