"""Estimates of a recording as a table."""

from __future__ import annotations

import csv
import io

import numpy as np

from tracking.constellation import Constellation
from tracking.estimate import Status, TeamEstimate
from tracking.metrics.integrity import protection_radius


def pair_name(constellation: Constellation, pair: int) -> str:
    """Return the name of a pair from the ids of its nodes, "1-2"."""
    i, j = constellation.pairs[pair]
    return f"{constellation.ids[i]}-{constellation.ids[j]}"


def estimates_csv(estimate: TeamEstimate) -> str:
    """Return a run as CSV: one row per time and pair with an estimate."""
    constellation = estimate.constellation
    ids = [(constellation.ids[i], constellation.ids[j]) for i, j in constellation.pairs]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["t_s", "node_i", "node_j", "x", "y", "z", "vx", "vy", "vz", "sx", "sy", "sz",
         "protection", "status"]
    )  # fmt: skip
    std, radius = estimate.pos_std, protection_radius(estimate)
    for k, t in enumerate(estimate.t):
        for p, (i, j) in enumerate(ids):
            status = Status(int(estimate.status[k, p]))
            if status in (Status.ABSENT, Status.STARTING):
                continue
            numbers = (*estimate.pos_ij_w[k, p], *estimate.vel_ij_w[k, p], *std[k, p])
            within = f"{radius[k, p]:.5f}" if np.isfinite(radius[k, p]) else ""
            row = [f"{t:.6f}", i, j, *(f"{v:.5f}" for v in numbers), within, status.name.lower()]
            writer.writerow(row)
    return text.getvalue()
