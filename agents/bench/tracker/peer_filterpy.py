"""Peer filterpy with the same updates: an EKF per pair, or one EKF of the whole group.

Its matrix products run on one core, as ours do; on two cores, small products are slower.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.bench.tracker.workload import Workload
from agents.errors import UsageError
from tracking.arrays import F64
from tracking.filters.joint.coefficients import count_states
from tracking.filters.joint.params import JointParams

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter

REPEATS = 5
"""[-] Number of timed runs, of which the fastest counts."""


def filterpy_name() -> str:
    """Return the name of the peer with its version.

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
    return f"filterpy {filterpy.__version__}"


def group_cost(workload: Workload, steps: int) -> float:
    """Return the time of a step [us] of an EKF with the number of states of the joint filter.

    A step is one prediction and one scalar update per range. States of biases, headings and range
    errors have no models; they only give the matrices the same size.
    """
    d, dt, n = workload.dimensions, workload.dt, workload.n
    size = count_states(workload.constellation, JointParams())
    F = np.eye(size)  # noqa: N806
    for k in range(n):
        at = _position(k, d)
        F[at : at + d, at + d : at + 2 * d] = dt * np.eye(d)
    ekf = _ekf(size, F, 1e-4 * np.eye(size))
    t = np.zeros(1)
    for k in range(n):
        ekf.x[_position(k, d) : _position(k, d) + d, 0] = workload.pos(t)[0, k, :d]
    distance = workload.distances(workload.times(0, steps), 0)
    models = {(i, j): _between(_position(i, d), _position(j, d), d, size)
              for i, j in workload.constellation.pairs.tolist()}  # fmt: skip

    def step(k: int) -> None:
        ekf.predict()
        pairs = workload.pairs[k % len(workload.pairs)].tolist()
        for (i, j), z in zip(pairs, distance[k], strict=True):
            ekf.update(np.array([[z]]), *models[i, j])

    return _fastest(step, steps)


def pairs_cost(workload: Workload, steps: int) -> float:
    """Return the time of a round [us] with one EKF of position and velocity per pair."""
    d, dt = workload.dimensions, workload.dt
    eye = np.eye(d)
    F = np.block([[eye, dt * eye], [0.0 * eye, eye]])  # noqa: N806
    B = np.vstack([0.5 * dt * dt * eye, dt * eye])  # noqa: N806
    filters = []
    for i, j in workload.constellation.pairs:
        ekf = _ekf(2 * d, F, 1e-3 * B @ B.T / dt)
        ekf.B = B
        pos = workload.pos(np.zeros(1))[0]
        ekf.x[:d, 0] = (pos[j] - pos[i])[:d]
        filters.append(ekf)
    accel, z = np.full((d, 1), 0.1), np.array([[2.3]])

    def jacobian(x: F64) -> F64:
        row = np.zeros((1, 2 * d))
        row[0, :d] = x[:d, 0] / np.linalg.norm(x[:d, 0])
        return row

    def distance(x: F64) -> F64:
        return np.array([[np.linalg.norm(x[:d, 0])]])

    def step(_: int) -> None:
        for ekf in filters:
            ekf.predict(accel)
            ekf.update(z, jacobian, distance)

    return _fastest(step, steps)


def _position(node: int, d: int) -> int:
    """Return the index of the first position state of a node."""
    return node * (3 * d + 1)


def _ekf(size: int, F: F64, Q: F64) -> ExtendedKalmanFilter:  # noqa: N803
    from filterpy.kalman import ExtendedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=size, dim_z=1)
    ekf.x = np.zeros((size, 1))
    ekf.F, ekf.Q, ekf.R = F, Q, np.array([[0.0025]])
    return ekf


def _between(i: int, j: int, d: int, size: int) -> tuple[Callable[[F64], F64], Any]:
    """Return Jacobian and model of the distance between the positions at states i and j."""

    def jacobian(x: F64) -> F64:
        row = np.zeros((1, size))
        r = x[j : j + d, 0] - x[i : i + d, 0]
        u = r / np.linalg.norm(r)
        row[0, i : i + d], row[0, j : j + d] = -u, u
        return row

    def distance(x: F64) -> F64:
        return np.array([[np.linalg.norm(x[j : j + d, 0] - x[i : i + d, 0])]])

    return jacobian, distance


def _fastest(step: Callable[[int], None], steps: int) -> float:
    from threadpoolctl import threadpool_limits

    best = np.inf
    with threadpool_limits(1):
        for _ in range(REPEATS):
            began = time.perf_counter()
            for k in range(steps):
                step(k)
            best = min(best, time.perf_counter() - began)
    return 1e6 * float(best) / steps
