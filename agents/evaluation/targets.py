"""Accuracy targets of a filter in a case.

If the bound exceeds a target, the target cannot be reached and is replaced by `NEAR` times the
bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

NEAR = 1.10
"""[-] Factor on the bound where the bound is the limit."""
BOUNDS = {"rmse_yaw": "bound_yaw", "rmse_shape": "bound_shape"}
"""Metric to its bound."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """A metric and its target, all in metres."""

    figure: str
    asked: float
    limit: float
    """Effective target: `asked`, or `NEAR` times the bound."""
    reached: float | None

    @property
    def by_bound(self) -> bool:
        """True if the bound exceeds the target."""
        return self.limit != self.asked

    @property
    def met(self) -> bool:
        """True if the metric is at most the limit."""
        return self.reached is not None and self.reached <= self.limit

    @property
    def record(self) -> dict[str, Any]:
        """Record for JSON."""
        return {
            "figure": self.figure,
            "asked": self.asked,
            "limit": self.limit,
            "reached": self.reached,
            "met": self.met,
        }


def outcomes(asked: Mapping[str, float], figures: Mapping[str, Any]) -> list[Outcome]:
    """Return the outcomes of all targets of one filter in one case.

    Args:
        asked: Metric to its target [m].
        figures: Medians of metrics and bounds, None where undefined [m].
    """
    found = []
    for figure, most in asked.items():
        bound = figures[BOUNDS[figure]]
        limit = most if bound is None or bound <= most else NEAR * bound
        found.append(Outcome(figure, most, limit, figures[figure]))
    return found
