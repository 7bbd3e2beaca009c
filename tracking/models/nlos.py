"""Line of sight of a pair: a hidden Markov chain of two states, LOS and NLOS.

Between two ranges, transitions to NLOS and to LOS have rates a and b, and over dt the probabilities

    a / (a + b) (1 - exp(-(a + b) dt)),    b / (a + b) (1 - exp(-(a + b) dt))

The slow range error includes the NLOS bias. So without a transition a range is predicted as it is;
a transition to NLOS adds a bias, one to LOS removes the slow error. Bayes' rule over the four
transitions gives the probability of NLOS; the Gaussian sum is collapsed after each (GPB1 [1]). If
the difference of received and first-path power is reported, it is additional evidence.

References:
    [1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
        Wiley 2001, section 11.6.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import exponential

SQRT_2PI = math.sqrt(2.0 * math.pi)


@small_kernel
def power_evidence(c, gap):
    """Return the log-likelihood ratio of NLOS against LOS for a power difference [dB]."""
    los = max(gap - c.power_diff_los, 0.0) / c.power_diff_los_std
    nlos = min(gap - c.power_diff_nlos, 0.0) / c.power_diff_nlos_std
    ratio = 0.5 * (los * los - nlos * nlos) - math.log(c.power_diff_nlos_std / c.power_diff_los_std)
    return min(max(c.power_diff_weight * ratio, -c.power_diff_most), c.power_diff_most)


@small_kernel
def transition_probs(los_to_nlos_rate, nlos_to_los_rate, dt):
    """Return the probabilities of a transition to NLOS and to LOS over dt [s]."""
    changes = (1.0 - exponential(-(los_to_nlos_rate + nlos_to_los_rate) * dt)) / (
        los_to_nlos_rate + nlos_to_los_rate
    )
    return los_to_nlos_rate * changes, nlos_to_los_rate * changes


@small_kernel
def nlos_posterior(c, before, enter, leave, los_like, enter_like, leave_like, nlos_like, odds):
    """Apply Bayes' rule to the four transitions.

    Args:
        c: Coefficients.
        before: Probability of NLOS before.
        enter: Probability of a transition to NLOS.
        leave: Probability of a transition to LOS.
        los_like: Likelihood of the range, LOS before and after.
        enter_like: Likelihood after a transition to NLOS.
        leave_like: Likelihood after a transition to LOS.
        nlos_like: Likelihood, NLOS before and after.
        odds: Likelihood ratio of NLOS against LOS from the powers.

    Returns:
        Probability of NLOS; probability of a transition; likelihood of the range and its powers;
        likelihood of the range alone, as powers have no information on positions. If the total
        likelihood is below 1e-300, the probability is that before and the others are 0.
    """
    los_los = (1.0 - before) * (1.0 - enter) * los_like
    los_nlos = (1.0 - before) * enter * enter_like * odds
    nlos_los = before * leave * leave_like
    nlos_nlos = before * (1.0 - leave) * nlos_like * odds
    total = los_los + los_nlos + nlos_los + nlos_nlos
    if total < 1e-300:
        return before, 0.0, 0.0, 0.0
    after = min(max((los_nlos + nlos_nlos) / total, c.least_prob), 1.0 - c.least_prob)
    norm = 1.0 + after * (odds - 1.0) if odds > 1.0 else 1.0
    return after, (los_nlos + nlos_los) / total, total, total / norm


@small_kernel
def outlier_density(c):
    """Return the likelihood of a range that is an outlier, in the scale of `likelihood`."""
    return SQRT_2PI * c.outlier_prob / c.outlier_span
