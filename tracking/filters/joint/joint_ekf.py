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

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from tracking.arrays import F64
from tracking.compiled import bind
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters.joint._event_kernels import advance_all, run_events
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.params import JointParams
from tracking.filters.joint.records import Records, as_records
from tracking.filters.joint.scratch import Scratch, make_scratch
from tracking.filters.joint.smoothing import read_clones, with_clones
from tracking.filters.joint.state import JointState, make_layout, make_state
from tracking.measurements import MeasurementBlock


class JointEkf:
    """One filter per group over a batch of groups; see the module."""

    follows_bias = True

    def __init__(self, constellation: Constellation, params: JointParams, n_envs: int = 1) -> None:
        self._constellation, self._params, self._n_envs = constellation, params, n_envs
        self._coefficients = make_coefficients(constellation, params)
        self._layout = make_layout(constellation, params)
        self._state = self._fresh(n_envs)
        # Of one hypothesis: all begin alike.
        self._blank = make_state(constellation, params, 1, 1)
        self._scratch = make_scratch(
            constellation.n_nodes, constellation.n_pairs, int(self._coefficients[0]["n"])
        )

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle the events and report at the given times; see `Filter.run`."""
        estimate = TeamEstimate.empty(
            self._constellation, np.ascontiguousarray(t_out, dtype=np.float64)
        )
        self._pass(self._state, self._coefficients, self._scratch, block, estimate)
        return estimate

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """`run` for arrays that stay where they are; see `Filter.bind`."""
        arguments = self._arguments(
            self._state, self._coefficients, self._scratch, block.in_place, estimate
        )
        return bind(run_events, *arguments)

    def smooth(self, later: MeasurementBlock, t: F64) -> TeamEstimate:
        """Report at one time with the help of later measurements, and stay where it is.

        Args:
            later: Events after t, in order. STATE, not IMU.
            t: Time of the estimate, not before the last event handled, (env) [s].

        Returns:
            Estimates, arrays over (env, ...).
        """
        saved = self.save()
        try:
            now = self.run(MeasurementBlock.empty(self._n_envs), t[:, None])
            names = TeamEstimate.__slots__[1:]
            estimate = TeamEstimate(
                now.constellation, *(getattr(now, name)[:, 0] for name in names)
            )
            coefficients = as_records(self._coefficients)
            advance_all(coefficients, self._layout, _records(self._state), self._scratch, t)
            clones, coefficients = with_clones(self._state, self._coefficients)
        finally:
            self.restore(saved)
        scratch = make_scratch(
            self._constellation.n_nodes, self._constellation.n_pairs, int(coefficients[0]["n"])
        )
        nothing = TeamEstimate.empty(self._constellation, np.zeros((self._n_envs, 0)))
        self._pass(clones, coefficients, scratch, later, nothing)
        return read_clones(clones, estimate, self._state.x.shape[2])

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for array, blank in zip(self._state, self._blank, strict=True):
            array[env] = blank[0]

    def part(self, envs: slice) -> JointEkf:
        """Some of the environments; shares their memory."""
        part = copy.copy(self)
        part._state = JointState._make(array[envs] for array in self._state)
        part._n_envs = len(part._state.x)
        part._scratch = make_scratch(
            self._constellation.n_nodes, self._constellation.n_pairs, self._state.x.shape[2]
        )
        return part

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

    def _pass(
        self,
        state: JointState,
        coefficients: Records,
        scratch: Scratch,
        block: MeasurementBlock,
        estimate: TeamEstimate,
    ) -> None:
        """Handle events and fill the estimate for its times."""
        run_events(*self._arguments(state, coefficients, scratch, block.arrays, estimate))

    def _arguments(
        self,
        state: JointState,
        coefficients: Records,
        scratch: Scratch,
        events: tuple[Any, ...],
        estimate: TeamEstimate,
    ) -> tuple[Any, ...]:
        """What the kernel takes."""
        return (
            as_records(coefficients),
            self._layout,
            _records(state),
            scratch,
            events,
            estimate.t,
            estimate.arrays,
        )

    def _fresh(self, n_envs: int) -> JointState:
        """The state before any measurement.

        With room for the mirror images of nodes that join while all rotations are still possible.
        Where one filter stands for all rotations (`Alignment.LINEAR`), for their likeliest modes:
        of 60 simulated groups eight had more than six.
        """
        n_rotations, space = len(self._layout.rotations), self._constellation.dimensions == 3
        n_hyps = 2 * n_rotations if space else n_rotations + 8
        if space and self._constellation.n_nodes > 3:
            n_hyps = 9
        return make_state(self._constellation, self._params, n_envs, n_hyps)


def _records(s: JointState) -> JointState:
    """The state in the form the kernels take; shares its memory."""
    nodes, pairs, group = (as_records(a) for a in (s.nodes, s.pairs, s.group))
    return s._replace(nodes=nodes, pairs=pairs, group=group)
