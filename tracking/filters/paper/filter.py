"""The algorithm of Armani and Holz (ICRA 2024) as written in its text, for a batch of groups.

`tests/tracking/paper_reference.py` is the specification, equation by equation; this package is its
compiled form. The filter has no lever arms, assumes line of sight for every range, and does not
monitor its rotation: a pair is OK as soon as it runs. `docs/explanation/paper.md` has its accuracy
and the effect of each option.

References:
    [1] Armani, Holz, Accurately tracking relative positions of moving trackers based on UWB
        ranging and inertial sensing without anchors, ICRA 2024.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.estimate import TeamEstimate
from tracking.filters.batched import BatchedFilter
from tracking.filters.paper.event_loop import run_events
from tracking.filters.paper.params import PaperParams
from tracking.filters.paper.state import make_constants, make_layout, make_state
from tracking.records import as_records, with_records


class PaperEkf(BatchedFilter):
    """Pair filters and MDS over a batch of groups."""

    follows_bias = False
    kernel = run_events

    def __init__(self, constellation: Constellation, params: PaperParams, n_envs: int = 1) -> None:
        layout = params.first_layout
        if layout is not None and np.shape(layout) != (constellation.n_nodes, 3):
            raise ConfigError(
                f"first_layout: expected 3 coordinates of {constellation.n_nodes} nodes, "
                f"got {np.shape(layout)}"
            )
        self._constants = make_constants(constellation, params)
        self._layout = make_layout(constellation, params)
        state, blank = (make_state(constellation, n) for n in (n_envs, 1))
        super().__init__(constellation, state, blank)

    def _arguments(self, events: tuple[Any, ...], estimate: TeamEstimate) -> tuple[Any, ...]:
        state, constants = with_records(self._state), as_records(self._constants)
        return constants, self._layout, state, events, estimate.t, estimate.arrays
