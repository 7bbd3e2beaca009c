"""Result of a comparison: metrics by driver, observation mode and scenario, and ratios."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from agents.comparison.contender import Contender
from agents.comparison.meter import EpisodeResult
from agents.comparison.setting import Setting
from agents.comparison.statistics import Interval, mean, ratio
from tracking.arrays import F64
from tracking.params.short_repr import short_repr

FIGURES = (
    "formation_error", "place_error", "tracking_error", "disagreement", "collisions_per_min",
    "contact_time", "time_in_formation", "energy",
)  # fmt: skip
"""Metrics of every episode, see `agents.comparison.meter.EpisodeResult`."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One driver on one observation mode in one scenario, over all seeds."""

    __repr__ = short_repr

    contender: Contender
    trained_on: str | None
    """Observation mode that it was trained on, None if it was not trained."""
    setting: Setting
    scenario: str
    """Name of the scenario."""
    group: str
    """Name of the rows that are compared with each other: the scenario, or with several tasks
    the task and the scenario."""
    cars: int
    """[-] Slots for cars."""
    episodes: tuple[EpisodeResult, ...]
    """Metrics of the episodes, by seed."""

    def values(self, figure: str) -> F64:
        """Return a metric of every episode, (episode,); NaN where undefined.

        Args:
            figure: A field of `EpisodeResult`.
        """
        return np.array([getattr(e, figure) for e in self.episodes], dtype=np.float64)

    @cached_property
    def means(self) -> dict[str, Interval | None]:
        """Mean of every metric over the episodes, None where undefined in all of them."""
        return {name: mean(self.values(name)) for name in FIGURES}

    @property
    def median_episode(self) -> EpisodeResult:
        """Episode with the median formation error, the lower one of two."""
        ranked = sorted(
            self.episodes, key=lambda e: (np.isnan(e.formation_error), e.formation_error)
        )
        return ranked[(len(ranked) - 1) // 2]

    def ratio(self, reference: Row) -> Interval | None:
        """Return the formation error relative to `reference` on the same seeds; < 1 is better."""
        return ratio(self.values("formation_error"), reference.values("formation_error"))


@dataclass(frozen=True, kw_only=True)
class CompareResult:
    """Result of a comparison."""

    __repr__ = short_repr

    rows: tuple[Row, ...]
    """Rows by task and scenario, then driver, then observation mode."""
    notes: tuple[str, ...]
    """Incompatible combinations with reasons."""
    first_seed: int
    """Seed of the first episode; number of the first round on real cars."""
    seeds: int
    errors_from: Literal["truth", "estimates"] = "truth"
    """Source of the errors: ground truth, or the estimates of real cars."""
    protocol: str | None = None
    """Name of the evaluation protocol."""
    remarks: tuple[str, ...] = ()
    """Incidents with real cars during the comparison."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of rows, in order."""
        return tuple(dict.fromkeys(r.group for r in self.rows))

    @property
    def contenders(self) -> tuple[Contender, ...]:
        """All candidates, in order."""
        return tuple(dict.fromkeys(r.contender for r in self.rows))

    def of(self, group: str) -> list[Row]:
        """Return the rows of a group."""
        return [r for r in self.rows if r.group == group]

    def reference(self, group: str) -> Row:
        """Return the reference of a group for ratios.

        The reference is the controller with the lowest formation error on other modes than
        `truth`; without one, the best controller on `truth`; without controllers, the best policy.
        """

        def rank(row: Row) -> tuple[bool, bool, float]:
            error = row.means["formation_error"]
            uses_truth = row.contender.observation == "truth"
            return row.trained_on is not None, uses_truth, np.inf if error is None else error.value

        return min(self.of(group), key=rank)

    @cached_property
    def records(self) -> list[dict[str, Any]]:
        """One flat record per row for JSON; unmeasured values are None."""
        return [self._record(row) for row in self.rows]

    @property
    def episode_records(self) -> list[dict[str, Any]]:
        """One flat record per episode for JSON."""
        return [
            {
                "policy": row.contender.called,
                "observation": row.contender.observation,
                "proximity": row.contender.proximity,
                "scenario": row.scenario,
                "task": row.setting.task,
                "errors_from": self.errors_from,
                "seed": e.seed,
                **{name: _number(getattr(e, name)) for name in FIGURES},
                "seconds": e.seconds,
                "done": e.done,
            }
            for row in self.rows
            for e in row.episodes
        ]

    def _record(self, row: Row) -> dict[str, Any]:
        error, *others = (row.means[name] for name in FIGURES)
        reference = self.reference(row.group)
        compared = row.ratio(reference)
        return {
            "policy": row.contender.called,
            "trained_on": row.trained_on,
            "observation": row.contender.observation,
            "proximity": row.contender.proximity,
            "scenario": row.scenario,
            "task": row.setting.task,
            "protocol": self.protocol,
            "trackers": row.setting.trackers,
            "level": row.setting.level,
            "operator": row.setting.operator,
            "cars": row.cars,
            "episodes": len(row.episodes),
            "errors_from": self.errors_from,
            "formation_error": _value(error),
            "ci95": _ends(error),
            **{name: _value(m) for name, m in zip(FIGURES[1:], others, strict=True)},
            **{f"{name}_ci95": _ends(m) for name, m in zip(FIGURES[1:], others, strict=True)},
            "seconds": float(row.values("seconds").mean()),
            "done_share": float(row.values("done").mean()),
            "reference": reference.contender.label,
            "ratio": _value(compared),
            "ratio_ci95": _ends(compared),
        }


def _value(found: Interval | None) -> float | None:
    return None if found is None else found.value


def _ends(found: Interval | None) -> list[float] | None:
    return None if found is None else found.ends


def _number(value: float) -> float | None:
    """Return a finite number, or None."""
    return float(value) if np.isfinite(value) else None
