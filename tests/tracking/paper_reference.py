"""Armani and Holz (ICRA 2024) in plain numpy: the specification of `paper-ekf-mds`.

One EKF per pair of nodes i < j; state ``(x_ij, v_ij, q_ij)``, 3 + 3 + 4 numbers, world frame,
metres and seconds; MDS over the group. Equation numbers are those of arXiv 2409.12505. Options of
`PaperParams` cover gaps in the text. `PaperEkf` is the same algorithm, compiled and batched over
groups; the tests compare both.

References:
    [1] Armani, Holz, Accurately tracking relative positions of moving trackers based on UWB
        ranging and inertial sensing without anchors, ICRA 2024.
    [2] Schoenemann, A generalized solution of the orthogonal Procrustes problem, Psychometrika 31
        (1966) 1.
"""

from __future__ import annotations

from copy import copy
from itertools import combinations

import numpy as np

from tests.tracking.paper_reference_ekf import PairFilter
from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.filters.paper.params import PaperParams
from tracking.geometry import (
    best_rotation,
    quat_conjugate,
    quat_mean,
    quat_multiply,
)
from tracking.measurements import Kind, MeasurementBlock

ORIENTATION_STD = 0.02
"""[-] Noise n_q of a quaternion component; positions and velocities do not depend on it."""


