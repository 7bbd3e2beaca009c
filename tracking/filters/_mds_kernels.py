"""The MDS step of one group, compiled; `tracking.mds.refine_positions` is its plain twin."""

from __future__ import annotations

import numpy as np
from tracking.compiled import kernel


@kernel
def refine(pos, d, X):
    """Consistent positions from the relative positions of all pairs.

    Args:
        pos: p_j - p_i of every ordered pair, (node, node, 3) [m].
        d: 2 or 3 dimensions.
        X: Refined centred positions, (node, 3), written.

    Returns:
        The smallest spread of the layout, its root-mean-square extent [m] along the least of
        its d axes; near zero the mirror image cannot be told from the distances.
    """
    n = pos.shape[0]
    K = np.empty((n, n))
    row_mean = np.zeros(n)
    total = 0.0
    for i in range(n):
        for j in range(n):
            s = pos[i, j, 0] ** 2 + pos[i, j, 1] ** 2 + pos[i, j, 2] ** 2
            K[i, j] = s
            row_mean[i] += s / n
        total += row_mean[i] / n
    for i in range(n):
        for j in range(n):
            K[i, j] = -0.5 * (K[i, j] - row_mean[i] - row_mean[j] + total)
    eigenvalues, E = np.linalg.eigh(K)
    Y = np.zeros((n, d))
    used = min(d, n)
    for k in range(used):
        root = np.sqrt(max(eigenvalues[n - 1 - k], 0.0))
        for i in range(n):
            Y[i, k] = E[i, n - 1 - k] * root
    spread = np.sqrt(max(eigenvalues[n - used], 0.0) / n) if used == d else 0.0

    target = np.zeros((n, d))
    for j in range(n):
        for k in range(d):
            s = 0.0
            for i in range(n):
                s += pos[i, j, k]
            target[j, k] = s / n
    H = np.zeros((d, d))
    for a in range(d):
        for b in range(d):
            for i in range(n):
                H[a, b] += target[i, a] * Y[i, b]
    U, _, Vt = np.linalg.svd(H)
    for i in range(n):
        X[i, 2] = 0.0
        for a in range(d):
            s = 0.0
            for b in range(d):
                R_ab = 0.0
                for k in range(d):
                    R_ab += U[a, k] * Vt[k, b]
                s += R_ab * Y[i, b]
            X[i, a] = s
    return spread
