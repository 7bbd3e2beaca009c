"""Progress of a training run: the record of every evaluation interval."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

COUNTED = ("interval", "frames", "seconds", "return")
"""Numbers that every record needs so that the run can be resumed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """Progress of a run after an evaluation interval."""

    log: list[dict[str, Any]] = field(default_factory=list)
    """Records of all evaluation intervals."""

    @classmethod
    def from_json(cls, text: str) -> Progress:
        """Return the progress of a checkpoint.

        Raises:
            ValueError: The text is damaged.
        """
        found = json.loads(text)
        log = found.get("log") if isinstance(found, dict) else None
        if not isinstance(log, list) or not log:
            raise ValueError("progress: expected a log of at least one interval")
        for k, row in enumerate(log):
            for name in COUNTED:
                value = row.get(name) if isinstance(row, dict) else None
                if isinstance(value, bool) or not isinstance(value, int | float):
                    raise ValueError(f"progress: interval {k}: expected a number as {name!r}")
        return cls(log=log)

    @property
    def n_intervals(self) -> int:
        """Number of finished evaluation intervals."""
        return len(self.log)

    @property
    def frames(self) -> int:
        """Number of agent steps so far."""
        return int(self.log[-1]["frames"]) if self.log else 0

    @property
    def seconds(self) -> float:
        """Training time so far [s]."""
        return float(self.log[-1]["seconds"]) if self.log else 0.0

    @property
    def best_interval(self) -> int:
        """Index of the evaluation interval with the highest return, the first of equals.

        Raises:
            ValueError: No evaluation interval is finished.
        """
        return max(range(self.n_intervals), key=lambda k: float(self.log[k]["return"]))

    def after_interval(
        self, frames: int, seconds: float, level: int | None, measured: Mapping[str, Any]
    ) -> Progress:
        """Return the progress after one more evaluation interval.

        Args:
            frames: Agent steps of the run so far.
            seconds: Duration of the interval [s].
            level: Curriculum level of the interval.
            measured: Evaluation of the policy, see `agents.training.evaluation`.
        """
        spent = round(self.seconds + seconds, 2)
        row = {"interval": self.n_intervals, "frames": frames, "seconds": spent, "level": level}
        return Progress(log=[*self.log, {**row, **measured}])
