"""Integrity: error limits of OK pairs, and durations of wrong ones.

A position error e is *wrong while OK* if the pair's status is OK, ``|e|`` exceeds `LIMIT` and
``|e|`` exceeds `SIGMAS` standard deviations along e, ``sqrt(e^T P e) / |e|``. The whole run counts
from its first estimate: a tracker is most likely to be wrong at the start.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate
from tracking.vehicles import VEHICLES

LIMIT = 0.3
"""[m] Largest harmless error."""
SIGMAS = 3.0
"""[-] Standard deviations along the error."""


def protection_radius(estimate: TeamEstimate) -> F64:
    """Return the protection radius of every pair.

    Args:
        estimate: Arrays over (..., pair), from `joint` with the vehicles of `VEHICLES`.

    Returns:
        Radius about the estimated relative position, (..., pair) [m]: the expected error times
        `VehicleParams.protection`; infinite where the pair is not OK.
    """
    constellation = estimate.constellation
    of_node = np.array(
        [0.0 if n.kind == "static" else VEHICLES[n.vehicle].protection for n in constellation.nodes]
    )
    d = constellation.dimensions
    expected = np.sqrt(np.trace(estimate.cov[..., :d, :d], axis1=-2, axis2=-1))
    radius = of_node[constellation.pairs].max(axis=1) * expected
    return np.asarray(np.where(estimate.ok, radius, np.inf))


def wrong_while_ok(estimate: TeamEstimate, truth_ij_w: F64) -> Bool:
    """Return a mask of pairs that are OK and wrong, (time, pair).

    Args:
        estimate: Estimate of one run, arrays over (time, pair).
        truth_ij_w: True relative positions in the frame of the estimate, (time, pair, 3) [m].
    """
    d = estimate.constellation.dimensions
    e = (estimate.pos_ij_w - truth_ij_w)[..., :d]
    error = np.linalg.norm(e, axis=-1)
    along = np.einsum("...i,...ij,...j->...", e, estimate.cov[..., :d, :d], e)
    std = np.sqrt(np.maximum(along, 0.0)) / np.maximum(error, 1e-12)
    return np.asarray(estimate.ok & (error > LIMIT) & (error > SIGMAS * std))


def beyond_protection(estimate: TeamEstimate, truth_ij_w: F64, judged: Bool) -> float | None:
    """Return the share of OK positions whose error exceeds their protection radius.

    Args:
        estimate: Estimate of one run, arrays over (time, pair).
        truth_ij_w: True relative positions in the frame of the estimate, (time, pair, 3) [m].
        judged: Mask of known true positions, (time, pair).
    """
    d = estimate.constellation.dimensions
    counted = judged & estimate.ok
    if not counted.any():
        return None
    error = np.linalg.norm((estimate.pos_ij_w - truth_ij_w)[..., :d], axis=-1)
    return float(np.mean((error > protection_radius(estimate))[counted]))


def longest(t: F64, flags: Bool) -> float:
    """Return the longest uninterrupted time for which a pair is flagged [s].

    Args:
        t: Ascending times, (time) [s]; each is valid until the next.
        flags: Flags of the pairs, (time, pair).
    """
    if not flags.any():
        return 0.0
    until = np.append(t[1:], t[-1])
    most = 0.0
    for of_pair in flags.T:
        steps = np.diff(np.concatenate([[0], of_pair.astype(np.int64), [0]]))
        begin, end = np.nonzero(steps == 1)[0], np.nonzero(steps == -1)[0] - 1
        if len(begin):
            most = max(most, float((until[end] - t[begin]).max()))
    return most
