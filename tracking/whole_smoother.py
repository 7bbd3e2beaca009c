"""Smoothing of a whole recording: a forward pass, a backward pass, and their combination.

Time is reversed for the second pass: orientations and accelerations are kept, velocities, rates
and gyroscope biases change sign, and JOIN and LEAVE are exchanged, so the joint filter itself runs
it. The errors of both passes are independent but for common priors, so their information adds up
for position and velocity of every pair: a two-filter smoother [1]. Each pass supplies rotation and
reflection of a group for the times at which the other has not found them. A pair that one pass
never finds stays ambiguous.

References:
    [1] Fraser, Potter, The optimum linear smoother as a combination of two optimum linear filters,
        IEEE Trans. Automatic Control 14 (1969) 387.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracking.ahrs.orientation import Orientation
from tracking.arrays import F64, Bool
from tracking.constellation import Constellation
from tracking.estimate import Status, TeamEstimate
from tracking.filters.joint import JointEkf
from tracking.measurements import GYRO_BIAS, Kind, MeasurementBlock
from tracking.sanity.blocks import usable
from tracking.tracker import TrackerParams

CONTRADICTION = 25.0
"""[-] Squared difference of both passes over its variance that counts as a contradiction."""
KNOWN = (Status.OK, Status.LOST, Status.DOUBTFUL)


class Smoothed(NamedTuple):
    """A smoothed recording."""

    estimate: TeamEstimate
    """Over (time, ...); NIS, NLOS probabilities, ages and orientations of the forward pass."""
    nis: float
    """Mean NIS of the forward pass [-]."""
    n_rejected: int
    """Number of ranges that the forward pass rejected."""


def smooth_whole(
    constellation: Constellation,
    block: MeasurementBlock,
    t_out: F64,
    params: TrackerParams | None = None,
    progress: Callable[[float], None] | None = None,
) -> Smoothed:
    """Estimate positions from a whole recording with the joint filter.

    Args:
        constellation: Nodes of the recording.
        block: All events of the recording, in order, one environment.
        t_out: Ascending times, (time) [s].
        params: Parameters of the tracker.
        progress: Called with the completed share after each pass.
    """
    params = params or TrackerParams()
    states = Orientation(constellation, params.orientation, follows_bias=True).step(usable(block))
    passes = [JointEkf(constellation, params.filter.joint) for _ in range(2)]
    report = progress or (lambda _: None)
    forward = passes[0].run(states, t_out[None]).take(0)
    report(0.5)
    back = passes[1].run(backwards(states), -t_out[None, ::-1]).take(0)
    report(1.0)
    accuracy = passes[0].save().nodes["accuracy"][0]
    return Smoothed(
        _together(forward, back, accuracy[constellation.pairs].max(axis=1)),
        float(passes[0].mean_nis()[0]),
        int(passes[0].n_rejected()[0]),
    )


def backwards(block: MeasurementBlock) -> MeasurementBlock:
    """Return the events of one environment in reversed time.

    Surveyed distances, which are valid at any time, come first again.
    """
    t, kind, values = -block.t, block.kind.copy(), block.values.copy()
    kind[block.kind == Kind.JOIN], kind[block.kind == Kind.LEAVE] = Kind.LEAVE, Kind.JOIN
    states = block.kind == Kind.STATE
    values[states, GYRO_BIAS : GYRO_BIAS + 3] *= -1.0
    turned = replace(block, t=t, kind=kind, values=values)
    surveys = turned.take(turned.kind[0] == Kind.SURVEY)
    known = replace(surveys, t=np.full_like(surveys.t, t.min(initial=0.0)))
    turned = MeasurementBlock.concatenate([known, turned])
    return turned.take(turned.order()[0])


def _together(forward: TeamEstimate, back: TeamEstimate, accuracy: F64) -> TeamEstimate:
    """Add the information of both passes; `back` is in its own order of times."""
    d = forward.constellation.dimensions
    axes = np.array([*range(d), *range(3, 3 + d)])
    sign = np.repeat([1.0, -1.0], d)
    states = [np.concatenate([e.pos_ij_w, e.vel_ij_w], axis=-1) for e in (forward, back)]
    ahead, behind = states[0][..., axes], states[1][::-1][..., axes] * sign
    cov_f = forward.cov[..., axes, :][..., axes]
    cov_b = back.cov[::-1][..., axes, :][..., axes] * np.outer(sign, sign)
    known_f = np.isin(forward.status, KNOWN)
    known_b = np.isin(back.status[::-1], KNOWN)
    known_f, known_b, differ = _agree(
        forward.t, (ahead, cov_f, known_f), (behind, cov_b, known_b), d
    )
    eye = np.eye(2 * d)
    info_f = _inverse(cov_f, known_f)
    info_b = _inverse(cov_b, known_b)
    none = ~(known_f | known_b)
    cov = np.linalg.inv(info_f + info_b + none[..., None, None] * eye)
    sums = info_f @ ahead[..., None] + info_b @ behind[..., None]
    state = (cov @ sums)[..., 0]
    pos, vel, full = forward.pos_ij_w.copy(), forward.vel_ij_w.copy(), forward.cov.copy()
    some = ~none
    pos[some, :d], vel[some, :d] = state[some, :d], state[some, d:]
    full[np.ix_(*map(np.arange, full.shape[:2]), axes, axes)] = np.where(
        none[..., None, None], full[..., axes, :][..., axes], 0.5 * (cov + np.swapaxes(cov, -1, -2))
    )
    error = np.sqrt(np.trace(full[..., :d, :d], axis1=-2, axis2=-1))
    status = np.where(error <= accuracy, Status.OK, Status.LOST)
    doubted = (forward.status == Status.DOUBTFUL) & (back.status[::-1] == Status.DOUBTFUL)
    status = np.where(doubted | differ, Status.DOUBTFUL, status)
    # Both passes have all data: an image that one of them never finds is not known.
    is_found = has_ok(forward) & has_ok(back)
    status = np.where((status == Status.OK) & ~is_found, Status.AMBIGUOUS, status)
    status = np.where(none, forward.status, status).astype(forward.status.dtype)
    return replace(forward, pos_ij_w=pos, vel_ij_w=vel, cov=full, status=status)


def has_ok(estimate: TeamEstimate) -> Bool:
    """Return which pairs are `ok` at any time of a pass, (pair)."""
    return np.asarray((estimate.status == Status.OK).any(axis=0))


def _agree(
    t: F64, forward: tuple[F64, F64, Bool], back: tuple[F64, F64, Bool], d: int
) -> tuple[Bool, Bool, Bool]:
    """Exclude the pass with less data where both passes contradict each other.

    Returns:
        Masks of use of each pass, and of contradictions, (time, pair).
    """
    off = (forward[0] - back[0])[..., :d]
    variance = (forward[1] + back[1])[..., :d, :d] + 1e-12 * np.eye(d)
    squared = np.einsum("...i,...i->...", off, np.linalg.solve(variance, off[..., None])[..., 0])
    differ = forward[2] & back[2] & (squared > CONTRADICTION)
    is_late = (t - t[0] > t[-1] - t)[:, None]
    return forward[2] & ~(differ & ~is_late), back[2] & ~(differ & is_late), np.asarray(differ)


def _inverse(cov: F64, known: Bool) -> F64:
    """Return the information matrices; zero for unknown estimates."""
    eye = np.eye(cov.shape[-1])
    safe = np.where(known[..., None, None], cov + 1e-12 * eye, eye)
    return np.asarray(np.linalg.inv(safe) * known[..., None, None])
