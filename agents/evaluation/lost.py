"""When a run is lost: a pair is wrong for longer than a wrong measurement explains."""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import Status, TeamEstimate

WRONG = 1.0
"""[m] A position error above this is wrong."""
FOR = 1.0
"""[s] So long in one go makes a run lost."""
GRACE = 10.0
"""[s] After the first range a filter must have found its pairs, whatever its status says."""


def converged_at(estimate: TeamEstimate, first: float) -> float:
    """When all pairs were ok at once for the first time, at most `GRACE` after the first range [s].

    Args:
        estimate: Of one run, arrays over (time, pair).
        first: Time of the first range [s].
    """
    ok = estimate.t[estimate.ok.all(axis=1)]
    return min(float(ok[0]) if len(ok) else np.inf, first + GRACE)


def lost_at(estimate: TeamEstimate, truth_ij_w: F64, has_truth: Bool, first: float) -> float | None:
    """When a run was lost, None if never [s].

    From `converged_at` on, a pair is wrong where its position is off by more than `WRONG`, or
    where it has none. The run is lost when the same pair was wrong for longer than `FOR`.

    Args:
        estimate: Of one run, arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        has_truth: Where they are known, (time, pair).
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
