"""Peer GTSAM with the same ranges: its incremental fixed-lag smoother.

Position and velocity of every node are variables at every step. Motion factors with the measured
acceleration connect them to the previous step; each range is a factor. All factors are C++ classes
of GTSAM; building the graph in Python is not timed. Biases, headings, range errors and NLOS are
not modelled, so the peer does less.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from agents.bench.tracker.workload import RANGE_STD, Workload
from tracking.arrays import F64

LAG = 0.2
"""[s] States older than this are marginalised."""
ACCEL_PSD = 0.06
"""[m/s2/sqrt(Hz)] Noise density of the acceleration."""
LOOSE = 10.0
"""[m, m/s] Standard deviation of the prior that bounds the unobservable drift of the group."""


def gtsam_name() -> str | None:
    """Return the name of the peer with its version; None if it is not installed."""
    try:
        import gtsam  # noqa: F401
    except ImportError:
        return None
    from importlib.metadata import version

    return f"GTSAM {version('gtsam')}"


def smoother_cost(workload: Workload, steps: int) -> float:
    """Return the median time of a step after the lag window is full [us]."""
    peer = _Smoother(workload)
    full = round(LAG / workload.dt) + 5
    spent = [peer.step(k) for k in range(full + steps)]
    return 1e6 * float(np.median(spent[full:]))


class _Smoother:
    """The smoother with its estimates at the last step."""

    def __init__(self, workload: Workload) -> None:
        import gtsam

        params = gtsam.ISAM2Params()
        params.findUnusedFactorSlots = True
        self._smoother: Any = gtsam.IncrementalFixedLagSmoother(LAG, params)
        d = workload.dimensions
        self._workload, self._g, self._d = workload, gtsam, d
        self._range = gtsam.RangeFactor2 if d == 2 else gtsam.RangeFactor3
        self._between = gtsam.BetweenFactorPoint2 if d == 2 else gtsam.BetweenFactorPoint3
        self._prior = gtsam.PriorFactorPoint2 if d == 2 else gtsam.PriorFactorPoint3
        isotropic, dt = gtsam.noiseModel.Isotropic.Sigma, workload.dt
        self._range_noise = isotropic(1, RANGE_STD)
        self._v_noise = isotropic(d, ACCEL_PSD * dt**0.5)
        self._p_noise = isotropic(d, max(ACCEL_PSD * (dt**3 / 3.0) ** 0.5, 1e-3))
        self._first, self._loose = isotropic(d, 0.3), isotropic(d, LOOSE)
        t = np.array([0.0, 1e-4])
        pos = workload.pos(t)[..., :d]
        self._x, self._v = pos[0], (pos[1] - pos[0]) / 1e-4

    def step(self, k: int) -> float:
        """Add step k; return the time of the smoother [s]."""
        g, w, d = self._g, self._workload, self._d
        now = k * w.dt
        accel = w.accel(np.array([now - 0.5 * w.dt]))[0, :, :d]
        if k > 0:
            self._x = self._x + w.dt * self._v + 0.5 * w.dt**2 * accel
            self._v = self._v + w.dt * accel
        graph, values, times = g.NonlinearFactorGraph(), g.Values(), {}
        for i in range(w.n):
            p, v = self._key("p", i, k), self._key("v", i, k)
            values.insert(p, self._x[i])
            values.insert(v, self._v[i])
            times[p] = times[v] = now
            noise = self._first if k == 0 else self._loose
            graph.push_back(self._prior(p, self._x[i] if k == 0 else np.zeros(d), noise))
            graph.push_back(self._prior(v, self._v[i] if k == 0 else np.zeros(d), noise))
            if k > 0:
                self._tie(graph, i, k, accel[i])
        distance = w.distances(np.array([now]), k)[0]
        for (i, j), z in zip(w.pairs[k % len(w.pairs)].tolist(), distance, strict=True):
            ends = self._key("p", i, k), self._key("p", j, k)
            graph.push_back(self._range(*ends, z, self._range_noise))
        began = time.perf_counter()
        self._smoother.update(graph, values, times)
        estimate = self._smoother.calculateEstimate()
        spent = time.perf_counter() - began
        at = estimate.atPoint2 if d == 2 else estimate.atPoint3
        self._x = np.array([at(self._key("p", i, k)) for i in range(w.n)])
        self._v = np.array([at(self._key("v", i, k)) for i in range(w.n)])
        return spent

    def _tie(self, graph: Any, i: int, k: int, accel: F64) -> None:
        """Add the motion factors of node i from step k - 1 to k."""
        g, d, dt = self._g, self._d, self._workload.dt
        p0, v0 = self._key("p", i, k - 1), self._key("v", i, k - 1)
        p1, v1 = self._key("p", i, k), self._key("v", i, k)
        graph.push_back(self._between(v0, v1, dt * accel, self._v_noise))
        eye, origin = np.eye(d), g.Values()
        for key in (p0, v0, p1):
            origin.insert(key, np.zeros(d))
        linear = g.JacobianFactor(
            p0, -eye, v0, -dt * eye, p1, eye, 0.5 * dt * dt * accel, self._p_noise
        )
        graph.push_back(g.LinearContainerFactor(linear, origin))

    def _key(self, kind: str, node: int, k: int) -> int:
        return int(self._g.symbol(kind, k * self._workload.n + node))
