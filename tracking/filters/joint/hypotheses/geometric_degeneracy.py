"""Degeneracy of a layout: its extent across the line or plane that it is nearest to.

Evaluated ten times a second in every group, so the few numbers are worked out by hand: a library
takes longer for them than all other checks.

References:
    [1] Smith, Eigenvalues of a symmetric 3x3 matrix, Comm. ACM 4 (1961) 168.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel


@kernel
def degeneracy_ratio(c, s, h, turns):
    """Extent of the layout across itself over its standard deviation; infinite for few nodes.

    Args:
        c: Coefficients.
        s: JointState of one environment.
        h: Hypothesis without pending updates.
        turns: Whether an error that is a turn of the whole group counts. In space it may be large,
            and makes the layout no flatter.
    """
    d = c.d
    scatter, present = scatter_of(c, s, h)
    if present <= d:
        return math.inf
    squared, across = least_axis(scatter, d)
    # (e^T P e) of the positions along it, less that of their mean
    own, total = 0.0, 0.0
    for i in range(s.nodes.shape[0]):
        if not s.nodes[i].present:
            continue
        for j in range(s.nodes.shape[0]):
            if not s.nodes[j].present:
                continue
            part = covariance_across(s, h, i, j, across, d)
            total += part
            if i == j:
                own += part
    variance = own - total / present
    if d == 3 and not turns:
        variance -= rotation_variance_across(c, s, h, scatter, across)
    return math.sqrt(squared / max(variance, 1e-12))


@small_kernel
def covariance_across(s, h, i, j, across, d):
    """Covariance of the positions of nodes i and j along one direction."""
    part = 0.0
    for k in range(d):
        for q in range(d):
            P_kq = s.P[h, s.nodes[i].i_pos + k, s.nodes[j].i_pos + q]
            part += across[k] * across[q] * P_kq
    return part


@kernel
def rotation_variance_across(c, s, h, scatter, across):
    """The part of the variance across a layout that is linear in where a node is along it."""
    xx, xy, xz, yy, yz, zz = scatter
    a0, a1, a2 = null_axis(across[0] ** 2, across[0] * across[1], across[0] * across[2],
        across[1] ** 2, across[1] * across[2], across[2] ** 2)  # fmt: skip
    b0, b1, b2 = (
        across[1] * a2 - across[2] * a1,
        across[2] * a0 - across[0] * a2,
        across[0] * a1 - across[1] * a0,
    )
    x, y, z = xx * a0 + xy * a1 + xz * a2, xy * a0 + yy * a1 + yz * a2, xz * a0 + yz * a1 + zz * a2
    aa, ab = a0 * x + a1 * y + a2 * z, b0 * x + b1 * y + b2 * z
    bb = xx + yy + zz - aa - across_itself(scatter, across)
    det = aa * bb - ab * ab
    if det <= 1e-9 * (aa + bb) * (aa + bb):
        return 0.0
    m0, m1, m2, present = 0.0, 0.0, 0.0, 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at = s.nodes[i].i_pos
            m0, m1, m2 = m0 + s.x[h, at], m1 + s.x[h, at + 1], m2 + s.x[h, at + 2]
            present += 1
    total = 0.0
    for i in range(s.nodes.shape[0]):
        for j in range(s.nodes.shape[0]):
            if s.nodes[i].present and s.nodes[j].present:
                p, q = s.nodes[i].i_pos, s.nodes[j].i_pos
                x, y, z = s.x[h, p] - m0 / present, s.x[h, p + 1] - m1 / present, s.x[h, p + 2]
                z -= m2 / present
                u_i, v_i = a0 * x + a1 * y + a2 * z, b0 * x + b1 * y + b2 * z
                x, y, z = s.x[h, q] - m0 / present, s.x[h, q + 1] - m1 / present, s.x[h, q + 2]
                z -= m2 / present
                u_j, v_j = a0 * x + a1 * y + a2 * z, b0 * x + b1 * y + b2 * z
                alike = u_i * (bb * u_j - ab * v_j) + v_i * (aa * v_j - ab * u_j)
                total += alike / det * covariance_across(s, h, i, j, across, 3)
    return total


@small_kernel
def across_itself(scatter, e):
    """``e^T S e`` of a symmetric matrix."""
    xx, xy, xz, yy, yz, zz = scatter
    mixed = e[0] * e[1] * xy + e[0] * e[2] * xz + e[1] * e[2] * yz
    return e[0] ** 2 * xx + e[1] ** 2 * yy + e[2] ** 2 * zz + 2.0 * mixed


@kernel
def scatter_of(c, s, h):
    """``sum x x^T`` of the positions from their mean, xx, xy, xz, yy, yz, zz, and how many.

    The height of a plane is 0.
    """
    m0, m1, m2, present = 0.0, 0.0, 0.0, 0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at = s.nodes[i].i_pos
            present += 1
            m0 += s.x[h, at]
            m1 += s.x[h, at + 1]
            m2 += s.x[h, at + 2] if c.d == 3 else 0.0
    share = 1.0 / max(present, 1)
    m0, m1, m2 = share * m0, share * m1, share * m2
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(s.nodes.shape[0]):
        if s.nodes[i].present:
            at = s.nodes[i].i_pos
            x, y = s.x[h, at] - m0, s.x[h, at + 1] - m1
            z = s.x[h, at + 2] - m2 if c.d == 3 else 0.0
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
    return (xx, xy, xz, yy, yz, zz), present


@kernel
def least_axis(scatter, d):
    """The least eigenvalue of a symmetric matrix, at least 0, and its direction, three numbers.

    Args:
        scatter: xx, xy, xz, yy, yz, zz.
        d: 2 for the upper left four of them only, or 3.
    """
    xx, xy, xz, yy, yz, zz = scatter
    if d == 2:
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)  # of the greatest
        least = 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy)
        return max(least, 0.0), (-math.sin(angle), math.cos(angle), 0.0)
    # The roots of the characteristic polynomial by the cosine of a third of an angle [1].
    mean = (xx + yy + zz) / 3.0
    a, b, e = xx - mean, yy - mean, zz - mean
    spread = math.sqrt((a * a + b * b + e * e + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    if spread <= 1e-15 * mean:
        return max(mean, 0.0), (0.0, 0.0, 1.0)
    det = a * (b * e - yz * yz) - xy * (xy * e - yz * xz) + xz * (xy * yz - b * xz)
    third = math.acos(min(max(0.5 * det / spread**3, -1.0), 1.0)) / 3.0
    least = mean + 2.0 * spread * math.cos(third + 2.0 * math.pi / 3.0)
    return max(least, 0.0), null_axis(xx - least, xy, xz, yy - least, yz, zz - least)


@kernel
def null_axis(xx, xy, xz, yy, yz, zz):
    """A unit vector that a singular symmetric matrix takes to 0: across its rows."""
    n0, n1, n2, most = 0.0, 0.0, 1.0, 0.0
    rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    largest, size = rows[0], 0.0
    for k in range(3):
        a, b = rows[k], rows[(k + 1) % 3]
        c0, c1, c2 = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        squared = c0 * c0 + c1 * c1 + c2 * c2
        if squared > most:
            n0, n1, n2, most = c0, c1, c2, squared
        squared = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
        if squared > size:
            largest, size = a, squared
    if most <= 1e-20 * size * size:
        # All rows point one way: anything across it.
        if abs(largest[0]) < max(abs(largest[1]), abs(largest[2])):
            n0, n1, n2 = 0.0, largest[2], -largest[1]
        else:
            n0, n1, n2 = largest[1], -largest[0], 0.0
    length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return n0 / length, n1 / length, n2 / length
