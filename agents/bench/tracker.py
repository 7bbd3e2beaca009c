"""How long the tracker takes for a ranging round, beside filterpy doing the same updates."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from agents.errors import UsageError
from tracking.arrays import F64
from tracking.constellation import Constellation, NodeConfig
from tracking.filters import FILTERS
from tracking.measurements import Kind, MeasurementBlock
from tracking.ranging.airtime import PAPER_PHY, round_rate
from tracking.tracker import Tracker

REPEATS = 5
"""The fastest of so many runs counts, for both sides."""


def bench_tracker(
    *, rounds: int = 2000, progress: Callable[[float], None] | None = None
) -> list[dict[str, Any]]:
    """Microseconds per round of 3 and 6 nodes, every filter, beside filterpy.

    A round is a new orientation and acceleration of every node and one range of every pair.

    Raises:
        UsageError: filterpy is not installed.
    """
    try:
        import filterpy
    except ImportError:
        raise UsageError(
            "bench: filterpy is not installed, expected the development tools: "
            ".venv/bin/pip install -e '.[dev]' -c constraints.txt"
        ) from None
    rows = []
    cases = [(n, name) for n in (3, 6) for name in FILTERS]
    for k, (n, name) in enumerate(cases):
        ours = _ours(n, name, rounds)
        theirs = _filterpy(n, max(rounds // 20, 20))
        rows.append(
            {
                "bench": "tracker",
                "case": f"{name}, {n} nodes",
                "value": ours,
                "unit": "us/round",
                "peer": f"filterpy {filterpy.__version__}",
                "peer_value": theirs,
                "ratio": theirs / ours,
            }
        )
        if progress is not None:
            progress((k + 1) / len(cases))
    return rows


DIMENSIONS: dict[int, Literal[2, 3]] = {3: 2, 6: 3}
"""The cars and the body trackers of the paper: three nodes in a plane, six in space."""


def moving_group(n: int, seconds: float) -> tuple[Constellation, MeasurementBlock]:
    """Nodes on circles of their own, with exact measurements of every round."""
    d = DIMENSIONS[n]
    constellation = Constellation(nodes=tuple(NodeConfig(id=k) for k in range(n)), dimensions=d)
    hz = round_rate(PAPER_PHY, n)
    t = np.arange(1, int(seconds * hz)) / hz
    rate = 1.0 + 0.3 * np.arange(n)
    phase = rate * t[:, None] + np.arange(n)
    axes = np.stack([np.cos(phase), np.sin(phase), 0.4 * np.sin(1.3 * phase)], axis=-1)
    centre = np.stack([np.cos(np.arange(n)), np.sin(2.0 * np.arange(n)), 0.3 * np.arange(n)], -1)
    axes[..., d:], centre[..., d:] = 0.0, 0.0
    pos = 2.0 * centre + axes
    accel = -((rate[:, None] * np.array([1.0, 1.0, 1.3])) ** 2) * axes
    blocks = []
    for k in range(n):
        values = np.zeros((len(t), 7))
        values[:, 0] = 1.0
        values[:, 4:] = accel[:, k]
        blocks.append(
            MeasurementBlock.of_kind(Kind.STATE, t, np.full(len(t), k, dtype=np.int64), values)
        )
    for i, j in constellation.pairs:
        distance = np.linalg.norm(pos[:, j] - pos[:, i], axis=-1)[:, None]
        ends = np.full(len(t), i, dtype=np.int64), np.full(len(t), j, dtype=np.int64)
        blocks.append(
            MeasurementBlock.of_kind(Kind.RANGE, t, ends[0], distance, j=ends[1], antennas=ends)
        )
    return constellation, MeasurementBlock.concatenate(blocks).sorted()


def _ours(n: int, name: str, rounds: int) -> float:
    """Our time per round [us], once the group has started."""
    warm_up = 20.0
    hz = round_rate(PAPER_PHY, n)
    constellation, block = moving_group(n, warm_up + rounds / hz + 1.0)
    start = int(np.searchsorted(block.t[0], warm_up))
    per_round = n + constellation.n_pairs
    tracker = Tracker(constellation, filter=name)
    tracker.step(block.take(slice(0, start)), float(block.t[0, start - 1]))
    chunk = block.take(slice(start, start + rounds * per_round))
    end = float(chunk.t[0, -1])
    saved = tracker.save()
    best = np.inf
    for _ in range(REPEATS):
        tracker.restore(saved)
        began = time.perf_counter()
        tracker.step(chunk, end)
        best = min(best, time.perf_counter() - began)
    return 1e6 * float(best) / rounds


def _filterpy(n: int, rounds: int) -> float:
    """The peer's time per round [us]: one prediction and one range update of every pair."""
    from filterpy.kalman import ExtendedKalmanFilter

    dt, d = 1.0 / round_rate(PAPER_PHY, n), DIMENSIONS[n]
    eye = np.eye(d)
    F = np.block([[eye, dt * eye], [0.0 * eye, eye]])  # noqa: N806
    B = np.vstack([0.5 * dt * dt * eye, dt * eye])  # noqa: N806

    def jacobian(x: F64) -> F64:
        row = np.zeros((1, 2 * d))
        row[0, :d] = x[:d, 0] / np.linalg.norm(x[:d, 0])
        return row

    def distance(x: F64) -> F64:
        return np.array([[np.linalg.norm(x[:d, 0])]])

    filters = []
    for _ in range(n * (n - 1) // 2):
        ekf = ExtendedKalmanFilter(dim_x=2 * d, dim_z=1)
        ekf.x = np.concatenate([np.array([2.0, 1.0, 0.5])[:d], np.zeros(d)])[:, None]
        ekf.F, ekf.B = F, B
        ekf.Q, ekf.R = 1e-3 * B @ B.T / dt, np.array([[0.01]])
        filters.append(ekf)
    accel, z = np.full((d, 1), 0.1), np.array([[2.3]])
    best = np.inf
    for _ in range(REPEATS):
        began = time.perf_counter()
        for _ in range(rounds):
            for ekf in filters:
                ekf.predict(accel)
                ekf.update(z, jacobian, distance)
        best = min(best, time.perf_counter() - began)
    return 1e6 * float(best) / rounds
