"""Curves as piecewise cubics over the arc length, from a name or from points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.tasks.options import points
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

KNOT = 0.1
"""[m] Knot spacing of the cubics."""
CORNER_RADIUS = 0.7
"""[m] Radius of rounded corners on long segments: the smallest turning radius of the car."""
TIGHTEST = 0.65
"""[m] Minimum half axis of a loop or radius of an eight; smaller curves raise an error."""
BEND = 0.6
"""[-] Corner radius of a loop divided by its smaller half axis; small loops use more."""
EASE = 0.2
"""[m] Std of the Gaussian that smooths corners along the arc, for a finite steering rate."""
_STEP = 0.01


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve parametrised by arc length, accurate to about 1 %."""

    __repr__ = short_repr

    pieces: F64
    """Coefficients of x and y on segments of equal arc, falling powers, (segment, 2, 4)."""
    length: float
    """[m] Length; 0 for a single point."""
    closed: bool

    @classmethod
    def point(cls) -> Curve:
        """Return the origin, for a stationary formation."""
        return cls(np.zeros((1, 2, 4)), 0.0, True)

    @classmethod
    def through(cls, trace: F64, closed: bool, *, eased: bool = True) -> Curve:
        """Return the curve along a dense trace.

        Args:
            trace: Points some centimetres apart, (point, 2) [m]; the last point of a closed
                trace equals the first.
            closed: True for a closed curve.
            eased: True to smooth corners over `EASE`; a circle would only shrink.
        """
        if eased:
            trace = _eased(trace, closed)
        arc = _arc(trace)
        n = max(8, int(np.ceil(arc[-1] / KNOT)))
        knots = np.linspace(0.0, arc[-1], n + 1)
        at = np.stack([np.interp(knots, arc, trace[:, k]) for k in range(2)], axis=1)
        if closed:
            at[-1] = at[0]
        spline = CubicSpline(knots, at, bc_type="periodic" if closed else "natural")
        # The scipy layout is (power, segment, axis).
        pieces = np.ascontiguousarray(np.transpose(spline.c, (1, 2, 0)))
        return cls(pieces, float(arc[-1]), closed)

    def at(self, s: F64) -> F64:
        """Return the points at given arc lengths, (arc, 2) [m]."""
        s = np.mod(s, self.length) if self.closed else np.clip(s, 0.0, self.length)
        knot = self.length / len(self.pieces)
        k = np.minimum((s / knot).astype(np.int64), len(self.pieces) - 1)
        powers = ((s - k * knot)[:, None]) ** np.array([3, 2, 1, 0])
        found: F64 = np.einsum("sap,sp->sa", self.pieces[k], powers)
        return found

    def nearest(self, pos: F64) -> F64:
        """Return the arc lengths of the points nearest to (..., 2) [m], to 1.5 cm, (...) [m]."""
        s = np.arange(0.0, self.length, 0.03)
        away = self.at(s) - pos[..., None, :]
        found: F64 = s[np.argmin((away * away).sum(axis=-1), axis=-1)]
        return found


def _arc(trace: F64) -> F64:
    """Return the arc length from the first point to every point, (point) [m]."""
    segments = np.linalg.norm(np.diff(trace, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(segments)])


