"""Trials of the tracker on parts of a recording, with times or ranges changed.

A wrong clock or a wrong calibration shows in how well ranges fit: the mean NIS of the joint filter,
whose noise is not learned meanwhile, has its minimum at what is right. What is found on one part of
the recording has to hold on another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tracking.arrays import F64, Bool
from tracking.filters.joint.params import JointParams, NoiseLearningParams
from tracking.filters.params import FilterParams
from tracking.log.folder import Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.tracker import Tracker, TrackerParams

LONGEST = 30.0
"""[s] Length of a part."""
BEFORE = 5.0
"""[s] Inertial samples before its first range, which find the orientation."""
PARAMS = TrackerParams(
    filter=FilterParams(
        joint=replace(
            JointParams(noise_learning=NoiseLearningParams(learns=False)),
            nlos=replace(JointParams().nlos, nlos_bias_length=2.0),
            nlos_in_space=replace(JointParams().nlos_in_space, nlos_bias_length=2.0),
        )
    )
)
"""Neither learned noise nor a lasting excess may explain what is wrong with a recording."""


def parts_of(log: Log) -> list[MeasurementBlock]:
    """The first two parts of a recording."""
    (first, last), t = log.t_range, log.block.t[0]
    length = min(LONGEST, 0.5 * (last - first))
    starts = first, first + length
    return [log.block.take((t > at - BEFORE) & (t < at + length)) for at in starts]


def misfit(log: Log, block: MeasurementBlock) -> tuple[float, float]:
    """Mean NIS of the ranges of a block, and the share of time that pairs are ok [-]."""
    tracker = Tracker(log.constellation, PARAMS)
    estimate = tracker.run(block, np.arange(block.t[0, 0], block.t[0, -1], 0.5)).take(0)
    moving = ~log.constellation.is_static[log.constellation.pairs].all(axis=1)
    ok = estimate.ok[:, moving]
    return float(tracker.mean_nis()[0]), float(ok.mean()) if ok.size else 0.0


def lowest(
    costs: Callable[[int, float], tuple[float, float]], at: F64, least: float, often_ok: float
) -> tuple[float, bool] | None:
    """Where a cost is lowest: a parabola through the lowest of some trials and its neighbours.

    Args:
        costs: Cost and share of time that is ok, by part and trial.
        at: Trials, ascending, 0 among them.
        least: By so much, as a share, it has to be lower than at 0; by half on the other part.
        often_ok: A trial means something if pairs are ok for such a share of the time.

    Returns:
        Where, and whether it is within the trials; None where 0 is as good, or nothing is known.
    """
    found = np.array([costs(0, float(x)) for x in at])
    cost = np.where(np.isfinite(found[:, 0]), found[:, 0], np.inf)  # without ranges there is none
    k = int(np.argmin(cost))
    is_lower = cost[k] < (1.0 - least) * cost[at == 0.0][0]
    if not is_lower or found[k, 1] < often_ok:
        return None
    there, here = costs(1, float(at[k])), costs(1, 0.0)
    if there[0] > (1.0 - 0.5 * least) * here[0]:
        return None
    if k in (0, len(at) - 1):
        return float(at[k]), False
    near = cost[k - 1 : k + 2]
    if not np.isfinite(near).all():
        return float(at[k]), True
    (a, b, _), x = np.polyfit(at[k - 1 : k + 2], near, 2), at[k]
    return (float(-0.5 * b / a) if a > 0.0 else float(x)), True


def moved_in_time(block: MeasurementBlock, by: float, which: Bool) -> MeasurementBlock:
    """Events moved by a time [s]; in order."""
    t = block.t.copy()
    t[0, which] += by
    moved = replace(block, t=t)
    return moved.take(moved.order()[0])


def inertial(block: MeasurementBlock) -> Bool:
    """True for samples of IMUs and magnetometers, (event)."""
    return np.asarray(np.isin(block.kind[0], (Kind.IMU, Kind.MAG)))
