"""Trial runs of the tracker on changed copies of the beginning of a recording.

Wrong axes, clocks and calibrations reduce the likelihood of ranges given all earlier ones, which
is largest for the right ones [1, sec. 5.4]. An explanation has to hold in both halves of the
beginning.

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
from tracking.filters.joint.params import JointParams, NlosParams, NoiseLearningParams
from tracking.log.folder import Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.blocks import usable
from tracking.tracker import TrackerParams

T = TypeVar("T")
LONGEST = 60.0
"""[s] Length of the beginning."""
BEFORE = 5.0
"""[s] Time of inertial samples before the first range, for the orientation to converge."""
PLAUSIBLE = -0.8
"""[-] Largest surprise of an explanation, at the usual noise of ranges: a lost group has more,
with one range in seven an outlier; right sensors leave -2.7 to -1.1."""
PARAMS = replace(
    JointParams(noise_learning=NoiseLearningParams(learns=False)),
    nlos=NlosParams(nlos_bias_length=2.0),
    nlos_in_space=replace(JointParams().nlos_in_space, nlos_bias_length=2.0),
)
"""Parameters without learned noise and lasting excess, which would explain faults."""


class Explained(NamedTuple):
    """A change of a recording that makes its ranges likelier."""

    at: float
    """Likeliest change."""
    is_within: bool
    """False at the ends of the trials: the optimum may be beyond."""
    gain: float
    """Gain in log-likelihood of a range, in the half with the smaller gain [-]."""
    halves: tuple[float, float]
    """Likeliest change in each half."""


Progress = Callable[[float], None]
"""Function called with the completed share, 0 to 1."""


class Misfit(NamedTuple):
    """Misfit of the ranges of a recording."""

    surprise: F64
    """Mean negative log-likelihood of a range up to a constant, (half) [-]."""
    nis: F64
    """Mean NIS of the ranges that are not outliers, (half) [-]."""


def beginning(log: Log) -> MeasurementBlock:
    """Return the events for trials."""
    (first, last), t = log.t_range, log.block.t[0]
    return log.block.take((t > first - BEFORE) & (t <= min(first + LONGEST, last)))


def params_of(log: Log) -> JointParams:
    """Return the filter parameters for a recording, with its white noise of ranges if known."""
    error = PARAMS.range_error
    if log.range_noise is None:
        return PARAMS
    return replace(PARAMS, range_error=replace(error, white_std=log.range_noise))


def most_surprise(log: Log) -> float:
    """Return the surprise of a range above which a group is lost; it grows with the noise."""
    white, usual = params_of(log).range_error.white_std, PARAMS.range_error.white_std
    return PLAUSIBLE + max(float(np.log(white / usual)), 0.0)


def misfit(log: Log, block: MeasurementBlock, params: JointParams | None = None) -> Misfit:
    """Compute the misfit of the ranges of a block.

    Args:
        log: A recording.
        block: Its beginning, changed or not; halves are in the time of the recording.
        params: Parameters of the filter; `params_of` by default.
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
    """Find the minimum of a cost: a parabola through the best trial and its neighbours.

    Args:
        cost: Costs of a trial, (half) or (2 half); all have to decrease.
        at: Trials, ascending, 0 among them.
        least: Least decrease of the costs from 0.
        most: Upper limit of the first two costs, the surprise in each half (`most_surprise`).
        than: Upper limits of all costs.

    Returns:
        The explanation of the recording; None if 0 is as good.
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
    """Return the minimum of a cost near trial k, and whether it is within the trials."""
    k = int(np.argmin(cost)) if k is None else k
    if k in (0, len(at) - 1):
        return float(at[k]), False
    a, b, _ = np.polyfit(at[k - 1 : k + 2], cost[k - 1 : k + 2], 2)
    vertex = -0.5 * b / a if a > 0.0 else at[k]
    return float(np.clip(vertex, at[k - 1], at[k + 1])), True


def through(items: Sequence[T], again: int, progress: Progress) -> Iterator[T]:
    """Yield items with progress; the first round of items is half of the whole.

    Args:
        items: Items to try.
        again: Number of earlier rounds; each takes half of the rest.
        progress: Called before each item.
    """
    for k, item in enumerate(items):
        progress(1.0 - 0.5**again * (1.0 - 0.5 * k / len(items)))
        yield item


def of_nodes(block: MeasurementBlock, nodes: tuple[int, ...]) -> Bool:
    """Return a mask of samples of the IMUs and magnetometers of some nodes, (event)."""
    own = np.isin(block.kind[0], (Kind.IMU, Kind.MAG)) & np.isin(block.i[0], nodes)
    return np.asarray(own)


def moved_in_time(block: MeasurementBlock, by: float, which: Bool) -> MeasurementBlock:
    """Shift some events by a time [s], and restore the order."""
    t = block.t.copy()
    t[0, which] += by
    moved = replace(block, t=t)
    return moved.take(moved.order()[0])