class PaperReference:
    """Filters of one group."""

    def __init__(self, constellation: Constellation, params: PaperParams) -> None:
        self.group, self.c, self.d = constellation, params, constellation.dimensions
        n = constellation.n_nodes
        self.u = [np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0]]) for _ in range(n)]
        self.t_imu, self.t_last_range = np.full(n, -np.inf), np.full(n, -np.inf)
        self.present: list[int] = []
        self.filters: dict[tuple[int, int], PairFilter] = {}
        self.first: dict[tuple[int, int], tuple[list[float], list[F64]]] = {}
        self.surveyed: dict[tuple[int, int], float] = {}
        self.n_since_mds = 0

    def run(self, block: MeasurementBlock, t_out: F64) -> tuple[F64, F64]:
        """Return states (time, pair, 10) and covariances (time, pair, 10, 10) at given times.

        Args:
            block: Events of one environment in order, with STATE in place of IMU.
            t_out: Ascending times [s].
        """
        p = self.group.n_pairs
        x, P = np.zeros((len(t_out), p, 10)), np.zeros((len(t_out), p, 10, 10))
        due, k = np.searchsorted(block.t[0], t_out, side="right"), 0
        for o, t in enumerate(t_out):
            for event in range(k, due[o]):
                self.take(block, event)
            k = due[o]
            for pair, f in self.filters.items():
                ahead, (u, sigma) = copy(f), self.control(pair, t)
                ahead.x = f.x.copy()
                ahead.predict(t, u, np.diag(sigma**2), self.d)
                x[o, self.group.pair_index[pair]] = ahead.x
                P[o, self.group.pair_index[pair]] = ahead.P
        return x, P

    def take(self, block: MeasurementBlock, k: int) -> None:
        """Handle one event."""
        i, j = sorted((int(block.i[0, k]), int(block.j[0, k])))
        t, kind = float(block.t[0, k]), block.kind[0, k]
        if kind == Kind.STATE:
            self.take_state(i, t, block.values[0, k])
        elif kind in (Kind.RANGE, Kind.SURVEY):
            self.take_range(i, j, t, block.values[0, k, 0], kind == Kind.SURVEY)
        elif kind == Kind.LEAVE:
            self.remove(i)

    def take_state(self, i: int, t: float, values: F64) -> None:
        """Process a node's orientation and world acceleration, eq. (1) and (2)."""
        for pair in self.filters:
            if i in pair:
                self.predict(pair, t)  # a control holds until the next one
        accel = np.where(np.arange(3) < self.d, values[4:7], 0.0)
        self.u[i], self.t_imu[i] = np.concatenate([accel, values[:4]]), t

    def take_range(self, i: int, j: int, t: float, distance: float, is_survey: bool) -> None:
        """Correct the pair's filter, or collect its first k measurements."""
        for node in np.nonzero(t - self.t_last_range > self.c.node_timeout)[0]:
            self.remove(int(node))
        self.t_last_range[i] = self.t_last_range[j] = t
        if is_survey:
            self.surveyed[i, j] = distance
        if (i, j) not in self.filters:
            distances, orientations = self.first.setdefault((i, j), ([], []))
            if len(distances) < self.c.k and not is_survey:
                distances.append(distance)
                orientations.append(quat_multiply(quat_conjugate(self.u[i][3:]), self.u[j][3:]))
            self.initialise(t)
            return
        self.predict((i, j), t)
        if self.filters[i, j].correct(t, distance, self.c) is not None:
            self.n_since_mds += 1
        if self.n_since_mds >= len(self.filters) and len(self.present) > 2:
            self.refine(t)

    def initialise(self, t: float) -> None:
        """Spawn the filters of new nodes from MDS on the first k measurements."""
        while True:
            n = self.group.n_nodes
            absent = [m for m in range(n) if m not in self.present]
            size = 1 if self.present else min(3, n)
            ready = [new for new in combinations(absent, size) if self.has_first(new)]
            if not ready:
                return
            members = sorted([*self.present, *ready[0]])
            D = np.zeros((len(members), len(members)))
            for (a, i), (b, j) in combinations(enumerate(members), 2):
                known = self.filters.get((i, j))
                if known is not None:
                    self.predict((i, j), t)
                D[a, b] = D[b, a] = (
                    self.first_distance((i, j)) if known is None else np.linalg.norm(known.x[:3])
                )
            X, target = self.mds(D), self.positions(members)
            if self.present:
                known_rows = [m in self.present for m in members]
                X = _align(X, target, known_rows, self.d)
            elif self.c.first_layout is not None:
                layout = np.array(self.c.first_layout)[members]
                X = _align(X, layout, [True] * len(members), self.d)
            self.present = members
            for (a, i), (b, j) in combinations(enumerate(members), 2):
                if (i, j) not in self.filters:
                    distance, static = self.first_distance((i, j)), self.group.is_static[[i, j]]
                    _, q = self.first.pop((i, j), ([], []))
                    x_0, q_0 = X[b] - X[a], quat_mean(q)
                    self.filters[i, j] = PairFilter(
                        self.d, x_0, q_0, t, distance, bool(static.all())
                    )

    def has_first(self, new: tuple[int, ...]) -> bool:
        """True if all pairs of new nodes, and of new and present ones, have k measurements."""
        pairs = [p for p in combinations(sorted([*self.present, *new]), 2) if p not in self.filters]
        n = [len(self.first.get(p, ([], []))[0]) for p in pairs]
        return all(p in self.surveyed or m >= self.c.k for p, m in zip(pairs, n, strict=True))

    def first_distance(self, pair: tuple[int, int]) -> float:
        """Surveyed distance of a pair, or the mean of its first k ranges [m]."""
        return self.surveyed.get(pair, float(np.mean(self.first.get(pair, ([0.0], []))[0])))

    def refine(self, t: float) -> None:
        """Refine positions by MDS over the group; the filters use them in the next iteration."""
        self.n_since_mds = 0
        if self.c.feedback == "none":
            return
        D = np.zeros((len(self.present), len(self.present)))
        for (a, i), (b, j) in combinations(enumerate(self.present), 2):
            self.predict((i, j), t)
            D[a, b] = D[b, a] = np.linalg.norm(self.filters[i, j].x[:3])
        X = self.mds(D)
        if self.c.alignment == "procrustes":
            X = _align(X, self.positions(self.present), [True] * len(X), self.d)
        for (a, i), (b, j) in combinations(enumerate(self.present), 2):
            self.filters[i, j].use_mds(X[b] - X[a], self.c, self.d)

    def mds(self, D: F64) -> F64:
        """Return positions (node, 3) from distances D: K, its eigenvectors, ``E Lambda^(1/2)``."""
        J = np.eye(len(D)) - 1.0 / len(D)
        eigenvalues, E = np.linalg.eigh(-0.5 * J @ D**2 @ J)
        X = np.zeros((len(D), 3))
        power = 0.5 if self.c.scaling == "root" else 0.25
        for axis in range(min(self.d, len(D))):
            largest = max(eigenvalues[-1 - axis], 0.0)
            # LAPACK's signs depend on machine and numbering; here the longer tail is positive.
            sign = -1.0 if np.sum(E[:, -1 - axis] ** 3) < 0.0 else 1.0
            X[:, axis] = sign * E[:, -1 - axis] * largest**power
        return X

    def positions(self, members: list[int]) -> F64:
        """Return positions of nodes about their centre from the filters' x_ij, (member, 3)."""
        pos = np.zeros((len(members), 3))
        for (a, i), (b, j) in combinations(enumerate(members), 2):
            if (i, j) in self.filters:
                pos[b] += self.filters[i, j].x[:3]
                pos[a] -= self.filters[i, j].x[:3]
        return pos / max(sum(m in self.present for m in members), 1)

    def predict(self, pair: tuple[int, int], t: float) -> None:
        """Predict a pair's filter with the controls of its nodes."""
        u, sigma = self.control(pair, t)
        self.filters[pair].predict(t, u, np.diag(sigma**2), self.d)

    def control(self, pair: tuple[int, int], t: float) -> tuple[F64, F64]:
        """Return ``u``, eq. (6), and the standard deviations of its noise, both (14)."""
        u, sigma = np.zeros(14), np.zeros(14)
        for side, node in enumerate(pair):
            moves = not self.group.is_static[node]
            if t - self.t_imu[node] <= self.c.imu_timeout:
                u[3 * side : 3 * side + 3] = self.u[node][:3]
            u[6 + 4 * side : 10 + 4 * side] = self.u[node][3:]
            sigma[3 * side : 3 * side + 3] = self.c.accel_std * moves
            sigma[6 + 4 * side : 10 + 4 * side] = ORIENTATION_STD * moves
        return u, sigma

    def remove(self, node: int) -> None:
        """Remove the filters of a node that left."""
        self.present = [m for m in self.present if m != node]
        left = [pair for pair in self.filters if node in pair]
        for pair in left:
            del self.filters[pair]
        for pair in [p for p in self.first if node in p]:
            del self.first[pair]
        if len(self.present) < 2:
            self.present, self.filters = [], {}


def _align(X: F64, target: F64, rows: list[bool], d: int) -> F64:
    """Rotate, reflect and shift X so that the given rows are nearest to the target's [2]."""
    x_mean, mean = X[rows].mean(axis=0), target[rows].mean(axis=0)
    M = best_rotation(X[rows] - x_mean, target[rows] - mean, planar=d == 2, reflect=True)
    return np.asarray((X - x_mean) @ M.T + mean)
