"""What all contenders are put into: scenario, task, cars, time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agents.simulation.demo import SETTLE
from relpos_env.config import Parts, configure
from relpos_env.sensors.operator import OperatorSimParams
from relpos_env.timing import DECISION


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One scenario and task; what the contenders see of it is their own."""

    scenario: str | Path | None = None
    """One of `relpos_env.scenarios.SCENARIOS` or a TOML file; by default that of the task."""
    task: str = "ring"
    """One of `relpos_env.tasks.TASKS`."""
    task_options: Mapping[str, Any] = field(default_factory=dict)
    """The task's own options, by name."""
    cars: int | None = None
    """[-] Slots for cars; by default as many as the scenario can have."""
    level: int | None = None
    """Randomisation of a level of the curriculum, 0 to 4, in place of the scenario's own."""
    operator: float = 1.0
    """[-] Share of episodes with an operator; in the others cars follow the plan alone."""
    seconds: float = 60.0
    """[s] Length of an episode, less where the task is done before."""
    settle: float = SETTLE
    """[s] Errors are scored from here on."""

    @property
    def cycles(self) -> int:
        """Decisions of an episode."""
        return round(self.seconds / DECISION)

    @property
    def first_scored(self) -> int:
        """Number of the first decision whose errors count."""
        return round(self.settle / DECISION)

    def parts(self, observation: str, history: int, proximity: int = 0) -> Parts:
        """What the environments are made of.

        Args:
            observation: One of `relpos_env.interface.observations.OBSERVATIONS`.
            history: So many observations in one.
            proximity: Beams that measure distances round each car.

        Raises:
            EnvError: An unknown name or a number out of range.
        """
        return configure(
            {
                "scenario": self.scenario,
                "task": self.task,
                "task_options": self.task_options,
                "n_cars": self.cars,
                "level": self.level,
                "operator": OperatorSimParams(share=self.operator),
                "observation": observation,
                "history": history,
                "proximity": proximity,
                "max_cycles": self.cycles,
            }
        )
