"""Observation modes of relative positions, relative targets and the car's own motion."""

from __future__ import annotations

from collections.abc import Callable

from relpos_env.interface._observation_kernels import FAR, FAST, N_STATUS, OLD, observe_relative
from relpos_env.interface.observations.base import F32, Field
from relpos_env.interface.observations.standard_fields import own_fields, target_fields
from relpos_env.interface.views import AgentView
from tracking.kernels.jit import bind


class RelativePositions:
    """Relative positions and velocities; zeros where the mask is 0."""

    def __init__(
        self, n_cars: int, n_rangefinders: int = 0, *, needs_truth: bool, with_cov: bool
    ) -> None:
        self.needs_truth, self._with_cov = needs_truth, with_cov
        n = n_cars - 1
        certainty = (
            Field(
                "std",
                3 * n,
                "m, m, -",
                "of that position: standard deviations ahead and to the left, their correlation",
                FAR,
                per_other=True,
            ),
            Field(
                "age", n, "s", "since the last range of the pair", OLD, signed=False, per_other=True
            ),
            Field(
                "nlos",
                n,
                "-",
                "probability that it was not line of sight",
                1.0,
                signed=False,
                per_other=True,
            ),
            Field(
                "status",
                N_STATUS * n,
                "-",
                "one 1 among: absent, starting, ambiguous, ok, lost, doubtful",
                1.0,
                signed=False,
                per_other=True,
            ),
        )
        self.fields = (
            Field(
                "mask",
                n,
                "-",
                "1 where that car's position can be used",
                1.0,
                signed=False,
                per_other=True,
            ),
            Field(
                "pos", 2 * n, "m", "position of each other car: forward, left", FAR, per_other=True
            ),
            Field("vel", 2 * n, "m/s", "its velocity relative to this car", FAST, per_other=True),
            *(certainty if with_cov else ()),
            *target_fields(n),
            *own_fields(n_rangefinders),
        )

    def bind(self, view: AgentView, out: F32) -> Callable[[], None]:
        """Return a function that writes the observations of every car, (env, car, size)."""
        return bind(observe_relative, view, self._with_cov, out)
