"""Offsets of gyroscope and accelerometer from rest.

At rest the gyroscope reads its offset, and the accelerometer a vector of norm g in a direction
that depends only on the pose [1]:

    gyr = o_g + n,    |s * (acc - o_a)| = g

Six numbers s, o_a need six different poses. Fewer poses determine only the part of the offset
along the directions of gravity in the body: the result is the smallest offset that explains the
norms, with s = 1. For a node that lies level, the gravity vector is known and one pose gives the
whole offset, with s = 1.

References:
    [1] Frosio, Pedersini, Borghese, IEEE Trans. Instrum. Meas. 58 (2009) 2034.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64
from tracking.calibration.calibration import NodeCalibration
from tracking.calibration.errors import CalibrationError
from tracking.calibration.rest import Rest, RestParams, find_rest
from tracking.geometry import GRAVITY
from tracking.params.short_repr import short_repr

MIN_REST = 1.0
"""[s] Least time at rest; white noise over a second is far below any offset."""
LEAST_FORCE = 1.0
"""[m/s2] Least reading of a working accelerometer at rest."""
POSE_ANGLE = np.radians(10.0)
"""[rad] Largest angle between phases of one pose."""
MIN_POSES = 6
MAX_CONDITION = 15.0
"""[-] Largest condition number of the full fit; 1 with each axis up and down once."""
MIN_SIGHT = 0.3
"""[-] Least RMS part of gravity along a direction that the partial fit determines."""
MAX_RESIDUAL = 0.1
"""[m/s2] Largest misfit of |acc| after the fit; an offset does not explain more."""
MAX_OFFSET = 1.5
"""[m/s2] Largest offset; a larger one is a defect, or in other units."""
MAX_SCALE = 0.1
"""[-] Largest difference of a scale from 1; a larger one is a defect, or in other units."""


@dataclass(frozen=True, slots=True)
class ImuResult:
    """Calibration of one IMU."""

    __repr__ = short_repr

    calibration: NodeCalibration
    gyr_se: F64
    """Standard error of the gyroscope offset, (3) [rad/s]."""
    acc_method: str
    """Method of the fit: "full", "partial" or "level"."""
    n_poses: int
    n_seen: int
    """[-] Number of determined directions of the accelerometer offset, 1 to 3."""
    residual_before: float
    """[m/s2] Rms of | |acc| - g | over poses (of the vector if level)."""
    residual_after: float
    """[m/s2] The same rms after the correction."""
    rest: Rest


def calibrate_imu(
    t: F64,
    imu: F64,
    *,
    level: bool = False,
    gravity: float = GRAVITY,
    params: RestParams | None = None,
) -> ImuResult:
    """Estimate the offsets of one node.

    Args:
        t: Times, (sample) [s].
        imu: Gyroscope [rad/s] and specific force [m/s2], body frame, (sample, 6).
        level: The node lies level whenever it is at rest.
        gravity: Norm of gravity at the site [m/s2].
        params: Thresholds of rest.

    Raises:
        CalibrationError: Too little rest, or accelerations that no offset explains.
    """
    rest = find_rest(t, imu, params)
    if rest.duration < MIN_REST:
        raise CalibrationError(
            f"{rest.duration:.1f} s at rest, expected a phase of at least {MIN_REST:g} s in which "
            "the node is not touched"
        )
    poses = _poses(rest)
    if level:
        method, n_seen = "level", 3
        offset, scale, before, after = _fit_level(rest, gravity)
    else:
        full = _fit_full(poses, gravity)
        if full is not None:
            method, n_seen = "full", 3
            offset, scale = full
        else:
            method, scale = "partial", np.ones(3)
            offset, n_seen = _fit_partial(poses, gravity)
        before = _rms(np.linalg.norm(poses, axis=1) - gravity)
        after = _rms(np.linalg.norm(scale * (poses - offset), axis=1) - gravity)
    _check(offset, scale, after)
    gyr = imu[rest.at_rest, :3]
    calibration = NodeCalibration(
        gyr_offset=_vector(gyr.mean(axis=0)),
        acc_offset=_vector(offset),
        acc_scale=_vector(scale) if method == "full" else None,
    )
    return ImuResult(
        calibration, _standard_error(rest, gyr), method, len(poses), n_seen, before, after, rest
    )


def _standard_error(rest: Rest, gyr: F64) -> F64:
    """Return the standard error of the noise, or of phase means if larger, (3) [rad/s]."""
    white = gyr.std(axis=0) / np.sqrt(len(gyr))
    if len(rest.n) < 2:
        return np.asarray(white)
    between = rest.gyr.std(axis=0, ddof=1) / np.sqrt(len(rest.n))
    return np.asarray(np.maximum(white, between))


def _poses(rest: Rest) -> F64:
    """Return the mean specific force of each pose, (pose, 3) [m/s2], over its phases.

    Raises:
        CalibrationError: There is no force at rest: a dead accelerometer, or free fall.
    """
    least = float(np.linalg.norm(rest.acc, axis=1).min())
    if not least > LEAST_FORCE:
        raise CalibrationError(
            f"{least:.2g} m/s2 at rest, expected gravity: is the accelerometer alive, in m/s2?"
        )
    sums: list[F64] = []
    weights: list[float] = []
    for acc, n in zip(rest.acc, rest.n, strict=True):
        for k, total in enumerate(sums):
            cosine = total @ acc / (np.linalg.norm(total) * np.linalg.norm(acc))
            if cosine > np.cos(POSE_ANGLE):
                sums[k] = total + n * acc
                weights[k] += n
                break
        else:
            sums.append(n * acc)
            weights.append(float(n))
    return np.asarray(np.array(sums) / np.array(weights)[:, None])


def _fit_full(poses: F64, gravity: float) -> tuple[F64, F64] | None:
    """Return offset [m/s2] and scale [-], (3) each; None if the poses do not determine them."""
    from scipy.optimize import least_squares

    if len(poses) < MIN_POSES:
        return None
    unit = poses / np.linalg.norm(poses, axis=1, keepdims=True)
    singular = np.linalg.svd(np.concatenate([unit, unit**2], axis=1), compute_uv=False)
    if singular[-1] * MAX_CONDITION < singular[0]:
        return None

    def misfit(x: F64) -> F64:
        length: F64 = np.linalg.norm((1.0 + x[3:]) * (poses / gravity - x[:3]), axis=1)
        return length - 1.0

    fit = least_squares(
        misfit, np.zeros(6), loss="soft_l1", f_scale=0.01, xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    return gravity * fit.x[:3], 1.0 + fit.x[3:]


def _fit_partial(poses: F64, gravity: float) -> tuple[F64, int]:
    """Return the smallest offset that explains the norms, (3) [m/s2], and its directions."""
    unit = poses / np.linalg.norm(poses, axis=1, keepdims=True)
    _, sight, axes = np.linalg.svd(unit, full_matrices=False)
    seen = axes[sight / np.sqrt(len(poses)) > MIN_SIGHT]
    part = np.zeros(len(seen))
    for _ in range(20):
        force = poses - part @ seen
        length = np.linalg.norm(force, axis=1)
        slope = (force / length[:, None]) @ seen.T
        part = part + np.linalg.lstsq(slope, length - gravity)[0]
    return part @ seen, len(seen)


def _fit_level(rest: Rest, gravity: float) -> tuple[F64, F64, float, float]:
    """Return offset [m/s2], scale 1, and rms before and after [m/s2]."""
    up = np.array([0.0, 0.0, gravity])
    offset = np.average(rest.acc, axis=0, weights=rest.n) - up
    tilt = np.degrees(np.arctan2(np.hypot(offset[0], offset[1]), gravity + offset[2]))
    if tilt > np.degrees(POSE_ANGLE):
        raise CalibrationError(f"tilted by {tilt:.0f} degrees at rest, expected a level node")
    error = rest.acc - up
    before, after = (_rms(np.linalg.norm(e, axis=1)) for e in (error, error - offset))
    return offset, np.ones(3), before, after


def _check(offset: F64, scale: F64, residual: float) -> None:
    if np.linalg.norm(offset) > MAX_OFFSET:
        raise CalibrationError(
            f"accelerometer offset {np.linalg.norm(offset):.2f} m/s2, expected at most "
            f"{MAX_OFFSET:g}: is it in m/s2?"
        )
    if np.abs(scale - 1.0).max() > MAX_SCALE:
        raise CalibrationError(
            f"accelerometer scales {', '.join(f'{s:.3f}' for s in scale)}, expected "
            f"{1 - MAX_SCALE:g} to {1 + MAX_SCALE:g}"
        )
    if residual > MAX_RESIDUAL:
        raise CalibrationError(
            f"{residual:.2f} m/s2 of misfit left at rest, expected at most {MAX_RESIDUAL:g}: "
            "was it really at rest?"
        )


def _rms(x: F64) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _vector(x: F64) -> tuple[float, float, float]:
    return float(x[0]), float(x[1]), float(x[2])
