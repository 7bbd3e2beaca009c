"""One extended Kalman filter over all nodes of a group: the default filter.

Pair filters share nodes and cannot know how their errors go together. Here all nodes are one
state vector (`state`), so that every range informs every node it has to do with, and the
covariance is that of the group:

    predict     dead reckoning with the nodes' accelerations, biases and heading errors
    correct     ranges, in sight or not (`_range_kernels`); what is known about the carriers
    choose      among rotations and mirror images, by the likelihood of all that (`_bank_kernels`)

`docs/tracker.md` derives it and says what each part is worth.
"""

from __future__ import annotations

import numpy as np

from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters.joint._event_kernels import run_events
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.state import (
    JointState,
    as_records,
    make_coefficients,
    make_layout,
    make_state,
)
from tracking.measurements import MeasurementBlock


class JointEkf:
    """One filter per group over a batch of groups; see the module."""

    def __init__(self, constellation: Constellation, params: JointParams, n_envs: int = 1) -> None:
        self._constellation, self._params, self._n_envs = constellation, params, n_envs
        self._coefficients = make_coefficients(constellation, params)
        self._layout = make_layout(constellation, params)
        self._state = self._fresh(n_envs)

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle the events and report at the given times; see `Filter.run`."""
        events = (
            block.t,
            block.kind,
            block.i,
            block.j,
            block.antenna_i,
            block.antenna_j,
            block.values,
            block.has_power,
            block.valid,
        )
        contiguous = tuple(np.ascontiguousarray(a) for a in events)
        t_out = np.ascontiguousarray(t_out, dtype=np.float64)
        estimate = TeamEstimate.empty(self._constellation, t_out)
        out = (
            estimate.pos_ij_w,
            estimate.vel_ij_w,
            estimate.cov,
            estimate.q_wb,
            estimate.has_orientation,
            estimate.age,
            estimate.nis,
            estimate.nlos_prob,
            estimate.status,
        )
        run_events(
            as_records(self._coefficients), self._layout, self._records(), contiguous, t_out, out
        )
        return estimate

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for array, fresh in zip(self._state, self._fresh(1), strict=True):
            array[env] = fresh[0]

    def save(self) -> JointState:
        """A copy of everything that evolves."""
        return JointState._make(array.copy() for array in self._state)

    def restore(self, saved: JointState) -> None:
        """Go on from a saved copy."""
        for array, old in zip(self._state, saved, strict=True):
            array[...] = old

    def mean_nis(self) -> F64:
        """Mean NIS over the ranges taken for line of sight, (env) [-]; NaN before the first."""
        group = self._state.group[:, 0]
        n = group["nis_n"]
        mean: F64 = np.where(n > 0, group["nis_sum"] / np.maximum(n, 1), np.nan)
        return mean

    def n_rejected(self) -> F64:
        """Ranges that hardly counted, taken for no line of sight or for nonsense, (env)."""
        return np.asarray(self._state.pairs["n_rejected"].sum(axis=1), dtype=np.float64)

    def _records(self) -> JointState:
        """The state in the form the kernels take; shares its memory."""
        s = self._state
        nodes, pairs, group = (as_records(a) for a in (s.nodes, s.pairs, s.group))
        return s._replace(nodes=nodes, pairs=pairs, group=group)

    def _fresh(self, n_envs: int) -> JointState:
        n_hyps = len(self._layout.rotations)
        return make_state(self._constellation, self._params, n_envs, n_hyps)
