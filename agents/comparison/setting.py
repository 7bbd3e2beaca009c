"""Evaluation setting of all candidates: scenario, task, cars, duration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agents.simulation.demo import SETTLE
from relpos_env.config import Parts, configure
from relpos_env.core.tracked_world import Trackers
from relpos_env.sensors.operator import OperatorSimParams
from relpos_env.timing import DECISION


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One scenario and task; the observation mode depends on the candidate."""

    scenario: str | Path | None = None
    """One of `relpos_env.scenarios.SCENARIOS` or a TOML file; by default that of the task."""
    task: str = "ring"
    """One of `relpos_env.tasks.TASKS`."""
    task_options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the task, by name."""
    cars: int | None = None
    """[-] Slots for cars; by default the maximum of the scenario."""
    trackers: Trackers = "group"
    """One tracker of the group, or one on each car."""
    level: int | str | None = None
    """Level of the randomisation, 0 to 4 or a name, in place of the scenario's own."""
    operator: float = 1.0
    """[-] Share of episodes with an operator; in the others cars only follow the plan."""
    seconds: float = 60.0
    """[s] Length of an episode, shorter if the task is accomplished."""
    settle: float = SETTLE
    """[s] Time from which errors are scored."""

    @property
    def cycles(self) -> int:
        """Control steps of an episode."""
        return round(self.seconds / DECISION)

    @property
    def first_scored(self) -> int:
        """Index of the first control step whose errors are scored."""
        return round(self.settle / DECISION)

    def parts(self, observation: str, history: int, proximity: int = 0) -> Parts:
        """Return the parts of the environments.

        Args:
            observation: One of `relpos_env.interface.observations.OBSERVATIONS`.
            history: Number of stacked observations.
            proximity: Number of distance sensors around each car.

        Raises:
            EnvError: A name is unknown or a number out of range.
        """
        return configure(
            {
                "scenario": self.scenario,
                "task": self.task,
                "task_options": self.task_options,
                "n_cars": self.cars,
                "trackers": self.trackers,
                "level": self.level,
                "operator": OperatorSimParams(share=self.operator),
                "observation": observation,
                "history": history,
                "proximity": proximity,
                "max_cycles": self.cycles,
            }
        )
