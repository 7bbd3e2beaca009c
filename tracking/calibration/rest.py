"""Rest phases of a node: windows in which neither gyroscope nor accelerometer changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

MAX_GAP = 0.5
"""[s] Gap between samples that ends a phase."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RestParams:
    """Thresholds of rest, ten to forty times the noise of common IMUs."""

    window: float = 0.5
    """[s] Length of the quiet window."""
    gyr_std: float = 0.02
    """[rad/s] Largest standard deviation of an axis in a window."""
    acc_std: float = 0.1
    """[m/s2] Largest standard deviation of an axis in a window."""
    gyr_mean: float = 0.1
    """[rad/s] Largest mean rate; a faster one is a rotation, not an offset."""
    gyr_agree: float = 0.01
    """[rad/s] Largest deviation of a phase's mean from the median; beyond, it is a rotation."""
    duration: float = 1.0
    """[s] Shortest phase."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Rest phases of one node, in time order."""

    __repr__ = short_repr

    at_rest: Bool
    """True for samples at rest, (sample)."""
    span: F64
    """First and last time of each phase, (phase, 2) [s]."""
    n: F64
    """Number of samples of each phase, (phase)."""
    gyr: F64
    """Mean angular rate of each phase, body frame, (phase, 3) [rad/s]."""
    acc: F64
    """Mean specific force of each phase, body frame, (phase, 3) [m/s2]."""

    @property
    def duration(self) -> float:
        """Time at rest [s]."""
        return float(np.sum(self.span[:, 1] - self.span[:, 0]))


def find_rest(t: F64, imu: F64, params: RestParams | None = None) -> Rest:
    """Find the phases in which a node is at rest.

    Args:
        t: Times, ascending, (sample) [s].
        imu: Gyroscope [rad/s] and specific force [m/s2], body frame, (sample, 6).
        params: Thresholds of rest.
    """
    p = params or RestParams()
    quiet = _quiet(t, imu, p)
    spans = []
    edges = np.nonzero(np.diff(quiet.astype(int), prepend=0, append=0))[0].reshape(-1, 2)
    for start, stop in edges:
        gaps = start + 1 + np.nonzero(np.diff(t[start:stop]) > MAX_GAP)[0]
        bounds = [start, *gaps, stop]
        spans += [
            (a, b)
            for a, b in zip(bounds[:-1], bounds[1:], strict=True)
            if t[b - 1] - t[a] >= p.duration
        ]
    mean = np.array([imu[a:b].mean(axis=0) for a, b in spans]).reshape(-1, 6)
    if spans:
        middle = np.median(np.concatenate([imu[a:b, :3] for a, b in spans]), axis=0)
        agree = np.abs(mean[:, :3] - middle).max(axis=1) <= p.gyr_agree
        spans = [span for span, ok in zip(spans, agree, strict=True) if ok]
        mean = mean[agree]
    at_rest = np.zeros(len(t), dtype=bool)
    for a, b in spans:
        at_rest[a:b] = True
    return Rest(
        at_rest,
        np.array([(t[a], t[b - 1]) for a, b in spans]).reshape(-1, 2),
        np.array([b - a for a, b in spans], dtype=np.float64),
        mean[:, :3],
        mean[:, 3:],
    )


def _quiet(t: F64, imu: F64, p: RestParams) -> Bool:
    """Return a mask of samples in the middle of a quiet window, (sample)."""
    dt = np.diff(t)
    usual = float(np.median(dt[dt > 0.0])) if (dt > 0.0).any() else p.window
    n = max(round(p.window / usual), 3)
    if len(t) < n:
        return np.zeros(len(t), dtype=bool)
    x = imu - np.median(imu, axis=0)
    total = np.concatenate([np.zeros((1, 6)), np.cumsum(x, axis=0)])
    square = np.concatenate([np.zeros((1, 6)), np.cumsum(x**2, axis=0)])
    mean = (total[n:] - total[:-n]) / n
    var = np.maximum((square[n:] - square[:-n]) / n - mean**2, 0.0)
    mean += np.median(imu, axis=0)
    still = (var <= np.repeat([p.gyr_std, p.acc_std], 3) ** 2).all(axis=1)
    still &= np.linalg.norm(mean[:, :3], axis=1) <= p.gyr_mean
    window = np.clip(np.arange(len(t)) - n // 2, 0, len(still) - 1)
    return np.asarray(still[window])
