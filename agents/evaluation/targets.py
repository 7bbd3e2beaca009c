"""What is asked of a filter in a case, and whether it is reached.

Where the bound itself lies above what is asked, that cannot be reached: the target is `NEAR`
times the bound there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

NEAR = 1.10
"""[-] So near to the bound is good enough where the bound is the limit."""
BOUNDS = {"rmse_yaw": "bound_yaw", "rmse_shape": "bound_shape"}
"""Figure to the bound on it."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """A figure next to what is asked of it, all in metres."""

    figure: str
    asked: float
    limit: float
    """What counts: what is asked, or `NEAR` times the bound."""
    reached: float | None

    @property
    def by_bound(self) -> bool:
        """Whether the bound lies above what is asked."""
        return self.limit != self.asked

    @property
    def met(self) -> bool:
        """Whether the figure is at most the limit."""
        return self.reached is not None and self.reached <= self.limit

    @property
    def record(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "figure": self.figure,
            "asked": self.asked,
            "limit": self.limit,
            "reached": self.reached,
            "met": self.met,
        }


def outcomes(asked: Mapping[str, float], figures: Mapping[str, Any]) -> list[Outcome]:
    """Every target of one filter in one case.

    Args:
        asked: Figure to the most that it may be [m].
        figures: Medians, the bounds among them; None where there is none.
    """
    found = []
    for figure, most in asked.items():
        bound = figures[BOUNDS[figure]]
        limit = most if bound is None or bound <= most else NEAR * bound
        found.append(Outcome(figure, most, limit, figures[figure]))
    return found
