"""Classical multidimensional scaling: the shape of a group from its distances.

With D the matrix of distances and J the centring matrix, the kernel

    K = -1/2 J D**2 J,   K = E diag(lambda) E^T,   X = E_d diag(sqrt(lambda_d))

gives positions X that reproduce D exactly where D is Euclidean in d dimensions, and the best
rank-d fit of K otherwise [1]. (The text of the paper takes the square root twice.) Distances
do not see rotations, shifts and mirror images: X is then aligned to positions known otherwise
by the orthogonal Procrustes problem [2], mirror images included.

The compiled form for one group is in `tracking.filters.pair._mds_kernels`; this is its plain twin.

References:
    [1] Torgerson, Psychometrika 17 (1952) 401.
    [2] Schoenemann, Psychometrika 31 (1966) 1.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64
from tracking.geometry import best_rotation


def classical_mds(distance: F64, dimensions: int) -> F64:
    """Centred positions that reproduce the distances.

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
    """Positions with the shape that MDS gives their distances, aligned to themselves.

    Args:
        pos: Relative position of every ordered pair, p_j - p_i, (node, node, 3) [m]. They
            need not close around a triangle.
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
