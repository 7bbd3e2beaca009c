"""Robust fit of an ellipsoid or ellipse to points with a few outliers.

The fit is the quadric ``x^T Q x + 2 q^T x + r = 0`` of least algebraic error under a constraint
that only ellipsoids satisfy: ``4 J - I^2 = 1`` in space [1], with I and J the first two invariants
of Q, and ``J = 1`` in the plane [2]. It starts from the best of many small random subsets (least
median of squares); then points beyond 3.5 standard deviations are excluded.

References:
    [1] Li, Griffiths, Least squares ellipsoid specific fitting, GMP 2004.
    [2] Fitzgibbon, Pilu, Fisher, IEEE Trans. PAMI 21 (1999) 476.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

N_TRIALS = 100
N_SUBSET = 20
GATE = 3.5
"""[-] Standard deviations beyond which a point is an outlier."""


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """The points x with ``|root (x - centre)| = 1``, in 2 or 3 dimensions."""

    __repr__ = short_repr

    centre: F64
    """Centre, (d), in the unit of the points."""
    root: F64
    """Symmetric positive definite matrix, (d, d), in the inverse unit."""

    @property
    def radius(self) -> float:
        """Geometric mean of the semi-axes, in the unit of the points."""
        return float(np.linalg.det(self.root) ** (-1.0 / len(self.centre)))

    @property
    def axis_ratio(self) -> float:
        """Ratio of longest to shortest semi-axis [-]."""
        return float(np.linalg.cond(self.root))

    def misfit(self, x: F64) -> F64:
        """Return the deviations of points, relative to the radius, (point) [-]."""
        length: F64 = np.linalg.norm((x - self.centre) @ self.root, axis=1)
        return length - 1.0


def fit_ellipsoid(x: F64, rng: np.random.Generator) -> tuple[Ellipsoid, Bool] | None:
    """Fit an ellipsoid (or an ellipse) to most of the points.

    Args:
        x: Points, (point, d) with d 2 or 3.
        rng: Generator of the initial subsets.

    Returns:
        The ellipsoid and a mask of inliers, (point); None if no ellipsoid fits.
    """
    best, least = None, np.inf
    for _ in range(N_TRIALS):
        trial = fit_algebraic(x[rng.choice(len(x), min(N_SUBSET, len(x)), replace=False)])
        if trial is None:
            continue
        median = float(np.median(np.abs(trial.misfit(x))))
        if median < least:
            best, least = trial, median
    if best is None:
        return None
    inlier = np.zeros(len(x), dtype=bool)
    for _ in range(20):
        misfit = np.abs(best.misfit(x))
        now = misfit <= max(GATE * 1.4826 * float(np.median(misfit)), 1e-6)
        if np.array_equal(now, inlier):
            break
        inlier = now
        refined = fit_algebraic(x[inlier])
        if refined is None:
            return None
        best = refined
    return best, inlier


def fit_algebraic(x: F64) -> Ellipsoid | None:
    """Return the ellipsoid of least algebraic error, outliers included; None if there is none.

    Args:
        x: Points, (point, d) with d 2 or 3.
    """
    d = x.shape[1]
    middle = x.mean(axis=0)
    size = float(np.sqrt(np.mean((x - middle) ** 2)))
    if size == 0.0:
        return None
    y = (x - middle) / size
    a, b = np.triu_indices(d)
    quadratic = np.where(a == b, 1.0, 2.0) * y[:, a] * y[:, b]
    linear = np.concatenate([2.0 * y, np.ones((len(y), 1))], axis=1)
    # The best linear part for any quadratic part leaves only the latter to find.
    linear_of = -np.linalg.lstsq(linear, quadratic, rcond=None)[0]
    reduced = quadratic + linear @ linear_of
    constraint = _constraint(d)
    vectors = np.linalg.eig(np.linalg.solve(constraint, reduced.T @ reduced))[1].real
    value = np.einsum("ik,ij,jk->k", vectors, constraint, vectors)
    v = vectors[:, int(np.argmax(value))]
    rest = linear_of @ v
    quadric = np.zeros((d, d))
    quadric[a, b] = quadric[b, a] = v
    if np.trace(quadric) < 0.0:
        quadric, rest = -quadric, -rest
    eigenvalues, axes = np.linalg.eigh(quadric)
    if eigenvalues[0] <= 1e-9 * eigenvalues[-1]:
        return None
    centre = -np.linalg.solve(quadric, rest[:d])
    level = float(centre @ quadric @ centre - rest[d])
    if level <= 0.0:
        return None
    root = (axes * np.sqrt(eigenvalues / level)) @ axes.T
    return Ellipsoid(middle + size * centre, root / size)


def fit_circle(x: F64) -> Ellipsoid:
    """Return the circle (or sphere) of least algebraic error.

    Args:
        x: Points, (point, d).
    """
    middle = x.mean(axis=0)
    y = x - middle
    design = np.concatenate([2.0 * y, np.ones((len(y), 1))], axis=1)
    solution = np.linalg.lstsq(design, np.sum(y**2, axis=1), rcond=None)[0]
    centre = solution[:-1]
    radius = float(np.sqrt(max(solution[-1] + centre @ centre, 1e-12)))
    return Ellipsoid(middle + centre, np.eye(x.shape[1]) / radius)


def _constraint(d: int) -> F64:
    """Return the matrix C of the constraint ``v^T C v = 1`` on the upper triangle v of Q."""
    a, b = np.triu_indices(d)
    diagonal, off = np.nonzero(a == b)[0], np.nonzero(a != b)[0]
    matrix = np.zeros((len(a), len(a)))
    if d == 2:
        matrix[np.ix_(diagonal, diagonal)] = 0.5 * (1.0 - np.eye(2))
        matrix[off, off] = -1.0
    else:
        matrix[np.ix_(diagonal, diagonal)] = 1.0 - 2.0 * np.eye(3)
        matrix[off, off] = -4.0
    return matrix
