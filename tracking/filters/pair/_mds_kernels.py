"""The MDS step of one group, compiled: shape and alignment in one closed form.

Classical MDS factors the centred kernel ``K = -1/2 J D^2 J = X X^T``, and the orthogonal
Procrustes problem turns X towards known positions T. For a kernel of rank d both are one
expression, with no eigenvalues of K: with ``A = X^T T`` and its polar factor Q,

    M = T^T K T = A^T A,     K T M^(-1/2) = X A (A^T A)^(-1/2) = X Q

Noise makes K only nearly of rank d; T spans nearly its leading space, and a second pass with
T replaced by the result brings the difference to second order. `tracking.mds` is the plain
twin with eigenvectors and a singular value decomposition.
"""

from __future__ import annotations

import math

from tracking.compiled import small_kernel

PASSES = 2
SWEEPS = 6


@small_kernel
def inverse_root(M, V, d, rank):
    """``M^(-1/2)`` of a symmetric matrix, in place; returns its least eigenvalue in use.

    Jacobi rotations, exact to rounding for d <= 3 in a few sweeps.

    Args:
        M: Symmetric, (3, 3); replaced.
        V: Scratch, (3, 3).
        d: 2 or 3.
        rank: Directions that are used, the greatest.
    """
    for r in range(d):
        for k in range(d):
            V[r, k] = 1.0 if r == k else 0.0
    for _ in range(SWEEPS):
        off = 0.0
        for r in range(d):
            for k in range(r + 1, d):
                off += M[r, k] * M[r, k]
        if off < 1e-30 * (M[0, 0] * M[0, 0] + M[1, 1] * M[1, 1] + 1e-300):
            break
        for a in range(d):
            for b in range(a + 1, d):
                if M[a, b] == 0.0:
                    continue
                theta = (M[b, b] - M[a, a]) / (2.0 * M[a, b])
                t = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(d):
                    m_a, m_b = M[k, a], M[k, b]
                    M[k, a], M[k, b] = c * m_a - s * m_b, s * m_a + c * m_b
                for k in range(d):
                    m_a, m_b = M[a, k], M[b, k]
                    M[a, k], M[b, k] = c * m_a - s * m_b, s * m_a + c * m_b
                for k in range(d):
                    v_a, v_b = V[k, a], V[k, b]
                    V[k, a], V[k, b] = c * v_a - s * v_b, s * v_a + c * v_b
    e0, e1, e2 = M[0, 0], M[1, 1], M[2, 2] if d == 3 else math.inf
    least = min(e0, e1, e2)
    if rank < d:
        # Fewer nodes than span the space: the direction across them is left out.
        least = e0 + e1 + (e2 if d == 3 else 0.0) - least - max(e0, e1, e2 if d == 3 else 0.0)
        if d == 2:
            least = max(e0, e1)
    floor = max(0.5 * least, 1e-12)
    w0 = 1.0 / math.sqrt(e0) if e0 >= floor else 0.0
    w1 = 1.0 / math.sqrt(e1) if e1 >= floor else 0.0
    w2 = 1.0 / math.sqrt(e2) if d == 3 and e2 >= floor else 0.0
    for r in range(d):
        for k in range(d):
            s = V[r, 0] * w0 * V[k, 0] + V[r, 1] * w1 * V[k, 1]
            M[r, k] = s + V[r, 2] * w2 * V[k, 2] if d == 3 else s
    return least


@small_kernel
def refine(T, K, X, small, m, d):
    """Shape from squared distances, aligned to known positions.

    Args:
        T: Centred known positions, (node, 3) [m]; replaced by the refined ones.
        K: Squared distances of the first m nodes, (node, node) [m2]; replaced by the kernel.
        X: Scratch, (node, 3).
        small: Scratch, (2, 3, 3).
        m: Nodes used.
        d: 2 or 3 dimensions.

    Returns:
        The smallest spread of the layout, its root-mean-square extent [m] along the least of
        its d axes; near zero the mirror image cannot be told from the distances.
    """
    total = 0.0
    for i in range(m):
        s = 0.0
        for j in range(m):
            s += K[i, j]
        X[i, 0] = s / m
        total += s / (m * m)
    for i in range(m):
        for j in range(m):
            K[i, j] = -0.5 * (K[i, j] - X[i, 0] - X[j, 0] + total)
    M, V = small[0], small[1]
    spread = 0.0
    for _ in range(PASSES):
        for i in range(m):
            for k in range(d):
                s = 0.0
                for j in range(m):
                    s += K[i, j] * T[j, k]
                X[i, k] = s
        for r in range(d):
            for k in range(r, d):
                s = 0.0
                for i in range(m):
                    s += T[i, r] * X[i, k]
                M[r, k] = s
                M[k, r] = s
        # T near X makes M near (X^T X)^2, so its fourth root is an extent.
        least = inverse_root(M, V, d, min(d, m - 1))
        spread = math.sqrt(math.sqrt(max(least, 0.0)) / m)
        for i in range(m):
            for k in range(d):
                s = 0.0
                for r in range(d):
                    s += X[i, r] * M[r, k]
                T[i, k] = s
    return spread
