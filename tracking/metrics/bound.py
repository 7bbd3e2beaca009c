"""Expected error of an efficient estimator: the posterior Cramer-Rao bound along a run.

The mean square error of an estimator, over all runs of a world, is at least the inverse of the
posterior information, which for white Gaussian noise obeys the Riccati recursion linearised at the
truth [1]. The model is that of the joint filter (`tracking.filters.joint`) with the parameters of
the world (`relpos_env.core.oracle_params`): its motion, its range errors, wheels that slide as in
the world, nodes that rest. It leaves out the assumptions of the filter (the speed of the group).
The true motion and the NLOS labels are given and, by default, the initial rotation and reflection
of the group, which an estimator has to find.

The bound is a mean over runs: the error of a single run may be smaller. For a recording, whose
world is unknown, it is the error of an efficient estimator if the assumed noise were the true one.
NLOS errors are not Gaussian; their variance is used, so the bound is then that of the best linear
estimator. The figures are aligned like those of `tracking.metrics.score`.

References:
    [1] Tichavsky, Muravchik, Nehorai, Posterior Cramer-Rao bounds for discrete-time nonlinear
        filtering, IEEE Trans. Signal Processing 46 (1998) 1386.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tracking.ahrs.orientation import Orientation
from tracking.ahrs.params import OrientationParams
from tracking.arrays import F64, Bool, aligned, whole_lines
from tracking.calibration.range_errors import measure_range_errors
from tracking.constellation import Constellation
from tracking.errors import LogError
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf.workspace import make_workspace
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import JointState, make_layout, make_state, room_to_wait
from tracking.geometry import quat_conjugate, quat_multiply, yaw_of
from tracking.log import Log
from tracking.measurements import Kind, MeasurementBlock
from tracking.metrics.information_bound import run_bound
from tracking.params.short_repr import short_repr
from tracking.records import Records, as_records

RATE = 5.0
"""[Hz] Output rate of the bound."""
UNKNOWN_TURN = {2: 1.0, 3: 0.5**0.5}
"""[rad] Std of an unknown rotation of a group about every axis, by dimensions: its linear error
is as large as that of the best guess, all nodes at one place."""


@dataclass(frozen=True, slots=True)
class Bound:
    """Expected root mean square errors of the relative positions of a run."""

    __repr__ = short_repr

    t: F64
    """Times, (time) [s]."""
    pair_rms: F64
    """Errors in the world frame, (time, pair) [m]."""
    shape_rms: F64
    """Error over all pairs after the best rotation at each instant, (time) [m]."""
    rmse: float
    """Error in the world frame, over the scored time [m]."""
    rmse_yaw: float
    """Error after the best constant yaw of the whole run [m]."""
    rmse_shape: float
    """Error after the best rotation at each instant, over the scored time [m]."""


def posterior_bound(
    log: Log,
    params: JointParams,
    *,
    orientation: OrientationParams | None = None,
    skip: float = 10.0,
    turn_std: float = 0.0,
) -> Bound:
    """Compute the bound of a recorded run.

    Args:
        log: A run with truth; its NLOS labels are used if present.
        params: Model of the world in the parameters of the joint filter.
        orientation: Parameters of the orientation stage.
        skip: Time after the first range that is not scored [s].
        turn_std: Std of the initial rotation of the group, about every axis [rad]:
            `UNKNOWN_TURN` for an unknown one. The reflection is known.

    Raises:
        LogError: The log has no truth, or no ranges.
    """
    if len(log.truth.t) == 0:
        raise LogError("truth: expected a log with truth, a bound is taken along the true motion")
    constellation, d = log.constellation, log.constellation.dimensions
    params_q = orientation or OrientationParams()
    block = Orientation(constellation, params_q, follows_bias=True).step(log.block)
    is_range = block.kind[0] == Kind.RANGE
    hidden = np.zeros(block.n_events, dtype=bool)
    if log.nlos is not None:
        hidden[is_range] = log.nlos
    keep = block.valid[0]
    block, hidden = block.env(0), hidden[keep]
    if not is_range.any():
        raise LogError("ranges: expected some, without them nothing bounds the error")
    first = float(block.t[0][block.kind[0] == Kind.RANGE][0])
    last = min(float(block.t[0, -1]), float(log.truth.t.max()))
    t_out = np.arange(first + skip, last, 1.0 / RATE)
    if len(t_out) == 0:
        raise LogError(f"truth: expected more than {skip:g} s after the first range")
    truth = _truth_at_events(log, block)

    n = constellation.n_nodes
    cov = np.zeros((len(t_out), n * d, n * d))
    coefficients = make_coefficients(constellation, params)
    state = _with_a_row_more(make_state(constellation, params, 1, 1), coefficients)
    fields = (as_records(a[0]) if a.dtype.names else a[0] for a in state)
    coefficients = as_records(coefficients)
    pos, known = log.truth.positions(constellation, t_out)
    pos = np.nan_to_num(pos[..., :d])
    scored = _scored_pairs(constellation, known)
    yaw, weight = _yaw_generators(constellation, pos, scored)
    events = (block.t, block.kind, block.i, block.j, block.antenna_i, block.antenna_j, block.values)
    variance = run_bound(
        coefficients,
        make_layout(constellation, params),
        JointState._make(fields),
        make_workspace(n, constellation.n_pairs, int(coefficients[0]["n"])),
        tuple(np.ascontiguousarray(a) for a in events),
        hidden,
        truth,
        turn_std**2,
        t_out,
        yaw,
        cov,
    )
    taken = variance / weight if weight > 0.0 else 0.0
    return _summarise(constellation, t_out, cov, pos, scored, taken)


def recorded_bound(
    log: Log,
    params: JointParams | None = None,
    *,
    orientation: OrientationParams | None = None,
    skip: float = 10.0,
) -> Bound:
    """Compute the bound of a recording, valid if the assumed noise is the true one.

    The LOS range noise is measured (`measure_range_errors`), and the initial rotation of the group
    is unknown. The vehicles are as in `params`.

    Args:
        log: A recording with truth.
        params: Model of everything but the ranges.
        orientation: Parameters of the orientation stage.
        skip: Time after the first range that is not scored [s].

    Raises:
        LogError: As `posterior_bound`, or range errors cannot be measured.
    """
    params = params or JointParams()
    measured = replace(params, range_error=measure_range_errors(log, params.range_error))
    turn_std = UNKNOWN_TURN[log.constellation.dimensions]
    return posterior_bound(log, measured, orientation=orientation, skip=skip, turn_std=turn_std)


def _truth_at_events(log: Log, block: MeasurementBlock) -> tuple[F64, F64, F64]:
    """Return positions, velocities (event, node, 3) and heading errors (event, node) at events."""
    constellation, t, h = log.constellation, block.t[0], 0.02
    pos, _ = log.truth.positions(constellation, t)
    ahead, _ = log.truth.positions(constellation, t + h)
    behind, _ = log.truth.positions(constellation, t - h)
    heading = np.zeros((len(t), constellation.n_nodes))
    for node in range(constellation.n_nodes):
        rows = (log.truth.node == node) & log.truth.has_orientation
        states = (block.kind[0] == Kind.STATE) & (block.i[0] == node)
        if not rows.any() or not states.any():
            continue
        nearest = np.clip(np.searchsorted(log.truth.t[rows], t[states]), 0, rows.sum() - 1)
        q_error = quat_multiply(
            log.truth.q_wb[rows][nearest], quat_conjugate(block.values[0, states, :4])
        )
        heading[:, node] = np.interp(t, t[states], np.unwrap(yaw_of(q_error)))
    return np.nan_to_num(pos), np.nan_to_num((ahead - behind) / (2.0 * h)), heading


def _with_a_row_more(state: JointState, coefficients: Records) -> JointState:
    """Return a state with one row more; the number in its coefficients, (1), is updated."""
    n = state.x.shape[2]
    width = whole_lines(n + 1)
    coefficients["n"] = width
    P = aligned(1, 1, width, width)  # noqa: N806
    P[..., :n, :n] = state.P
    return state._replace(
        x=aligned(1, 1, width),
        P=P,
        pending_updates=aligned(1, 1, room_to_wait(width), width),
        accumulated_correction=aligned(1, 1, width),
        sensitivity=np.zeros((1, 1, 0, width)),
    )


def _scored_pairs(constellation: Constellation, known: Bool) -> Bool:
    """Return a mask of scored pairs, (time, pair): both positions known, one node moving."""
    i, j = constellation.pairs.T
    moving = ~constellation.is_static[constellation.pairs].all(axis=1)
    return np.asarray(known[:, i] & known[:, j] & moving)


def _yaw_generators(constellation: Constellation, pos: F64, scored: Bool) -> tuple[F64, float]:
    """Compute the effect of a yaw of all relative positions, summed over the scored pairs.

    Args:
        constellation: Nodes of the run.
        pos: True positions, (time, node, d) [m].
        scored: Mask of scored pairs, (time, pair).

    Returns:
        Coefficients of the position errors in ``sum over pairs (z x x_ij) . e_ij``, (time,
        node * d) [m], and the sum of ``|z x x_ij|^2`` over pairs and times [m2].
    """
    i, j = constellation.pairs.T
    relative = pos[:, j] - pos[:, i]
    turned = np.zeros_like(relative)
    turned[..., 0], turned[..., 1] = -relative[..., 1], relative[..., 0]
    turned *= scored[..., None]
    yaw = np.zeros_like(pos)
    for p in range(constellation.n_pairs):
        yaw[:, j[p]] += turned[:, p]
        yaw[:, i[p]] -= turned[:, p]
    return yaw.reshape(len(pos), -1), float(np.sum(turned**2))


def _summarise(
    constellation: Constellation, t: F64, cov: F64, pos: F64, scored: Bool, taken: float
) -> Bound:
    """Compute errors of pairs from covariances of positions.

    Args:
        constellation: Nodes of the run.
        t: Times, (time) [s].
        cov: Covariance of all positions, (time, node * d, node * d) [m2].
        pos: True positions, (time, node, d) [m].
        scored: Mask of scored pairs, (time, pair).
        taken: Part of the sum of squared errors that the best constant yaw removes [m2].
    """
    n, d = constellation.n_nodes, constellation.dimensions
    i, j = constellation.pairs.T
    difference = np.zeros((constellation.n_pairs * d, n * d))
    for p in range(constellation.n_pairs):
        for k in range(d):
            difference[p * d + k, j[p] * d + k], difference[p * d + k, i[p] * d + k] = 1.0, -1.0
    pair_cov = difference @ cov @ difference.T
    variance = np.diagonal(pair_cov, axis1=1, axis2=2).reshape(len(t), -1, d).sum(axis=2)
    shape = np.zeros(len(t))
    for k in range(len(t)):
        used = np.repeat(scored[k], d)
        generators = _rotations((pos[k, j] - pos[k, i]).reshape(-1, d), d)[used]
        left, pairs = pair_cov[k][np.ix_(used, used)], max(int(scored[k].sum()), 1)
        shape[k] = _beside(left, generators) / pairs
    counted, total = scored.any(axis=1), max(int(scored.sum()), 1)
    after_yaw = max(float(variance[scored].sum()) - taken, 0.0) / total
    return Bound(
        t=t,
        pair_rms=np.sqrt(variance),
        shape_rms=np.sqrt(np.maximum(shape, 0.0)),
        rmse=float(np.sqrt(variance[scored].mean())),
        rmse_yaw=float(np.sqrt(after_yaw)),
        rmse_shape=float(np.sqrt(np.maximum(shape[counted], 0.0).mean())),
    )


def _beside(cov: F64, generators: F64) -> float:
    """Return the trace of a covariance (number, number) off the span of generators (number, k)."""
    basis, size, _ = np.linalg.svd(generators, full_matrices=False)
    basis = basis[:, size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)]
    return float(np.trace(cov) - np.trace(basis.T @ cov @ basis))


def _rotations(relative: F64, d: int) -> F64:
    """Return derivatives of positions (pair, d) by rotations, (pair * d, 1 or 3), yaw last."""
    if d == 2:
        return np.stack([-relative[:, 1], relative[:, 0]], axis=1).reshape(-1, 1)
    axes = [np.cross(axis, relative).reshape(-1) for axis in np.eye(3)]
    return np.stack(axes, axis=1)
