"""One extended Kalman filter per pair, with or without MDS: the pipeline of the paper.

The state of a pair is its relative position and velocity in the world frame, ``x = (p_j - p_i,
v_j - v_i)``. The relative orientation of the paper's state, ``q_ij = q_i^-1 q_j``, is a function
of the inputs alone and is reported from them; its covariance is the constant sum of both
orientation noises ([1] eq. 8-9, `docs/explanation/tracker.md`).

    predict     pos += dt vel + dt^2/2 (a_j - a_i),  vel += dt (a_j - a_i)
    correct     z = range,  h = |pos| + slow range error
    refine      pos <- MDS of all |pos|, aligned to pos         (`ekf-mds` only)

References:
    [1] Armani, Holz, Accurately tracking relative positions of moving trackers based on UWB
        ranging and inertial sensing without anchors, ICRA 2024.
"""

from __future__ import annotations

from typing import Any

from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.filters.batched import BatchedFilter
from tracking.filters.pair.event_loop import run_events
from tracking.filters.pair.params import PairEkfParams
from tracking.filters.pair.state import make_coefficients, make_layout, make_state
from tracking.records import as_records, with_records


class PairEkf(BatchedFilter):
    """Pair filters over a batch of groups; see the module for the equations."""

    follows_bias = False
    kernel = run_events

    def __init__(
        self,
        constellation: Constellation,
        params: PairEkfParams,
        n_envs: int = 1,
        *,
        use_mds: bool = True,
    ) -> None:
        self._coefficients = make_coefficients(constellation, params, use_mds=use_mds)
        self._layout = make_layout(constellation, params)
        # Room for both sides of a joining node in every rotation.
        room = 2 * len(self._layout.rotations)
        state, blank = (make_state(constellation, params, n, room) for n in (n_envs, 1))
        super().__init__(constellation, state, blank)

    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        state = with_records(self._state)
        coefficients = as_records(self._coefficients)
        return coefficients, self._layout, state, events, estimate.t, estimate.arrays
