"""One extended Kalman filter over all nodes of a group: the default filter.

Pair filters share nodes but do not estimate the correlation of their errors. Here all nodes are one
state vector (`state`), so that every range corrects all nodes correlated with it, and the
covariance is that of the group:

    predict     dead reckoning with the nodes' accelerations, biases and heading errors
    correct     ranges, LOS or NLOS (`range_update`); motion constraints of the vehicles
    choose      among rotations and mirror images, by the likelihood of all these (`bank`)

`docs/explanation/tracker.md` derives it, `docs/benchmarks/tracker.md` has the worth of each part.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Self

import numpy as np

from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters.batched import BatchedFilter
from tracking.filters.joint.coefficients import make_coefficients
from tracking.filters.joint.ekf.workspace import Workspace, make_workspace
from tracking.filters.joint.event_loop import predict_all, run_events
from tracking.filters.joint.params import JointParams, JointStartParams
from tracking.filters.joint.rare import compile_all, rare_calls, run_to_end
from tracking.filters.joint.smoothing import read_clones, with_clones
from tracking.filters.joint.state import Layout, make_layout, make_state
from tracking.kernels.jit import Call, bind
from tracking.measurements import MeasurementBlock
from tracking.records import as_records, with_records


class JointEkf(BatchedFilter):
    """Joint filter of a batch of groups; see the module."""

    follows_bias = True
    kernel = run_events

    def __init__(self, constellation: Constellation, params: JointParams, n_envs: int = 1) -> None:
        self._coefficients = make_coefficients(constellation, params)
        self._white_var = params.range_error.white_std**2
        self._layout = make_layout(constellation, params)
        n_hyps = bank_size(constellation, self._layout, params.start)
        state = make_state(constellation, params, n_envs, n_hyps)
        # Initial state of one hypothesis: all begin with the same.
        super().__init__(constellation, state, make_state(constellation, params, 1, 1))
        self._work = self._make_workspace(state.x.shape[2])

    def _complete(self, handle: Callable[[], Any], arguments: tuple[Any, ...]) -> None:
        run_to_end(handle, arguments)

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """Return `run` for arrays that stay in place; see `Filter.bind`."""
        arguments = self._arguments(block.in_place, estimate)
        compile_all(arguments)
        return partial(run_to_end, bind(run_events, *arguments), arguments)

    def calls(self, block: MeasurementBlock, estimate: TeamEstimate) -> list[list[Call]]:
        """Return the kernels that it needs; see `Filter.calls`."""
        arguments = self._arguments(block.in_place, estimate)
        with_ranges, *others = rare_calls(arguments)
        return [[(run_events, arguments), *with_ranges], *others]

    def smooth(self, later: MeasurementBlock, t: F64) -> TeamEstimate:
        """Return estimates at one time that use later measurements; the filter does not change.

        Args:
            later: Events after t, in order. STATE, not IMU.
            t: Time of the estimate, not before the last event handled, (env) [s].

        Returns:
            Estimates, arrays over (env, ...).
        """
        saved, n_envs = self.save(), len(t)
        try:
            now = self.run(MeasurementBlock.empty(n_envs), t[:, None])
            names = TeamEstimate.__slots__[1:]
            estimate = TeamEstimate(
                now.constellation, *(getattr(now, name)[:, 0] for name in names)
            )
            coefficients = as_records(self._coefficients)
            predict_all(coefficients, with_records(self._state), self._work, t)
            clones, coefficients = with_clones(self._state, self._coefficients)
        finally:
            self.restore(saved)
        nothing = TeamEstimate.empty(self._constellation, np.zeros((n_envs, 0)))
        arguments = (
            as_records(coefficients),
            self._layout,
            with_records(clones),
            self._make_workspace(int(coefficients[0]["n"])),
            later.arrays,
            nothing.t,
            nothing.arrays,
        )
        run_to_end(partial(run_events, *arguments), arguments)
        return read_clones(clones, estimate, self._state.x.shape[2])

    def range_noise(self) -> F64:
        """Return the standard deviation of white range noise, given or learned, (env) [m]."""
        # Larger groups count lasting errors as white noise.
        lasting = self._coefficients["white_var"][0] - self._white_var
        std: F64 = np.sqrt(np.maximum(self._state.group["white_var"][:, 0] - lasting, 0.0))
        return std

    def fit_sums(self) -> F64:
        """Return sums over the ranges so far, (env, 4).

        Sum of the log-likelihoods of all ranges, without a constant, and their number; sum of the
        NIS of those accepted, and their number.
        """
        group = self._state.group[:, 0]
        names = "loglik_sum", "loglik_n", "nis_sum", "nis_n"
        return np.stack([group[name].astype(np.float64) for name in names], axis=-1)

    def part(self, envs: slice) -> Self:
        """Return the filter of some environments; shares their memory."""
        part = super().part(envs)
        part._work = self._make_workspace(self._state.x.shape[2])
        return part

    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        state, coefficients = with_records(self._state), as_records(self._coefficients)
        times, arrays = estimate.t, estimate.arrays
        return coefficients, self._layout, state, self._work, events, times, arrays

    def _make_workspace(self, n_states: int) -> Workspace:
        constellation = self._constellation
        return make_workspace(constellation.n_nodes, constellation.n_pairs, n_states)


def bank_size(constellation: Constellation, layout: Layout, start: JointStartParams) -> int:
    """Return the number of places of the bank.

    All rotations, and second sides of nodes that join. If one filter represents all rotations
    (`Alignment.LINEAR`), its likeliest modes.
    """
    n_rotations = len(layout.rotations)
    if constellation.dimensions == 2:
        return n_rotations + start.spare_hypotheses
    return start.modes_3d if constellation.n_nodes > 3 else 2 * n_rotations
