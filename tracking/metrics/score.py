"""Accuracy and consistency of an estimate: the figures of all results.

Relative positions are scored in the world frame over the pairs with at least one moving node.

- ``rmse``: without alignment.
- ``rmse_yaw``: after one constant yaw for the whole run, since magnetic north and the frame
  of a motion-capture room differ by a constant.
- ``rmse_shape``: after the best rotation at each instant. A reflection counts as an error.
- ``rmse_mirror``: after the best rotation and reflection at each instant: the error of the shape,
  which is all that ranges alone determine.
- ``nees``: mean of e^T P^-1 e over the position errors e after that yaw, per dimension: 1 if the
  covariance P is right, larger if the filter is overconfident [1]. P refers to the filter's own
  north, which no measurement relates to another.
- ``protection_share``: share of OK positions beyond their protection radius, after that yaw.
- ``integrity_share`` and ``integrity_worst_s``: share and time of pairs that are OK and wrong,
  after that yaw and over the whole run (`tracking.metrics.integrity`).

References:
    [1] Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation,
        Wiley 2001, ch. 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, Bool
from tracking.estimate import Status, TeamEstimate
from tracking.geometry import best_rotation
from tracking.metrics.consistency import pair_nees
from tracking.metrics.integrity import beyond_protection, longest, wrong_while_ok
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of one run; figures are None if nothing could be scored."""

    __repr__ = short_repr

    rmse: float | None
    """[m] Root mean square error in the world frame."""
    rmse_yaw: float | None
    """[m] Root mean square error after the best constant yaw."""
    yaw_deg: float | None
    """[deg] The constant yaw of `rmse_yaw`."""
    rmse_shape: float | None
    """[m] Root mean square error after the best rotation at each instant."""
    rmse_mirror: float | None
    """[m] Root mean square error after the best rotation and reflection at each instant."""
    nees: float | None
    """[-] Mean NEES per dimension after the best constant yaw."""
    pair_rmse: F64
    """`rmse` of each pair, (pair) [m]; NaN for pairs without a score."""
    pair_rmse_yaw: F64
    """`rmse_yaw` of each pair, (pair) [m]."""
    pair_rmse_shape: F64
    """`rmse_shape` of each pair, (pair) [m]."""
    n_scored: int
    """Number of relative positions in the figures."""
    coverage: float | None
    """[-] Share of the relative positions with truth that have an estimate; the rest is not
    scored. None without truth."""
    ok_share: float | None
    """[-] Share of the relative positions with truth whose status is OK. None without truth."""
    integrity_share: float | None
    """[-] Share of all relative positions with truth, scored or not, that are OK and wrong. None
    if nothing could be scored."""
    integrity_worst_s: float | None
    """[s] Longest uninterrupted time for which a pair is OK and wrong."""
    protection_share: float | None
    """[-] Share of the OK relative positions with truth whose error exceeds their protection
    radius. None without OK positions."""


def score(estimate: TeamEstimate, truth_ij_w: F64, has_truth: Bool, skip_until: float) -> Score:
    """Score a run of one environment.

    Args:
        estimate: Arrays over (time, pair).
        truth_ij_w: True relative positions, (time, pair, 3) [m].
        has_truth: Mask of known true positions, (time, pair).
        skip_until: Times before this are not scored [s].
    """
    constellation = estimate.constellation
    planar = constellation.dimensions == 2
    moving = ~constellation.is_static[constellation.pairs].all(axis=1)
    eligible = has_truth & moving & (estimate.t >= skip_until)[:, None]
    scored = eligible & ~np.isin(estimate.status, (Status.ABSENT, Status.STARTING))
    coverage = ok_share = None
    if eligible.any():
        coverage = float(scored.sum() / eligible.sum())
        ok_share = float((eligible & estimate.ok).sum() / eligible.sum())
    rows = scored.any(axis=1)
    x, truth, scored = estimate.pos_ij_w[rows], truth_ij_w[rows], scored[rows]
    n_pairs = constellation.n_pairs
    if not scored.any():
        nothing = np.full(n_pairs, np.nan)
        return Score(
            *(None,) * 6, nothing, nothing, nothing, 0, coverage, ok_share, None, None, None
        )
    x = np.where(scored[..., None], x, 0.0)
    truth = np.where(scored[..., None], truth, 0.0)
    if planar:
        # Nodes in a plane are scored in it, regardless of their true height.
        x, truth = x * [1.0, 1.0, 0.0], truth * [1.0, 1.0, 0.0]

    yaw = best_yaw(x, truth)
    c, s = np.cos(yaw), np.sin(yaw)
    R_yaw = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # noqa: N806
    R_shape = best_rotation(x, truth, planar=planar)  # noqa: N806
    M = best_rotation(x, truth, planar=planar, reflect=True)  # noqa: N806
    errors = [x - truth, *(x @ np.swapaxes(R, -1, -2) - truth for R in (R_yaw, R_shape, M))]

    turned = truth_ij_w @ R_yaw
    nees, known = pair_nees(estimate, turned)
    judged = has_truth & moving
    wrong = judged & wrong_while_ok(estimate, turned)
    nees, known = nees[rows], known[rows] & scored
    squared = [np.sum(e * e, axis=-1) for e in errors]
    overall = [float(np.sqrt(sq[scored].mean())) for sq in squared]
    count = np.maximum(scored.sum(axis=0), 1)
    per_pair = [
        np.where(scored.any(axis=0), np.sqrt(sq.sum(axis=0) / count), np.nan) for sq in squared
    ]
    return Score(
        rmse=overall[0],
        rmse_yaw=overall[1],
        yaw_deg=float(np.degrees(yaw)),
        rmse_shape=overall[2],
        rmse_mirror=overall[3],
        nees=float(nees[known].mean()) if known.any() else None,
        pair_rmse=per_pair[0],
        pair_rmse_yaw=per_pair[1],
        pair_rmse_shape=per_pair[2],
        n_scored=int(scored.sum()),
        coverage=coverage,
        ok_share=ok_share,
        integrity_share=float(wrong.sum() / judged.sum()),
        integrity_worst_s=longest(estimate.t, wrong),
        protection_share=beyond_protection(estimate, turned, judged),
    )


def best_yaw(x: F64, truth: F64) -> float:
    """Return the yaw that brings x nearest to truth, both (..., 3) [rad]."""
    cross = np.sum(x[..., 0] * truth[..., 1] - x[..., 1] * truth[..., 0])
    dot = np.sum(x[..., 0] * truth[..., 0] + x[..., 1] * truth[..., 1])
    return float(np.arctan2(cross, dot))


def errors_after(estimate: TeamEstimate, truth_ij_w: F64, yaw_rad: float) -> F64:
    """Return the position errors of a run after a constant yaw, (time, pair, 3) [m]."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # noqa: N806
    difference: F64 = estimate.pos_ij_w @ R.T - truth_ij_w
    return difference
