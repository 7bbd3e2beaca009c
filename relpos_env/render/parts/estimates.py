"""What the viewer believes: ghosts of the other cars and how sure it is of each."""

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
"""[-] Standard deviations that an ellipse reaches."""
PATTERNS: dict[int, Sequence[float]] = {
    Status.OK: SOLID,
    Status.AMBIGUOUS: DASHED,
    Status.DOUBTFUL: DASH_DOT,
    Status.LOST: DOTTED,
}
"""Line styles of ghosts; a status that is not here has a position that says nothing."""
_CIRCLE = np.stack(
    [np.cos(np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)),
     np.sin(np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))]
)  # fmt: skip


def ellipse(cov: F64, sigmas: float = SIGMAS, most: float = np.inf) -> F64:
    """Outline of a covariance, (2, 2) [m2], round the origin, (point, 2) [m].

    Law: for every point x of an outline that no axis cuts short, x' cov^-1 x = sigmas**2.

    Args:
        cov: Symmetric; eigenvalues below 0 count as 0.
        sigmas: Standard deviations that it reaches.
        most: Longest half axis that is drawn [m].
    """
    values, vectors = np.linalg.eigh(cov)
    axes = np.minimum(sigmas * np.sqrt(np.maximum(values, 0.0)), most)
    outline: F64 = ((vectors * axes) @ _CIRCLE).T
    return outline


def placed_estimate(snapshot: Snapshot) -> tuple[F64, F64, float]:
    """The estimate in the room: positions (car, 2) [m], covariances, turn of its axes [rad].

    The viewer takes its own heading for the axes: where it errs, all it believes is turned
    round it. Without ``estimate_heading`` the axes count as true.
    """
    turn = 0.0
    if snapshot.estimate_heading is not None:
        turn = float(snapshot.pose[snapshot.viewer, 2] - snapshot.estimate_heading[snapshot.viewer])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    with np.errstate(invalid="ignore"):  # of what is not finite nothing is drawn
        pos = snapshot.pose[snapshot.viewer, :2] + snapshot.estimate @ rotation.T
        return pos, rotation @ snapshot.estimate_cov @ rotation.T, turn


def draw_ghosts(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """The ghost of every car the viewer has an idea of, with an ellipse of two sigmas."""
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
    """An ellipse of two sigmas [pixels], filled where the estimate can be used."""
    if ok:
        canvas.polygon(outline, colour, 30)
    edge = palette.mix(colour, palette.FLOOR, 0.45)
    canvas.lines(outline, edge, 1.0, pattern, closed=True)


def draw_ghost(
    canvas: Canvas, outline: F64, colour: Colour, pattern: Sequence[float], *, ok: bool
) -> None:
    """A ghost [pixels], filled where the estimate can be used."""
    if ok:
        canvas.polygon(outline, colour, 70)
    canvas.lines(outline, palette.mix(colour, palette.FLOOR, 0.1), 1.5, pattern, closed=True)