def _eased(trace: F64, closed: bool) -> F64:
    """Return the trace with continuous curvature: a moving Gaussian mean along the arc."""
    arc = _arc(trace)
    n = max(8, int(np.ceil(arc[-1] / _STEP)))
    step = arc[-1] / n
    even = np.stack(
        [np.interp(np.linspace(0.0, arc[-1], n + 1), arc, trace[:, k]) for k in range(2)], axis=1
    )
    m = min(int(np.ceil(3.0 * EASE / step)), n // 2)
    weight = np.exp(-0.5 * (np.arange(-m, m + 1) * step / EASE) ** 2)
    if closed:
        before, after = even[-m - 1 : -1], even[1 : m + 1]
    else:
        # Point reflection through the ends keeps the ends fixed.
        before, after = 2.0 * even[0] - even[m:0:-1], 2.0 * even[-1] - even[-2 : -m - 2 : -1]
    wide = np.concatenate([before, even, after])
    eased = [np.convolve(wide[:, k], weight / weight.sum(), mode="valid") for k in range(2)]
    return np.stack(eased, axis=1)


def loop(half: F64) -> F64:
    """Return a rectangle with rounded corners, counter-clockwise."""
    a, b = half
    radius = min(max(BEND * min(a, b), CORNER_RADIUS), a, b)
    return rounded(np.array([[a, -b], [a, b], [-a, b], [-a, -b]]), True, radius)


def eight(half: F64) -> F64:
    """Return a figure of eight: two touching circles along the longer half axis."""
    lengthwise = half[0] >= half[1]
    radius = min(0.5 * half.max(), half.min())
    u = np.linspace(0.0, 2.0 * np.pi, int(2.0 * np.pi * radius / _STEP))
    right = radius * np.stack([1.0 - np.cos(u), -np.sin(u)], axis=1)
    both = np.concatenate([right, (right * [-1.0, 1.0])[1:]])
    return both if lengthwise else both[:, ::-1]


CURVES = {"loop": loop, "eight": eight}
"""Name to ``(half axes (2) [m]) -> closed trace``. A new curve needs a function and a line here."""


def rounded(corners: F64, closed: bool, radius: float = CORNER_RADIUS) -> F64:
    """Return a dense trace of straight segments with circular corners, (point, 2) [m].

    Raises:
        EnvError: Two corners coincide, or the path turns back on itself.
    """
    n = len(corners)
    ends = np.roll(corners, -1, axis=0) - corners
    segments = ends if closed else ends[:-1]
    lengths = np.linalg.norm(segments, axis=1)
    if lengths.min() < 0.05:
        raise EnvError("path: expected points at least 0.05 m apart")
    trace = [corners[0]] if not closed else [corners[0] + 0.5 * segments[0]]
    inner = [*range(1, n), 0] if closed else list(range(1, n - 1))
    for k in inner:
        before, after = segments[k - 1] / lengths[k - 1], segments[k] / lengths[k]
        turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
        if abs(turn) > np.radians(170.0):
            raise EnvError(f"path: turns back on itself at point {k}, expected at most 170 degrees")
        # Distance from the corner to the tangent points, at most half a segment.
        touch = min(radius * np.tan(0.5 * abs(turn)), 0.5 * lengths[k - 1], 0.5 * lengths[k])
        if abs(turn) < 1e-6:
            trace.append(corners[k])
            continue
        actual = touch / np.tan(0.5 * abs(turn))
        left = np.array([-before[1], before[0]]) * np.sign(turn)
        centre = corners[k] - touch * before + actual * left
        u = np.linspace(0.0, turn, max(3, int(np.ceil(actual * abs(turn) / _STEP))))
        c, s = np.cos(u)[:, None], np.sin(u)[:, None]
        spoke = -actual * left
        trace.extend(centre + c * spoke + s * np.array([-spoke[1], spoke[0]]))
    trace.append(trace[0] if closed else corners[-1])
    return np.array(trace)


def make_curve(
    path: str | Sequence[Sequence[float]] | F64, closed: bool, half: F64, extent: F64
) -> Curve:
    """Return the curve of a `path` option.

    Args:
        path: One of `CURVES`, as large as the room allows, or points [m].
        closed: True if a path of points is closed; named paths always are.
        half: Half axes of the room less a margin, (2) [m].
        extent: Half extent of the formation about the curve's point, (2) [m].

    Raises:
        EnvError: Unknown name, invalid points, or the path does not fit in the room.
    """
    free = half - extent
    if isinstance(path, str):
        make = look_up(CURVES, path, "path")
        tightest = min(free.min(), 0.5 * free.max()) if make is eight else free.min()
        if tightest < TIGHTEST:
            raise EnvError(
                f"path: no room for {path!r} round which the formation reaches {extent.max():.1f} m"
                f"; expected a larger room, a smaller spacing or fewer cars"
            )
        return Curve.through(make(free), True)
    corners = points("path", path, 3 if closed else 2)
    trace = rounded(corners, closed)
    if np.any(np.abs(trace) > free + 1e-9):
        raise EnvError(
            f"path: expected points within {free[0]:.1f} m and {free[1]:.1f} m of the room's "
            f"middle, so that the formation stays in the room"
        )
    return Curve.through(trace, closed)
