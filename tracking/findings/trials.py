"""Trials of the tracker on the beginning of a recording, with some of it changed.

Wrong axes, clocks and calibrations show in how likely ranges are, given all that came before them:
what is right makes them likeliest [1, sec. 5.4]. What explains a recording has to do so in both
halves of its beginning.

References:
    [1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
        Wiley 2001.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from tracking.ahrs.orientation import Orientation
from tracking.arrays import F64, Bool
from tracking.filters.joint import JointEkf
from tracking.filters.joint.params import JointParams, NoiseLearningParams
from tracking.log.folder import Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.blocks import usable
from tracking.tracker import TrackerParams

T = TypeVar("T")
LONGEST = 60.0
"""[s] Length of the beginning."""
BEFORE = 5.0
"""[s] Inertial samples before its first range, which find the orientation."""
PLAUSIBLE = -0.8
"""[-] What explains a recording leaves less surprise, at the usual noise of ranges: a group that is
lost has more, with a range in seven an outlier; right sensors leave -2.7 to -1.1."""
PARAMS = replace(
    JointParams(noise_learning=NoiseLearningParams(learns=False)),
    nlos=replace(JointParams().nlos, nlos_bias_length=2.0),
    nlos_in_space=replace(JointParams().nlos_in_space, nlos_bias_length=2.0),
)
"""Neither learned noise nor a lasting excess may explain what is wrong with a recording."""


class Explained(NamedTuple):
    """What makes ranges likelier than they are as recorded."""

    at: float
    """Where they are likeliest."""
    is_within: bool
    """False at the ends of the trials: it may be further off."""
    gain: float
    """Log-likelihood of a range, in the half where it gains less [-]."""
    halves: tuple[float, float]
    """Where they are likeliest in either half."""


Progress = Callable[[float], None]
"""Called with the share done, 0 to 1."""


class Misfit(NamedTuple):
    """How badly the ranges of a recording fit."""

    surprise: F64
    """Mean negative log-likelihood of a range but for a constant, (half) [-]."""
    nis: F64
    """Mean NIS of the ranges that are no outliers, (half) [-]."""


def beginning(log: Log) -> MeasurementBlock:
    """The events that trials are made with."""
    (first, last), t = log.t_range, log.block.t[0]
    return log.block.take((t > first - BEFORE) & (t <= min(first + LONGEST, last)))


def params_of(log: Log) -> JointParams:
    """What the filter assumes of a recording: its white noise of ranges, where that is known."""
    error = PARAMS.range_error
    if log.range_noise is None:
        return PARAMS
    return replace(PARAMS, range_error=replace(error, white_std=log.range_noise))


def most_surprise(log: Log) -> float:
    """Surprise of a range above which a group is lost: with more noise there is more of it."""
    white, usual = params_of(log).range_error.white_std, PARAMS.range_error.white_std
    return PLAUSIBLE + max(float(np.log(white / usual)), 0.0)


def misfit(log: Log, block: MeasurementBlock, params: JointParams | None = None) -> Misfit:
    """How badly the ranges of a block fit.

    Args:
        log: The recording.
        block: Its beginning, changed or not; halves are those of the recording's time.
        params: What the filter assumes; that of `params_of` by default.
    """
    first, last = log.t_range
    middle = first + 0.5 * min(LONGEST, last - first)
    states = Orientation(log.constellation, TrackerParams().orientation, follows_bias=True)
    events = states.step(usable(block))
    tracker = JointEkf(log.constellation, params or params_of(log))
    sums = np.zeros((3, 4))
    for half in range(2):
        t = events.t[0]
        part = events.take(t <= middle if half == 0 else t > middle)
        tracker.run(part, np.zeros((1, 0)))
        sums[half + 1] = tracker.fit_sums()[0]
    loglik, count, nis, accepted = np.diff(sums, axis=0).T
    return Misfit(-loglik / np.maximum(count, 1), nis / np.maximum(accepted, 1))


def best(
    cost: Callable[[float], F64], at: F64, least: float, most: float, than: F64 | None = None
) -> Explained | None:
    """Where a cost is lowest: a parabola through the lowest of some trials and its neighbours.

    Args:
        cost: Of a trial, (half) or (2 half); all have to be lower.
        at: Trials, ascending, 0 among them.
        least: By so much they have to be lower than at 0.
        most: And the first two, the surprise in each half, lower than this (`most_surprise`).
        than: And all lower than this.

    Returns:
        What explains the recording; None where 0 is as good.
    """
    costs = np.array([cost(float(x)) for x in at])
    gains = costs[at == 0.0][0] - costs
    k = int(np.argmax(gains.min(axis=1)))
    is_better = gains[k].min() >= least and (than is None or (costs[k] < than).all())
    if not is_better or (costs[k, :2] > most).any():
        return None
    halves = tuple(_vertex(at, half)[0] for half in costs.T[:2])
    where, is_within = _vertex(at, costs.mean(axis=1), k)
    return Explained(where, is_within, float(gains[k].min()), (halves[0], halves[1]))


def _vertex(at: F64, cost: F64, k: int | None = None) -> tuple[float, bool]:
    """Where a cost is lowest, near trial k; and whether that is within the trials."""
    k = int(np.argmin(cost)) if k is None else k
    if k in (0, len(at) - 1):
        return float(at[k]), False
    a, b, _ = np.polyfit(at[k - 1 : k + 2], cost[k - 1 : k + 2], 2)
    vertex = -0.5 * b / a if a > 0.0 else at[k]
    return float(np.clip(vertex, at[k - 1], at[k + 1])), True


def through(items: Sequence[T], again: int, progress: Progress) -> Iterator[T]:
    """Items one after the other, with progress: the first round of them is half of the whole.

    Args:
        items: What is tried.
        again: Rounds before this one; each takes half of what is left.
        progress: Called before each item.
    """
    for k, item in enumerate(items):
        progress(1.0 - 0.5**again * (1.0 - 0.5 * k / len(items)))
        yield item


def of_nodes(block: MeasurementBlock, nodes: tuple[int, ...]) -> Bool:
    """True for samples of the IMUs and magnetometers of some nodes, (event)."""
    own = np.isin(block.kind[0], (Kind.IMU, Kind.MAG)) & np.isin(block.i[0], nodes)
    return np.asarray(own)


def moved_in_time(block: MeasurementBlock, by: float, which: Bool) -> MeasurementBlock:
    """Events moved by a time [s]; in order."""
    t = block.t.copy()
    t[0, which] += by
    moved = replace(block, t=t)
    return moved.take(moved.order()[0])
