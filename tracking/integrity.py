"""Integrity: how long a pair is reported OK and is wrong by more than its covariance allows.

A position error e is *wrong while OK* where the pair's status is OK, ``|e|`` exceeds `LIMIT` and
``|e|`` exceeds `SIGMAS` standard deviations along e, ``sqrt(e^T P e) / |e|``. The whole run counts,
from its first estimate on: the start is where a tracker is most likely to be wrong.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import TeamEstimate

LIMIT = 0.3
"""[m] Smaller errors do no harm."""
SIGMAS = 3.0
"""[-] Standard deviations along the error."""


def wrong_while_ok(estimate: TeamEstimate, truth_ij_w: F64) -> Bool:
    """Where pairs are OK and wrong, (time, pair).

    Args:
        estimate: Of one run, arrays over (time, pair).
        truth_ij_w: True relative positions in the frame of the estimate, (time, pair, 3) [m].
    """
    d = estimate.constellation.dimensions
    e = (estimate.pos_ij_w - truth_ij_w)[..., :d]
    error = np.linalg.norm(e, axis=-1)
    along = np.einsum("...i,...ij,...j->...", e, estimate.cov[..., :d, :d], e)
    std = np.sqrt(np.maximum(along, 0.0)) / np.maximum(error, 1e-12)
    return np.asarray(estimate.ok & (error > LIMIT) & (error > SIGMAS * std))


def longest(t: F64, flags: Bool) -> float:
    """Longest time in one go for which a pair is flagged [s].

    Args:
        t: Ascending times, (time) [s]; each stands for the time until the next.
        flags: (time, pair).
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
