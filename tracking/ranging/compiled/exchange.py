"""Kernels of the exchange: from receive and transmit stamps to clock skew and distance.

All intervals are in ticks of the clock that stamped both of their ends. Times of stamps are
integers without wraps; a difference is taken before anything becomes a float. `p` is an
`ExchangeNumbers` everywhere.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from tracking.kernels.jit import small_kernel
from tracking.ranging.frames.timestamps import METRES_PER_TICK, SPEED_OF_LIGHT, TICK_HZ

NO_INTERVAL, FITS, MISFIT = 0, 1, 2
FIRST_VAR = (30e-6) ** 2
"""[1] Initial variance of a clock skew."""


class ExchangeNumbers(NamedTuple):
    """`ExchangeParams` and `ClockParams` as plain numbers, in their units."""

    max_skew: float
    carrier_var: float
    stamp_std: float
    wander: float
    jump: float
    max_interval: float
    patience: int
    max_distance: float
    max_reply: float
    max_error: float


@small_kernel
def predict_skew(p, var, elapsed):
    """Predict the variance of a clock skew over elapsed ticks [1]; the mean stays."""
    dt = min(max(elapsed, 0) / TICK_HZ, 10.0)
    return min(var + p.wander * dt, FIRST_VAR)


@small_kernel
def take_carrier(p, mean, var, offset):
    """Return mean and variance of a clock skew after a reading of the carrier offset [1]."""
    if not abs(offset) <= p.max_skew:  # also if it is not a number
        return mean, var
    gain = var / (var + p.carrier_var)
    return mean + gain * (offset - mean), (1.0 - gain) * var


@small_kernel
def take_interval(p, mean, var, misfits, received, sent):
    """Update a clock skew by the stamps of two messages of one sender.

    Args:
        p: ExchangeNumbers.
        mean: Clock skew so far: how much faster the receiver's clock runs [1].
        var: Variance of the clock skew.
        misfits: Number of consecutive intervals that did not fit.
        received: Interval of the two receptions, receiver's ticks.
        sent: Interval of the two transmissions, sender's ticks.

    Returns:
        NO_INTERVAL, FITS or MISFIT; the skew of the interval; mean, var, misfits after it.
    """
    if sent <= 0 or received <= 0 or sent > p.max_interval * TICK_HZ:
        return NO_INTERVAL, 0.0, mean, var, misfits
    skew = (received - sent) / sent
    room = p.jump / (METRES_PER_TICK * sent)
    std = p.stamp_std * TICK_HZ / sent
    if abs(skew) > p.max_skew + room:
        return MISFIT, skew, mean, var, misfits
    if abs(skew - mean) > room + 5.0 * math.sqrt(var):
        if misfits + 1 >= p.patience:
            return MISFIT, skew, skew, 2.0 * std * std, 0
        return MISFIT, skew, mean, var, misfits + 1
    gain = var / (var + 2.0 * std * std)
    return FITS, skew, mean + gain * (skew - mean), (1.0 - gain) * var, 0


@small_kernel
def exchange_distance(p, round_trip, reply, fit, skew, mean, var):
    """Return the distance of asker and answerer [m], or a negative number if it is unknown.

    With the skew of the interval since the answerer's last message this is an asymmetric
    double-sided exchange: clock rates cancel to first order, and a distance that changes at a
    constant rate is that of the asker's transmission.

    Args:
        p: ExchangeNumbers.
        round_trip: From the asker's transmission to the answer's reception, asker's ticks.
        reply: From reception to transmission at the answerer, its ticks.
        fit: Result of `take_interval` for that interval.
        skew: Skew of the interval: how much faster the asker's clock runs than the answerer's [1].
        mean: Estimated skew, used without a fresh interval.
        var: Variance of `mean`.
    """
    if reply <= 0 or reply > p.max_reply * TICK_HZ or fit == MISFIT:
        return -1.0
    if fit == NO_INTERVAL:
        if 0.5 * SPEED_OF_LIGHT * (reply / TICK_HZ) * math.sqrt(var) > p.max_error:
            return -1.0
        skew = mean
    distance = METRES_PER_TICK * (0.5 * ((round_trip - reply) - reply * skew))
    return distance if distance <= p.max_distance else -1.0
