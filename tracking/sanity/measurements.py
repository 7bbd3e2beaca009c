"""Marks of usable measurements, of their powers, and of quaternions to normalise."""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel

# Plain numbers of `Kind`: kernels do not know enums.
STATE, SURVEY, RANGE = 3, 4, 5
FARTHEST = 1000.0
"""[m] Largest range of UWB radios."""
UNIT, NEAR_UNIT = 1e-3, 0.1
"""[-] Deviations of a quaternion's length from 1: accepted, and normalised."""


@kernel
def mark_usable(t, kind, i, j, values, valid, has_power, odd):
    """Clear the marks of impossible measurements.

    Args:
        t: Times of the block, (env, event) [s].
        kind: Kinds of the events, (env, event).
        i: Nodes of the events, (env, event).
        j: Other nodes of the events, (env, event).
        values: Measured values, (env, event, N_VALUES).
        valid: False for padding, (env, event), written.
        has_power: True for ranges with powers, (env, event), written.
        odd: True for quaternions to normalise, (env, event), written.

    Returns:
        True if any mark differs from the input.
    """
    changed = False
    for e in range(t.shape[0]):
        for k in range(t.shape[1]):
            odd[e, k] = False
            if not valid[e, k]:
                continue
            v, what, good = values[e, k], kind[e, k], math.isfinite(t[e, k])
            if what in (RANGE, SURVEY):
                good = good and 0.0 < v[0] <= FARTHEST and i[e, k] != j[e, k]
                if has_power[e, k] and not (math.isfinite(v[1]) and math.isfinite(v[2])):
                    has_power[e, k] = False
                    changed = True
            else:
                for c in range(v.shape[0]):
                    good = good and math.isfinite(v[c])
                if good and what == STATE:
                    off = abs(math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2 + v[3] ** 2) - 1.0)
                    good = off <= NEAR_UNIT
                    odd[e, k] = good and off > UNIT
            if not good or odd[e, k]:
                valid[e, k] = good
                changed = True
    return changed
