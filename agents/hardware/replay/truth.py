"""Time offset between a recording and a log with ground truth, and errors of the replay.

The offset minimises the difference between recorded ranges and true distances at their times. Any
log works in which the nodes move, such as that of an emulation or of a motion-capture system.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agents.errors import UsageError
from agents.hardware.replay.result import Scored
from tracking.arrays import F64, Bool
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.log import Log
from tracking.log.truth import Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.score import errors_after, score

MOST_RANGES = 3000
"""[-] Approximate number of ranges compared; more improve the offset too little for their cost."""
COARSE = 0.05
"""[s] Step of the first search."""
FINEST = 1e-4
"""[s] Step of the last search."""
LEAST_SHARE = 0.5
"""[-] Smallest share of ranges within the truth, relative to the largest possible number."""
LEAST_RANGES = 50
CLIP = 1.0
"""[m] Upper limit of a difference, since NLOS ranges are wrong at any offset."""
ASIDE = 1.0
"""[s] Distance to both sides of the best offset at which the fit must be clearly worse."""
FLAT = 0.8
"""[-] Largest ratio of the mean difference at the best offset to that at both sides."""


def score_replay(
    estimate: TeamEstimate,
    block: MeasurementBlock,
    log: Log,
    *,
    offset: float | None = None,
    skip: float = 10.0,
) -> Scored:
    """Score the estimates of a replay.

    Args:
        estimate: Estimates, arrays (decision, ...).
        block: Measurements of the recording.
        log: Log with the truth of the same nodes.
        offset: Offset from times of the log to times of the recording [s]; None estimates it.
        skip: Time after the first range that is not scored [s].

    Raises:
        UsageError: The log has no truth of these nodes, or no offset is clearly best.
    """
    group = estimate.constellation
    truth = truth_of(log, group)
    if offset is None:
        offset = find_offset(truth, block, group)
    truth_ij_w, has_truth = truth.pairs(group, estimate.t - offset)
    ranged = block.t[0][block.kind[0] == Kind.RANGE]
    first = float(ranged.min()) if len(ranged) else 0.0
    figures = score(estimate, truth_ij_w, has_truth, first + skip)
    yaw = np.radians(figures.yaw_deg or 0.0)
    errors = errors_after(estimate, truth_ij_w, yaw)[..., : group.dimensions]
    return Scored(
        score=figures,
        errors=np.linalg.norm(errors, axis=-1),
        offset=offset,
        truth_ij_w=truth_ij_w,
        has_truth=has_truth,
    )


def truth_of(log: Log, group: Constellation) -> Truth:
    """Return the truth of a log for the nodes of a group, matched by node id.

    Raises:
        UsageError: The log has no truth of two nodes of the group.
    """
    ids = np.array([group.index_of.get(node, -1) for node in log.constellation.ids])
    node = ids[log.truth.node] if len(log.truth.t) else log.truth.node
    truth = replace(log.truth, node=node, valid=log.truth.valid & (node >= 0))
    if len(np.unique(truth.node[truth.valid])) < 2:
        raise UsageError(f"--truth {log.name}: has no truth of two nodes of the recording")
    return truth


def find_offset(truth: Truth, block: MeasurementBlock, group: Constellation) -> float:
    """Return the offset from times of the truth to times of the measured ranges [s].

    Args:
        truth: Truth of the nodes of the group.
        block: Measurements; environment 0 is used.
        group: Constellation of the nodes.

    Raises:
        UsageError: No offset is clearly best: too few ranges, or nodes that hardly move.
    """
    block = block.env(0)
    ranges = np.nonzero(block.kind[0] == Kind.RANGE)[0]
    chosen = ranges[:: max(1, len(ranges) // MOST_RANGES)]
    t, i, j = block.t[0, chosen], block.i[0, chosen], block.j[0, chosen]
    distance = block.values[0, chosen, 0]
    refuse = UsageError("--truth: expected nodes that move in sight of each other; say how many "
                        "seconds to add to its times with --truth-offset")  # fmt: skip
    if len(chosen) < LEAST_RANGES:
        raise refuse
    t_truth = truth.times()
    most = len(chosen) * min(1.0, (t_truth[-1] - t_truth[0]) / max(t[-1] - t[0], COARSE))

    def cost(offset: float) -> float:
        difference, known = _differences(truth, group, t - offset, i, j, distance)
        n = int(known.sum())
        if n < max(LEAST_SHARE * most, LEAST_RANGES):
            return CLIP
        return float(np.minimum(difference[known], CLIP).mean())

    lowest, highest = float(t[0] - t_truth[-1]), float(t[-1] - t_truth[0])
    tried = np.arange(lowest, highest, COARSE)
    costs = np.array([cost(offset) for offset in tried])
    best, step = float(tried[np.argmin(costs)]), COARSE
    # All three means are over the same ranges, so that they differ only by the offset.
    here, *aside = (_differences(truth, group, t - best - shift, i, j, distance)
                    for shift in (0.0, -ASIDE, ASIDE))  # fmt: skip
    known = here[1] & aside[0][1] & aside[1][1]
    means = [float(np.minimum(each[known], CLIP).mean()) if known.any() else CLIP
             for each, _ in (here, *aside)]  # fmt: skip
    if means[0] > FLAT * min(means[1:]):
        raise refuse
    while step > FINEST:
        step /= 3.0
        near = best + step * np.arange(-3, 4)
        best = float(near[np.argmin([cost(offset) for offset in near])])
    return best


def _differences(
    truth: Truth, group: Constellation, t: F64, i: F64, j: F64, distance: F64
) -> tuple[F64, Bool]:
    """Return absolute range errors against the truth (range) [m], and where the truth is known."""
    pos, known = truth.positions(group, t)
    rows = np.arange(len(t))
    along = np.linalg.norm(pos[rows, j] - pos[rows, i], axis=-1)
    return np.abs(along - distance), known[rows, i] & known[rows, j]
