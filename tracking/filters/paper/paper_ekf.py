"""The algorithm of Armani and Holz (ICRA 2024) as its text has it, for a batch of groups.

`reference.py` is the specification, equation by equation; this is the same, compiled. The filter
takes nodes for their antennas, every range for line of sight, and never doubts its rotation: a pair
is OK as soon as it runs. `docs/paper.md` has what it gives and what each option costs.

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
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate
from tracking.filters.paper._event_kernels import run_events
from tracking.filters.paper.params import PaperParams
from tracking.filters.paper.state import (
    PaperState,
    as_records,
    make_constants,
    make_layout,
    make_state,
)
from tracking.measurements import MeasurementBlock


class PaperEkf:
    """Pair filters and MDS over a batch of groups."""

    follows_bias = False

    def __init__(self, constellation: Constellation, params: PaperParams, n_envs: int = 1) -> None:
        layout = params.first_layout
        if layout is not None and np.shape(layout) != (constellation.n_nodes, 3):
            raise ConfigError(
                f"first_layout: expected 3 coordinates of {constellation.n_nodes} nodes, "
                f"got {np.shape(layout)}"
            )
        self._constellation, self._n_envs = constellation, n_envs
        self._constants = make_constants(constellation, params)
        self._layout = make_layout(constellation, params)
        self._state = make_state(constellation, n_envs)

    def run(self, block: MeasurementBlock, t_out: F64) -> TeamEstimate:
        """Handle the events and report at the given times; see `Filter.run`."""
        t_out = np.ascontiguousarray(t_out, dtype=np.float64)
        estimate = TeamEstimate.empty(self._constellation, t_out)
        run_events(*self._arguments(block.arrays, estimate))
        return estimate

    def bind(self, block: MeasurementBlock, estimate: TeamEstimate) -> Callable[[], None]:
        """`run` for arrays that stay where they are; see `Filter.bind`."""
        return bind(run_events, *self._arguments(block.in_place, estimate))

    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        """What the kernel takes."""
        s = self._state
        nodes, pairs, group = (as_records(a) for a in (s.nodes, s.pairs, s.group))
        return (
            as_records(self._constants),
            self._layout,
            s._replace(nodes=nodes, pairs=pairs, group=group),
            events,
            estimate.t,
            estimate.arrays,
        )

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for array, fresh in zip(self._state, make_state(self._constellation, 1), strict=True):
            array[env] = fresh[0]

    def part(self, envs: slice) -> PaperEkf:
        """Some of the environments; shares their memory."""
        part = copy.copy(self)
        part._state = PaperState._make(array[envs] for array in self._state)
        part._n_envs = len(part._state.x)
        return part

    def save(self) -> PaperState:
        """A copy of everything that evolves."""
        return PaperState._make(array.copy() for array in self._state)

    def restore(self, saved: PaperState) -> None:
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
        """Ranges rejected by the gate, (env)."""
        return np.asarray(self._state.pairs["n_rejected"].sum(axis=1), dtype=np.float64)
