"""Multidimensional scaling: the shape of a group from its distances, classical and weighted.

With D the matrix of distances and J the centring matrix, the kernel

    K = -1/2 J D**2 J,   K = E diag(lambda) E^T,   X = E_d diag(sqrt(lambda_d))

gives positions X that reproduce D exactly where D is Euclidean in d dimensions, and the best
rank-d fit of K otherwise [1]. (The text of the paper takes the square root twice.) Distances
are invariant to rotation, translation and reflection: X is then aligned to known positions by the
orthogonal Procrustes problem [2], reflections included.

Classical MDS weights every distance alike, and aligns with one rotation for all vectors. The
weighted form [3] takes relative positions with their covariances: if these are certain of lengths
only, it is classical MDS with Procrustes to first order. Its compiled form is in
`tracking.filters.pair.mds_feedback`; this is the reference implementation.

References:
    [1] Torgerson, Psychometrika 17 (1952) 401.
    [2] Schoenemann, Psychometrika 31 (1966) 1.
    [3] De Leeuw, Heiser, Multidimensional scaling with restrictions on the configuration, in
        Multivariate Analysis V, 1980.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, I64
from tracking.geometry import best_rotation


def classical_mds(distance: F64, dimensions: int) -> F64:
    """Return centred positions that reproduce the distances.

    Args:
        distance: Symmetric distances, (node, node) [m].
        dimensions: 2 or 3.

    Returns:
        Positions, (node, 3) [m], z = 0 in two dimensions; rotation and mirror image arbitrary.
    """
    n = len(distance)
    J = np.eye(n) - 1.0 / n
    K = -0.5 * J @ (distance * distance) @ J
    eigenvalues, E = np.linalg.eigh(K)
    used = min(dimensions, n)
    X = np.zeros((n, 3))
    X[:, :used] = E[:, ::-1][:, :used] * np.sqrt(np.maximum(eigenvalues[::-1][:used], 0.0))
    return X


def refine_positions(pos: F64, dimensions: int) -> F64:
    """Return the positions by MDS of the distances, aligned to the relative positions.

    Args:
        pos: Relative position of every ordered pair, p_j - p_i, (node, node, 3) [m]. Their sum
            around a triangle need not be zero.
        dimensions: 2 or 3.

    Returns:
        One consistent set of centred positions, (node, 3) [m].
    """
    X = classical_mds(np.linalg.norm(pos, axis=-1), dimensions)
    # Least squares over all pairs: p_j is the mean of p_j - p_i over i, in centred form.
    target = pos.mean(axis=0)
    R = best_rotation(X, target, planar=dimensions == 2, reflect=True)
    refined: F64 = X @ R.T
    return refined


def weighted_mds(x: F64, cov: F64, pairs: I64) -> F64:
    """Return the least-squares states of nodes over all pairs, weighted by their covariances.

    They minimise the stress ``sum (y_j - y_i - x_ij)^T P_ij^-1 (y_j - y_i - x_ij)``.

    Args:
        x: State of node j minus that of node i, (pair, k).
        cov: Covariance P of `x`, (pair, k, k).
        pairs: Node indices, (pair, 2).

    Returns:
        State of each node relative to node 0, (node, k).
    """
    n, k = int(pairs.max()) + 1, x.shape[1]
    B = np.zeros((len(pairs), n))
    rows = np.arange(len(pairs))
    B[rows, pairs[:, 1]], B[rows, pairs[:, 0]] = 1.0, -1.0
    root = np.linalg.inv(np.linalg.cholesky(cov))
    A = np.einsum("pab,pn->panb", root, B[:, 1:]).reshape(len(pairs) * k, (n - 1) * k)
    b = np.einsum("pab,pb->pa", root, x).reshape(-1)
    y = np.zeros((n, k))
    y[1:] = np.linalg.lstsq(A, b)[0].reshape(n - 1, k)
    return y
