"""Hard and soft iron: the readings of a rotated node lie on an ellipsoid, not on a sphere.

    mag_raw = S R^T B + h,    mag = M (mag_raw - h),    M = r root(A)

The ellipsoid ``(x - h)^T A (x - h) = 1`` gives the hard iron h and, by the symmetric root, M;
r, the mean radius, keeps the norm of the field. A rotation inside S is not observable.

A car cannot be turned over. Its readings lie on a ring: an ellipse gives h and M of the two
horizontal axes (a circle gives h alone, for a partial ring), and the vertical offset stays
unknown, which the heading does not need.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.calibration.calibration import Matrix, NodeCalibration, Vector
from tracking.calibration.ellipsoid import Ellipsoid, fit_circle, fit_ellipsoid
from tracking.calibration.errors import CalibrationError
from tracking.params.short_repr import short_repr

MIN_SAMPLES = 100
STILL = 0.05
"""[-] Least spread of the readings of a moving node, relative to their norm."""
RING = 0.25
"""[-] Largest ratio of the spread across a ring's plane to that along it."""
MAX_TILT = np.radians(20.0)
"""[rad] Largest tilt of a ring from the horizontal plane of the body."""
MIN_CELLS = 0.6
"""[-] Least observed share of the sphere, in cells of equal area."""
MIN_ELLIPSE, MIN_CIRCLE = 0.75, 0.5
"""[-] Least observed share of the ring for an ellipse and for a circle."""
MAX_ELLIPSE = 0.03
"""[-] Residual above which the shape of a ring is due to the room's field, not soft iron."""
MAX_RESIDUAL = 0.1
"""[-] Largest residual relative to the field; above, the field changes from place to place."""
MIN_INLIERS = 0.8
MAX_RATIO = 2.5
"""[-] Largest ratio of the axes of the ellipsoid."""
FIELD = (3.0, 200.0)
"""[uT] Limits of the earth's field (20 to 70), distorted by a room, or its horizontal part."""


@dataclass(frozen=True, slots=True)
class MagResult:
    """Calibration of one magnetometer."""

    __repr__ = short_repr

    calibration: NodeCalibration
    method: str
    """"ellipsoid", or for a ring "ellipse" or "circle" of the horizontal axes."""
    field: float
    """[uT] Norm of the corrected field; of its horizontal part for a ring."""
    coverage: float
    """[-] Observed share of the sphere or ring."""
    residual_before: float
    """[-] Relative standard deviation of the norm of inliers before the correction."""
    residual_after: float
    """[-] Rms residual of inliers after the correction, relative to the radius."""
    inlier: Bool
    """Mask of inliers, (sample)."""


def calibrate_magnetometer(mag: F64, *, rng: np.random.Generator) -> MagResult:
    """Estimate hard and soft iron of one node.

    Args:
        mag: Readings in the body frame, (sample, 3) [uT].
        rng: Generator for the start of the robust fit.

    Raises:
        CalibrationError: The directions do not cover enough, or no ellipsoid fits.
    """
    if len(mag) < MIN_SAMPLES:
        raise CalibrationError(f"{len(mag)} magnetometer readings, expected at least {MIN_SAMPLES}")
    kept = mag[_spread_out(mag)]
    middle = np.median(kept, axis=0)
    distance = np.linalg.norm(kept - middle, axis=1)
    core = kept[distance <= 3.0 * np.median(distance)]
    _, spread, axes = np.linalg.svd(core - core.mean(axis=0), full_matrices=False)
    size = float(np.sqrt(np.sum(spread**2) / len(core)))
    still = size < STILL * float(np.median(np.linalg.norm(core, axis=1)))
    if spread[2] >= RING * spread[0] and not still:
        return _sphere(mag, kept, rng)
    if still or spread[1] < RING * spread[0]:
        raise CalibrationError(
            "the node hardly turned, expected every direction, or a full turn on the spot"
        )
    tilt = float(np.arccos(min(abs(axes[2, 2]), 1.0)))
    if tilt > MAX_TILT:
        raise CalibrationError(
            f"turned about one axis only, {np.degrees(tilt):.0f} degrees from the vertical of "
            "the body; expected every direction, or a turn about the vertical"
        )
    return _ring(mag, kept, rng)


def _sphere(mag: F64, kept: F64, rng: np.random.Generator) -> MagResult:
    found = fit_ellipsoid(kept, rng)
    if found is None:
        raise CalibrationError("no ellipsoid fits the readings, expected every direction")
    ellipsoid = found[0]
    corrected = (kept[found[1]] - ellipsoid.centre) @ ellipsoid.root
    coverage = _cells(corrected)
    if coverage < MIN_CELLS:
        raise CalibrationError(
            f"{100 * coverage:.0f} % of all directions seen, expected at least "
            f"{100 * MIN_CELLS:.0f} %: turn the node over as well"
        )
    return _result(mag, mag, ellipsoid, "ellipsoid", coverage)


