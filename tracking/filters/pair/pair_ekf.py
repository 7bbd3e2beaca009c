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

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from tracking.arrays import F64
from tracking.compiled import bind
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters.pair._event_kernels import run_events
from tracking.filters.pair.params import PairEkfParams
from tracking.filters.pair.state import (
    FilterState,
    as_records,
    make_coefficients,
    make_layout,
    make_state,
)
from tracking.measurements import MeasurementBlock


class PairEkf:
    """Pair filters over a batch of groups; see the module for the equations."""

    follows_bias = False

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
        estimate = TeamEstimate.empty(
            self._constellation, np.ascontiguousarray(t_out, dtype=np.float64)
        )
        run_events(*self._arguments(block.arrays, estimate))
        return estimate

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """`run` for arrays that stay where they are; see `Filter.bind`."""
        return bind(run_events, *self._arguments(block.in_place, estimate))

    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        """What the kernel takes."""
        return (
            as_records(self._coefficients),
            self._layout,
            self._records(),
            events,
            estimate.t,
            estimate.arrays,
        )

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for array, fresh in zip(self._state, self._fresh(1), strict=True):
            array[env] = fresh[0]

    def part(self, envs: slice) -> PairEkf:
        """Some of the environments; shares their memory."""
        part = copy.copy(self)
        part._state = FilterState._make(array[envs] for array in self._state)
        part._n_envs = len(part._state.x)
        return part

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
