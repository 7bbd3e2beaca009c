"""True distances between the antennas of every range of a log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.geometry import rotate
from tracking.log.truth import MAX_GAP, Truth
from tracking.measurements import Kind, MeasurementBlock
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class RangeTable:
    """The ranges of one environment, in order."""

    __repr__ = short_repr

    t: F64
    """Times, (range) [s]."""
    i: I64
    """Node index, (range)."""
    j: I64
    """Other node index, (range)."""
    measured: F64
    """Measured ranges, (range) [m]."""
    true: F64
    """Distance between the antennas, (range) [m]; 0 if unknown."""
    known: Bool
    """True if the distance is known, (range)."""


def range_table(block: MeasurementBlock, constellation: Constellation, truth: Truth) -> RangeTable:
    """Return the ranges of environment 0 with their true distances.

    A distance is known if both positions are known and, for an antenna away from the origin of
    its body, the orientation too.

    Args:
        block: Measurements; RANGE events are used.
        constellation: Nodes and antennas.
        truth: True positions and orientations.
    """
    r = block.take(block.valid[0] & (block.kind[0] == Kind.RANGE))
    t, inverse = np.unique(r.t[0], return_inverse=True)
    pos, known = truth.positions(constellation, t)
    ends, ok = [], np.ones(r.n_events, dtype=bool)
    for node, antenna in ((r.i[0], r.antenna_i[0]), (r.j[0], r.antenna_j[0])):
        end = pos[inverse, node]
        if constellation.dimensions == 2:
            end[:, 2] = 0.0  # heights are those of the mounts
        ok &= known[inverse, node]
        offset = constellation.antenna_offset_b[antenna]
        # In the plane a height alone needs no orientation.
        across = offset[:, :2] if constellation.dimensions == 2 else offset
        levered = np.any(across != 0.0, axis=1)
        end[~levered] += offset[~levered]
        for n in np.unique(node[levered]):
            mine = levered & (node == n)
            q, has = _orientation(truth, int(n), bool(constellation.is_static[n]), r.t[0, mine])
            end[mine] += rotate(q, offset[mine])
            ok[mine] &= has
        ends.append(end)
    true = np.linalg.norm(ends[1] - ends[0], axis=1)
    return RangeTable(r.t[0], r.i[0], r.j[0], r.values[0, :, 0], np.where(ok, true, 0.0), ok)


def _orientation(truth: Truth, node: int, static: bool, t: F64) -> tuple[F64, Bool]:
    """Interpolate the orientation of a node, (time, 4), with a mask of known ones, (time)."""
    rows = np.nonzero(truth.valid & truth.has_orientation & (truth.node == node))[0]
    if len(rows) == 0:
        return np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1)), np.zeros(len(t), dtype=bool)
    t_n, q_n = truth.t[rows], truth.q_wb[rows]
    if static:
        return np.tile(q_n[0], (len(t), 1)), np.ones(len(t), dtype=bool)
    after = np.searchsorted(t_n, t, side="left").clip(0, len(t_n) - 1)
    before = np.maximum(after - 1, 0)
    span = t_n[after] - t_n[before]
    share = np.where(span > 0.0, (t - t_n[before]) / np.where(span > 0.0, span, 1.0), 1.0)
    share = share.clip(0.0, 1.0)[:, None]
    # Use the nearer one of q and -q, which are the same rotation.
    sign = np.where(np.sum(q_n[before] * q_n[after], axis=1) < 0.0, -1.0, 1.0)[:, None]
    q = (1.0 - share) * q_n[before] + share * sign * q_n[after]
    norm = np.linalg.norm(q, axis=1, keepdims=True)
    inside = (t >= t_n[0]) & (t <= t_n[-1]) & (span <= MAX_GAP)
    known = (inside | (t_n[after] == t)) & (norm[:, 0] > 0.0)
    return q / np.where(norm > 0.0, norm, 1.0), known