def _ring(mag: F64, kept: F64, rng: np.random.Generator) -> MagResult:
    flat = kept[:, :2]
    found = fit_ellipsoid(flat, rng)
    if found is None:
        raise CalibrationError("no ellipse fits the readings, expected a turn on the spot")
    ellipse, inlier = found
    circle = fit_circle(flat[inlier])
    coverage = _sectors(flat[inlier] - circle.centre)
    if coverage < MIN_CIRCLE:
        raise CalibrationError(
            f"{100 * coverage:.0f} % of a turn seen, expected at least {100 * MIN_CIRCLE:.0f} %"
        )
    uneven = float(np.sqrt(np.mean(ellipse.misfit(flat[inlier]) ** 2)))
    if coverage >= MIN_ELLIPSE and uneven <= MAX_ELLIPSE:
        return _result(mag, mag[:, :2], ellipse, "ellipse", coverage)
    return _result(mag, mag[:, :2], circle, "circle", coverage)


def _result(mag: F64, x: F64, found: Ellipsoid, method: str, coverage: float) -> MagResult:
    """Check the ellipsoid fitted to x, (sample, d) [uT], and return its calibration."""
    misfit = found.misfit(x)
    inlier = np.abs(misfit) <= max(3.5 * 1.4826 * float(np.median(np.abs(misfit))), 1e-6)
    after = float(np.sqrt(np.mean(misfit[inlier] ** 2)))
    length = np.linalg.norm(x[inlier], axis=1)
    before = float(length.std() / length.mean())
    if found.axis_ratio > MAX_RATIO:
        raise CalibrationError(
            f"the axes of the {method} differ {found.axis_ratio:.1f} times, expected at most "
            f"{MAX_RATIO:g}: iron this near cannot be undone"
        )
    if after > MAX_RESIDUAL or inlier.mean() < MIN_INLIERS:
        raise CalibrationError(
            f"the field's length varies by {100 * after:.0f} % after the fit and "
            f"{100 * (1 - inlier.mean()):.0f} % of the readings are outliers, expected at most "
            f"{100 * MAX_RESIDUAL:.0f} % and {100 * (1 - MIN_INLIERS):.0f} %: turn the node on "
            "one spot, away from iron"
        )
    if not FIELD[0] <= found.radius <= FIELD[1]:
        raise CalibrationError(
            f"a field of {found.radius:.3g} uT, expected {FIELD[0]:g} to {FIELD[1]:g}: are the "
            "readings in uT?"
        )
    d = x.shape[1]
    offset, matrix = np.zeros(3), np.eye(3)
    offset[:d] = found.centre
    matrix[:d, :d] = found.radius * found.root
    calibration = NodeCalibration(
        mag_offset=_vector(offset),
        mag_matrix=None if method == "circle" else _matrix(matrix),
    )
    return MagResult(calibration, method, found.radius, coverage, before, after, inlier)


def _spread_out(mag: F64, per_box: int = 20) -> I64:
    """Select at most `per_box` samples of each box, so that rest has no extra weight."""
    middle = np.median(mag, axis=0)
    size = 0.2 * float(np.median(np.linalg.norm(mag - middle, axis=1))) or 1.0
    box = np.unique(np.round((mag - middle) / size), axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(box, kind="stable")
    starts = np.searchsorted(box[order], box[order], side="left")
    kept: I64 = np.sort(order[np.arange(len(mag)) - starts < per_box])
    return kept


def _cells(unit: F64, bands: int = 6, sectors: int = 12) -> float:
    """Return the share of the sphere's cells of equal area that contain directions."""
    z = np.clip(unit[:, 2] / np.linalg.norm(unit, axis=1), -1.0, 1.0 - 1e-9)
    angle = np.arctan2(unit[:, 1], unit[:, 0]) / (2.0 * np.pi) % 1.0
    band, sector = np.floor(0.5 * (z + 1.0) * bands), np.floor(angle * sectors) % sectors
    return len(np.unique(band * sectors + sector)) / (bands * sectors)


def _sectors(flat: F64, sectors: int = 24) -> float:
    angle = np.arctan2(flat[:, 1], flat[:, 0]) / (2.0 * np.pi) % 1.0
    return len(np.unique(np.floor(angle * sectors) % sectors)) / sectors


def _vector(x: F64) -> Vector:
    return float(x[0]), float(x[1]), float(x[2])


def _matrix(x: F64) -> Matrix:
    return _vector(x[0]), _vector(x[1]), _vector(x[2])
