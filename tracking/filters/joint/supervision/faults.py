"""Fault detection: a catalogue of faults, each with its statistic, its limit and its action.

Once a period, the fault of a node or of the group with the largest ratio of statistic to limit is
acted on: statistics are squared residuals over variances (`residuals`), log-likelihood ratios as
far as these are Gaussian. Faults of a link or of missing ranges are decided with each range,
without comparison.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from tracking.filters.joint.hypotheses.alignment import CANDIDATES
from tracking.filters.joint.hypotheses.geometric_degeneracy import degeneracy_ratio
from tracking.filters.joint.supervision.residuals import (
    common_range_error,
    has_large_residual,
    is_informative,
    mean_range_error,
    node_outlier_ratio,
    others_fit,
)
from tracking.kernels.jit import kernel
from tracking.maths.elementary import decay
from tracking.maths.multilateration import misfit


class Fault(IntEnum):
    """A fault of a link, a node or the group."""

    NONE = 0
    """No fault."""
    BIAS = 1
    """All ranges of a node err alike: a wrong calibration, or an obstacle around it."""
    OUTLIERS = 2
    """Most ranges of a node are outliers, those among the others fit: random ranges."""
    POSITION = 3
    """Steady ranges of a node are too long and too short, and another position fits them all."""
    DIVERGED = 4
    """In space: a node is metres from the position that its ranges fit."""
    ALIGNMENT = 5
    """The ranges of the group fit badly for seconds: it is rotated or reflected wrongly."""
    LINK = 6
    """The ranges of one pair contradict those of the other pairs."""
    GROUP = 7
    """Ranges of the whole group are outliers: the estimate or the error model is wrong."""
    FROZEN = 8
    """A pair repeats one range while its nodes travel."""
    STALE = 9
    """A node had no range for so long that its distances to all others became uncertain."""


class Remedy(NamedTuple):
    """Decision and action of a fault."""

    limit: str
    """Parameter that the statistic is compared with, a field of `JointParams`."""
    decided: str
    """Time of the decision: once a supervision period, or with each range."""
    action: str


PERIOD, RANGE = "each period, by the largest ratio", "each range"
CATALOGUE: dict[Fault, Remedy] = {
    Fault.BIAS: Remedy(
        "node_bias_limit", PERIOD, "an offset common to the node's ranges becomes a state"
    ),
    Fault.OUTLIERS: Remedy(
        "supervision.outlier_ratio",
        PERIOD,
        "an offset common to the node's ranges becomes a state",
    ),
    Fault.POSITION: Remedy(
        "supervision.position_misfit",
        PERIOD,
        "the node moves to where its ranges fit, if there is such a position",
    ),
    Fault.DIVERGED: Remedy(
        "supervision.far_residual",
        PERIOD,
        "the node joins again; where most do, the group starts again",
    ),
    Fault.ALIGNMENT: Remedy(
        "start.respawn_nis", PERIOD, "all rotations and reflections compete again"
    ),
    Fault.LINK: Remedy(
        "pair_nis_limit", RANGE, "its ranges count less and less; the pair is `doubtful`"
    ),
    Fault.GROUP: Remedy(
        "supervision.group_outlier_ratio", RANGE, "every pair of the group is `doubtful`"
    ),
    Fault.FROZEN: Remedy(
        "supervision.frozen_ranges", RANGE, "the range is ignored until another number comes"
    ),
    Fault.STALE: Remedy("stale_std", RANGE, "the node joins again with its next range"),
}
"""Fault to its decision and action."""

# Plain numbers: kernels do not know enums.
NONE, BIAS, OUTLIERS, POSITION, DIVERGED, ALIGNMENT = (f.value for f in list(Fault)[:6])


@kernel
def find_fault(c, s, layout, t, but_positions):
    """Return the fault with the largest ratio to its limit, and the node; `NONE` and -1 if none.

    Args:
        c: Coefficients.
        s: JointState of one environment without pending updates.
        layout: Tables.
        t: Time [s].
        but_positions: True to leave out wrong positions.
    """
    found, at, most = NONE, -1, 1.0
    ratio = alignment_ratio(c, s)
    if ratio > most:
        found, most = ALIGNMENT, ratio
    worst = worst_node(c, s, layout, t)
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        total, is_away = position_misfit(c, s, layout, i, t)
        ratio = 0.0 if but_positions else total / c.position_misfit
        if ratio > most:
            found, at, most = DIVERGED if is_away else POSITION, i, ratio
        if node.fault == NONE:
            ratio = bias_ratio(c, s, layout, i, t)
            if ratio > most:
                found, at, most = BIAS, i, ratio
            if i == worst:
                ratio = node_outlier_ratio(c, s, layout, i, t) / c.outlier_ratio
                if ratio > most:
                    found, at, most = OUTLIERS, i, ratio
    return found, at


@kernel
def worst_node(c, s, layout, t):
    """Return the node with the largest outlier ratio, -1 unless the ranges without it fit."""
    worst, most = -1, 0.0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            ratio = node_outlier_ratio(c, s, layout, i, t)
            if ratio > most:
                worst, most = i, ratio
    return worst if worst >= 0 and others_fit(c, s, worst, t) else -1


@kernel
def bias_ratio(c, s, layout, i, t):
    """Return n times the squared common error of node i's n pairs over its limit; 0 if n < 2."""
    n, error = common_range_error(c, s, layout, i, t)
    return n * (error / c.node_bias_limit) ** 2 if n >= 2 else 0.0


@kernel
def position_misfit(c, s, layout, i, t):
    """Return the loss of node i's position by its ranges, and whether most are metres off.

    The loss is 0 if its ranges are too few, or all too long or too short (a wrong calibration).
    """
    if s.nodes[i].static:
        return 0.0, False
    total, n, n_far, least, greatest = 0.0, 0, 0, 0.0, 0.0
    for k in range(s.nodes.shape[0]):
        if k != i and is_informative(c, s, layout, i, k, t):
            error = mean_range_error(c, s, layout.pair_index[i, k])
            total += misfit(c, error)
            least, greatest = min(least, error), max(greatest, error)
            n += 1
            n_far += has_large_residual(c, s.pairs[layout.pair_index[i, k]])
    # In the plane a wrongly rotated layout has the same residuals, and is found by its misfit.
    if c.d == 3 and n >= c.d and 2 * n_far > n and least < -c.far_residual:
        return total, True
    return total if n > c.d and least < -c.short_error and greatest > c.short_error else 0.0, False


@kernel
def update_group_misfit(c, s, dt):
    """Update the misfit of the group, and the limit that challenges raise, over dt [s]."""
    group = s.group[0]
    group.misfit += (1.0 - decay(dt / c.misfit_time)) * (group.mean_nis - group.misfit)
    keep = decay(dt / c.challenge_time)
    group.misfit_limit = keep * group.misfit_limit + (1.0 - keep) * c.respawn_nis


@kernel
def alignment_ratio(c, s):
    """Return misfit over limit of the only hypothesis; 0 if a node or the layout explains it."""
    group, n_faulty = s.group[0], 0
    if group.n_alive != 1 or group.alignment < CANDIDATES or group.misfit < group.misfit_limit:
        return 0.0
    for i in range(s.nodes.shape[0]):
        n_faulty += s.nodes[i].present and s.nodes[i].fault != NONE
    if n_faulty == 1 or degeneracy_ratio(c, s, group.best, True) == math.inf:
        return 0.0
    return group.misfit / group.misfit_limit
