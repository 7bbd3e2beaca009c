"""Detection of lost runs: a pair is wrong for longer than wrong measurements explain."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import Status, TeamEstimate

WRONG = 1.0
"""[m] Position error above which a pair is wrong."""
FOR = 1.0
"""[s] Uninterrupted time of a wrong pair after which the run is lost."""
GRACE = 10.0
"""[s] Time after the first range from which wrong pairs count, whatever their status."""


def converged_at(estimate: TeamEstimate, first: float) -> float:
    """Return the first time when all pairs are ok, at most `GRACE` after the first range [s].

    Args:
        estimate: Estimates of one run, arrays over (time, pair).
        first: Time of the first range [s].
    """
    ok = estimate.t[estimate.ok.all(axis=1)]
    return min(float(ok[0]) if len(ok) else np.inf, first + GRACE)


def lost_at(estimate: TeamEstimate, truth_ij_w: F64, has_truth: Bool, first: float) -> float | None:
    """Return the time when a run is lost, None if never [s].

    From `converged_at` on, a pair is wrong if its position error exceeds `WRONG` or it has no
    estimate. The run is lost when the same pair has been wrong for longer than `FOR`.

    Args:
        estimate: Estimates of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        has_truth: True where `truth_ij_w` is known, (time, pair).
        first: Time of the first range [s].
    """
    t = estimate.t
    off = (estimate.pos_ij_w - truth_ij_w)[..., : estimate.constellation.dimensions]
    error = np.linalg.norm(off, axis=-1)
    absent = np.isin(estimate.status, (Status.ABSENT, Status.STARTING))
    wrong = has_truth & (absent | (error > WRONG))
    wrong &= (t >= converged_at(estimate, first))[:, None]
    found = []
    for of_pair in wrong.T:
        steps = np.diff(np.concatenate([[0], of_pair.astype(np.int64), [0]]))
        begin, end = t[np.nonzero(steps == 1)[0]], t[np.nonzero(steps == -1)[0] - 1]
        found += list(begin[end - begin > FOR] + FOR)
    return float(min(found)) if found else None
