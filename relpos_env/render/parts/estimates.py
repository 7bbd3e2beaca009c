"""Estimates of the viewer: outlines of the other cars and their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import DASH_DOT, DASHED, DOTTED, SOLID, Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.palette import Colour
from relpos_env.render.parts import car_shape
from relpos_env.render.snapshot import Snapshot
from tracking.arrays import F64
from tracking.estimate import Status

SIGMAS = 2.0
"""[-] Size of ellipses in standard deviations."""
PATTERNS: dict[int, Sequence[float]] = {
    Status.OK: SOLID,
    Status.AMBIGUOUS: DASHED,
    Status.DOUBTFUL: DASH_DOT,
    Status.LOST: DOTTED,
}
"""Line style by status; a status without an entry has no meaningful position."""
_CIRCLE = np.stack(
    [np.cos(np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)),
     np.sin(np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))]
)  # fmt: skip


def ellipse(cov: F64, sigmas: float = SIGMAS, most: float = np.inf) -> F64:
    """Return the ellipse of a covariance, (2, 2) [m2], round the origin, (point, 2) [m].

    Invariant: x' cov^-1 x = sigmas**2 for every point x, unless an axis is limited.

    Args:
        cov: Symmetric covariance; negative eigenvalues count as 0.
        sigmas: Size in standard deviations.
        most: Limit of the half axes [m].
    """
    values, vectors = np.linalg.eigh(cov)
    axes = np.minimum(sigmas * np.sqrt(np.maximum(values, 0.0)), most)
    outline: F64 = ((vectors * axes) @ _CIRCLE).T
    return outline


def placed_estimate(snapshot: Snapshot) -> tuple[F64, F64, float]:
    """Return the estimate in the room: positions (car, 2) [m], covariances, rotation [rad].

    An error of the viewer's own heading rotates its estimates about the viewer. Without
    ``estimate_heading`` the rotation is 0.
    """
    turn = 0.0
    if snapshot.estimate_heading is not None:
        turn = float(snapshot.pose[snapshot.viewer, 2] - snapshot.estimate_heading[snapshot.viewer])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    with np.errstate(invalid="ignore"):  # non-finite estimates are not drawn
        pos = snapshot.pose[snapshot.viewer, :2] + snapshot.estimate @ rotation.T
        return pos, rotation @ snapshot.estimate_cov @ rotation.T, turn


def draw_ghosts(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw the estimate of every car with a meaningful position, with a 2 sigma ellipse."""
    if not snapshot.present[snapshot.viewer]:
        return
    pos, cov, turn = placed_estimate(snapshot)
    far = 2.0 * float(np.hypot(*snapshot.room))
    for car in np.flatnonzero(snapshot.present).tolist():
        status = int(snapshot.estimate_status[car])
        known = np.all(np.isfinite(pos[car])) and np.all(np.isfinite(cov[car]))
        if car == snapshot.viewer or status not in PATTERNS or not known:
            continue
        if np.max(np.abs(pos[car])) > far:
            continue
        colour, pattern = palette.car_colour(car), PATTERNS[status]
        ok = bool(snapshot.estimate_ok[car])
        x, y = pos[car].tolist()
        around = layout.pixels(ellipse(cov[car], most=far) + pos[car])
        draw_ellipse(canvas, around, colour, pattern, ok=ok)
        if snapshot.estimate_heading is None:
            outline = 0.4 * snapshot.car_size[0] * _CIRCLE.T
            body = layout.pixels(outline + pos[car])
        else:
            heading = float(snapshot.estimate_heading[car]) + turn
            body = layout.shape(car_shape.BODY * snapshot.car_size, x, y, heading)
        truth = layout.pixels(snapshot.pose[car, :2])
        faint = palette.mix(colour, palette.FLOOR, 0.35)
        canvas.lines(np.array([truth, layout.pixels(pos[car])]), faint, 1.0)
        draw_ghost(canvas, body, colour, pattern, ok=ok)


def draw_ellipse(
    canvas: Canvas, outline: F64, colour: Colour, pattern: Sequence[float], *, ok: bool
) -> None:
    """Draw a 2 sigma ellipse [pixels], filled if the estimate is usable."""
    if ok:
        canvas.polygon(outline, colour, 30)
    edge = palette.mix(colour, palette.FLOOR, 0.45)
    canvas.lines(outline, edge, 1.0, pattern, closed=True)


def draw_ghost(
    canvas: Canvas, outline: F64, colour: Colour, pattern: Sequence[float], *, ok: bool
) -> None:
    """Draw the outline of an estimated car [pixels], filled if the estimate is usable."""
    if ok:
        canvas.polygon(outline, colour, 70)
    canvas.lines(outline, palette.mix(colour, palette.FLOOR, 0.1), 1.5, pattern, closed=True)
