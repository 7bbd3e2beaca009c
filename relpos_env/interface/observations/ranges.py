"""Observation mode of raw ranges, for policies without a tracker."""

from __future__ import annotations

from collections.abc import Callable

from relpos_env.interface._observation_kernels import FAR, LOUD, OLD, observe_ranges
from relpos_env.interface.observations.base import F32, Field
from relpos_env.interface.observations.standard_fields import own_fields, target_fields
from relpos_env.interface.views import AgentView
from tracking.kernels.jit import bind


class Ranges:
    """Last range of every pair; zeros where it is older than ten seconds."""

    needs_truth = False

    def __init__(self, n_cars: int, n_rangefinders: int = 0) -> None:
        n = n_cars - 1
        self.fields = (
            Field(
                "mask",
                n,
                "-",
                "1 where there was a range of late",
                1.0,
                signed=False,
                per_other=True,
            ),
            Field("range", n, "m", "last range to that car, as it came", FAR, per_other=True),
            Field("age", n, "s", "since then", OLD, signed=False, per_other=True),
            Field(
                "gap", n, "dB", "received less first-path power of that range", LOUD, per_other=True
            ),
            *target_fields(n),
            *own_fields(n_rangefinders),
        )

    def bind(self, view: AgentView, out: F32) -> Callable[[], None]:
        """Return a function that writes the observations of every car, (env, car, size)."""
        return bind(observe_ranges, view, out)
