"""Where a training run stands: what was measured after every leg."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

COUNTED = ("leg", "frames", "seconds", "return")
"""What the record of every leg must have to go on from it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """Where a run stands after a leg."""

    log: list[dict[str, Any]] = field(default_factory=list)
    """What was measured after every leg."""

    @classmethod
    def from_json(cls, text: str) -> Progress:
        """That of a checkpoint.

        Raises:
            ValueError: It is damaged.
        """
        found = json.loads(text)
        log = found.get("log") if isinstance(found, dict) else None
        if not isinstance(log, list) or not log:
            raise ValueError("progress: expected a log of at least one leg")
        for k, row in enumerate(log):
            for name in COUNTED:
                value = row.get(name) if isinstance(row, dict) else None
                if isinstance(value, bool) or not isinstance(value, int | float):
                    raise ValueError(f"progress: leg {k}: expected a number as {name!r}")
        return cls(log=log)

    @property
    def legs(self) -> int:
        """Finished."""
        return len(self.log)

    @property
    def frames(self) -> int:
        """Decisions of cars so far."""
        return int(self.log[-1]["frames"]) if self.log else 0

    @property
    def seconds(self) -> float:
        """Spent on training so far [s]."""
        return float(self.log[-1]["seconds"]) if self.log else 0.0

    @property
    def best_leg(self) -> int:
        """The leg after which the weights with the highest return were there, the first of equals.

        Raises:
            ValueError: No leg is finished.
        """
        return max(range(self.legs), key=lambda k: float(self.log[k]["return"]))

    def after_leg(
        self, frames: int, seconds: float, level: int | None, measured: Mapping[str, Any]
    ) -> Progress:
        """Where it stands a leg later.

        Args:
            frames: So far.
            seconds: That the leg took [s].
            level: Of the curriculum in it.
            measured: Of the policy after it, see `agents.training.evaluation`.
        """
        spent = round(self.seconds + seconds, 2)
        row = {"leg": self.legs, "frames": frames, "seconds": spent, "level": level}
        return Progress(log=[*self.log, {**row, **measured}])
