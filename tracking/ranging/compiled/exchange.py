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
"""[1] Variance of a clock skew of which nothing is known yet."""


class ExchangeNumbers(NamedTuple):
    """`ExchangeParams` and `ClockParams` as plain numbers; the units are theirs."""

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
    """Variance of a clock skew after so many ticks [1]: it wanders, the mean does not."""
    dt = min(max(elapsed, 0) / TICK_HZ, 10.0)
    return min(var + p.wander * dt, FIRST_VAR)


@small_kernel
def take_carrier(p, mean, var, offset):
    """Mean and variance of a clock skew after a reading of the carrier offset [1]."""
    if not abs(offset) <= p.max_skew:  # nor if it is no number
        return mean, var
    gain = var / (var + p.carrier_var)
    return mean + gain * (offset - mean), (1.0 - gain) * var


@small_kernel
def take_interval(p, mean, var, misfits, received, sent):
    """Take the stamps of two messages of one sender.

    Args:
        p: Beliefs.
        mean: Clock skew so far: how much faster the receiver's clock runs [1].
        var: Its variance.
        misfits: Intervals in a row that did not fit.
        received: Between the two receptions, receiver's ticks.
        sent: Between the two transmissions, sender's ticks.

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
    """Distance of an asker and an answering node [m], or a negative number if none can be told.

    With the skew of the interval since the answering node's last message this is an
    asymmetric double-sided exchange: clock rates cancel to first order, and a distance that
    changes evenly comes out as it was when the asker sent.

    Args:
        p: Beliefs.
        round_trip: From the asker's transmission to the answer's reception, asker's ticks.
        reply: From reception to transmission at the answering node, its ticks.
        fit: What `take_interval` said of that interval.
        skew: Its skew: how much faster the asker's clock runs than the answering one's [1].
        mean: The skew by all that is known, for want of a fresh interval.
        var: Its variance.
    """
    if reply <= 0 or reply > p.max_reply * TICK_HZ or fit == MISFIT:
        return -1.0
    if fit == NO_INTERVAL:
        if 0.5 * SPEED_OF_LIGHT * (reply / TICK_HZ) * math.sqrt(var) > p.max_error:
            return -1.0
        skew = mean
    distance = METRES_PER_TICK * (0.5 * ((round_trip - reply) - reply * skew))
    return distance if distance <= p.max_distance else -1.0
