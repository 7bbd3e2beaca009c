"""One extended Kalman filter per pair, with or without MDS: the pipeline of the paper.

The state of a pair is its relative position and velocity in the world frame,
``x = (p_j - p_i, v_j - v_i)``. The relative orientation of the paper's state,
``q_ij = q_i^-1 q_j``, is a function of the inputs alone and is reported from them; its
covariance is the constant sum of both orientation noises ([1] eq. 8-9, `docs/tracker.md`).

    predict     pos += dt vel + dt^2/2 (a_j - a_i),  vel += dt (a_j - a_i)
    correct     z = (range, its low-passed derivative),  h = (|pos|, u . vel)
    refine      pos <- MDS of all |pos|, aligned to pos         (`ekf-mds` only)

References:
    [1] Armani, Holz, Accurately tracking relative positions of moving trackers based on UWB
        ranging and inertial sensing without anchors, ICRA 2024.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64, I64, Bool
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters._event_kernels import run_events
from tracking.filters.params import PairEkfParams
from tracking.filters.state import (
    FilterState,
    as_records,
    make_coefficients,
    make_layout,
    make_state,
)
from tracking.measurements import MeasurementBlock


class PairEkf:
    """Pair filters over a batch of groups; see the module for the equations."""

    def __init__(
        self,
        constellation: Constellation,
        params: PairEkfParams,
        n_envs: int = 1,
        *,
        use_mds: bool = True,
    ) -> None:
        self._constellation, self._params, self._n_envs = constellation, params, n_envs
        self._coefficients = make_coefficients(constellation, params, use_mds=use_mds)
        self._layout = make_layout(constellation, params)
        self._state = self._fresh(n_envs)

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle the events and report at the given times; see `Filter.run`."""
        out = self._make_outputs(t_out.shape[1])
        events = (
            block.t,
            block.kind,
            block.i,
            block.j,
            block.antenna_i,
            block.antenna_j,
            block.values,
            block.valid,
        )
        contiguous = tuple(np.ascontiguousarray(a) for a in events)
        t_out = np.ascontiguousarray(t_out, dtype=np.float64)
        run_events(
            as_records(self._coefficients), self._layout, self._records(), contiguous, t_out, out
        )
        pos, vel, cov, q_wb, has_q, age, nis, status = out
        return TeamEstimate(
            constellation=self._constellation,
            t=t_out,
            pos_ij_w=pos,
            vel_ij_w=vel,
            cov=cov,
            q_wb=q_wb,
            has_orientation=has_q,
            age=age,
            nis=nis,
            nlos_prob=np.zeros_like(age),
            status=status,
        )

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for array, fresh in zip(self._state, self._fresh(1), strict=True):
            array[env] = fresh[0]

    def save(self) -> FilterState:
        """A copy of everything that evolves."""
        return FilterState._make(array.copy() for array in self._state)

    def restore(self, saved: FilterState) -> None:
        """Go on from a saved copy."""
        for array, old in zip(self._state, saved, strict=True):
            array[...] = old

    def mean_nis(self) -> F64:
        """Mean NIS over all accepted ranges, (env) [-]; NaN before the first."""
        group = self._state.group[:, 0]
        n = group["nis_n"]
        mean: F64 = np.where(n > 0, group["nis_sum"] / np.maximum(n, 1), np.nan)
        return mean

    def n_rejected(self) -> F64:
        """Ranges refused as outliers, (env)."""
        return np.asarray(self._state.pairs["n_rejected"].sum(axis=1), dtype=np.float64)

    def _records(self) -> FilterState:
        """The state in the form the kernels take; shares its memory."""
        s = self._state
        nodes, pairs, group = (as_records(a) for a in (s.nodes, s.pairs, s.group))
        return s._replace(nodes=nodes, pairs=pairs, group=group)

    def _fresh(self, n_envs: int) -> FilterState:
        n_hyps = len(self._layout.rotations)
        return make_state(self._constellation, self._params, n_envs, n_hyps)

    def _make_outputs(self, n_times: int) -> tuple[F64, F64, F64, F64, Bool, F64, F64, I64]:
        """Arrays that the kernel fills: pos, vel, cov, q, has_q, age, nis, status."""
        lead = (self._n_envs, n_times)
        n, p = self._constellation.n_nodes, self._constellation.n_pairs
        return (
            np.zeros((*lead, p, 3)),
            np.zeros((*lead, p, 3)),
            np.zeros((*lead, p, 6, 6)),
            np.zeros((*lead, n, 4)),
            np.zeros((*lead, n), dtype=bool),
            np.zeros((*lead, p)),
            np.zeros((*lead, p)),
            np.zeros((*lead, p), dtype=np.int64),
        )
