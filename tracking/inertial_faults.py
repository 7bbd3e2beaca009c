"""Inertial samples that cannot be: a sensor that sticks, jumps, or is at the end of its scale.

The first two are dropped before the orientation filter sees them. A gyroscope that repeats one
reading turns the node for ever, and a single absurd one by half a radian; either takes tens of
seconds of magnetometer to undo. What is cut off at the end of the scale is used and doubted; but
it tells no tilt, nor do the readings about it: the largest left out, the mean acceleration of a
motion is no longer zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tracking._limit_kernels import N_LIMIT, find_limits
from tracking.arrays import F64, Bool

STUCK_AFTER = 20
"""[-] Readings in a row that are equal in all six axes; noise makes two of them rare."""
GYR_JUMP = 25.0
"""[rad/s] A change between two samples that no carrier makes."""
ACC_JUMP = 400.0
"""[m/s2] The same of the specific force."""
MAX_ODD = 3
"""[-] So many odd readings in a row are believed after all."""

WHOLE_AFTER = 100
"""[-] Readings in a row within the scale before they tell the tilt again."""


@dataclass(slots=True)
class InertialHealth:
    """What is remembered of a node's samples."""

    last: F64 | None = None
    """The last reading, (6)."""
    good: F64 | None = None
    """The last reading that was believed, (6)."""
    n_same: int = 0
    """Equal readings in a row before the last."""
    n_odd: int = 0
    """Odd readings in a row."""
    limits: F64 = field(default_factory=lambda: np.zeros((3, N_LIMIT)))
    """Of each axis of the accelerometer, see `_limit_kernels`."""
    n_whole: int = WHOLE_AFTER
    """Readings in a row within the scale of the accelerometer."""


def inspect(health: InertialHealth, samples: F64) -> tuple[F64, Bool]:
    """Samples with odd readings replaced by the one before, and where the sensor is not stuck.

    Args:
        health: Of the node, updated.
        samples: Gyroscope [rad/s] and specific force [m/s2], (sample, 6).

    Returns:
        The samples, and True where they mean anything, (sample).
    """
    before = samples[:1] if health.last is None else health.last[None]
    previous = np.concatenate([before, samples[:-1]])
    equal = (samples == previous).all(axis=1)
    equal[0] &= health.last is not None
    n_same = _run_lengths(equal, health.n_same)
    health.last, health.n_same = samples[-1].copy(), int(n_same[-1])
    usable = n_same < STUCK_AFTER
    limit = np.repeat([GYR_JUMP, ACC_JUMP], 3)
    calm = health.n_odd == 0 and not (np.abs(samples - previous) > limit).any()
    if not calm:
        samples = samples.copy()
        for k in range(len(samples)):
            odd = health.good is not None and bool((np.abs(samples[k] - health.good) > limit).any())
            health.n_odd = health.n_odd + 1 if odd else 0
            if odd and health.n_odd <= MAX_ODD:
                samples[k] = health.good
            else:
                health.good = samples[k].copy()
                health.n_odd = 0
    else:
        health.good = samples[-1].copy()
    return samples, usable


def at_limit(health: InertialHealth, accel_b: F64) -> tuple[Bool, Bool]:
    """Where the accelerometer is at the end of its scale, and where it tells the tilt.

    Args:
        health: Of the node, updated.
        accel_b: Specific force, (sample, 3) [m/s2].

    Returns:
        True for axes that are cut off, (sample, 3); True for samples that tell it, (sample).
    """
    cut = np.zeros(accel_b.shape, dtype=bool)
    health.limits = health.limits.copy()  # a saved copy of the health may share it
    find_limits(health.limits, np.ascontiguousarray(accel_b), cut)
    n_whole = _run_lengths(np.asarray(~cut.any(axis=1)), health.n_whole)
    health.n_whole = int(n_whole[-1])
    return cut, n_whole >= WHOLE_AFTER


def _run_lengths(equal: Bool, start: int) -> F64:
    """How many in a row were True up to each, the first counting on from `start`, (sample)."""
    index = np.arange(1, len(equal) + 1)
    broken = np.maximum.accumulate(np.where(equal, 0, index))
    lengths: F64 = np.where(broken > 0, index - broken, start + index)
    return np.where(equal, lengths, 0)
