"""What a training with RLlib is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from agents.errors import UsageError
from agents.policies.layout import Layout
from relpos_env.config import configure
from relpos_env.scenarios import Scenario

RANGES: dict[str, tuple[int, int]] = {
    "iterations": (1, 1_000_000),
    "workers": (0, 4096),
    "envs": (1, 1024),
    "steps": (16, 10_000_000),
    "width": (1, 4096),
    "seed": (0, 2**31 - 1),
}
"""Whole numbers and what they may be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RllibConfig:
    """PPO [1] with one network for all cars.

    References:
        [1] Schulman et al., Proximal policy optimization algorithms, arXiv 1707.06347 (2017).
    """

    arguments: Mapping[str, Any] = field(default_factory=dict)
    """Of the environment, see `relpos_env.config.FormationConfig`."""
    iterations: int = 100
    """[-] Times that episodes are sampled and learnt from."""
    workers: int = 2
    """[-] Env runners, a core each; with 0 this process samples too."""
    envs: int = 4
    """[-] Environments of each env runner."""
    steps: int = 4000
    """[-] Decisions of environments, each of all its cars, in an iteration."""
    width: int = 64
    """[-] Units of a layer."""
    seed: int = 0
    """Of weights and episodes. Workers finish in any order, so results vary with it and beyond."""
    learning_rate: float = 3e-4
    gamma: float = 0.99
    """[-] Discount of a decision, 0.1 s."""
    trace: float = 0.95
    """[-] lambda of the generalised advantage estimate."""
    clip: float = 0.2
    """[-] How far a probability may go in an iteration, as a ratio."""
    epochs: int = 10
    """[-] Times that the samples of an iteration are gone through."""
    minibatch: int = 512
    """[-] Samples, of one car each, in a step of the learner."""

    def __post_init__(self) -> None:
        for name, (least, most) in RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise UsageError(f"--{name}: expected {least} to {most}, got {value}")

    @property
    def layout(self) -> Layout:
        """Of the observations.

        Raises:
            EnvError: The arguments of the environment do not fit.
        """
        parts = configure(dict(self.arguments))
        if parts.config.actions != "continuous":
            raise UsageError(f"actions: expected 'continuous', got {parts.config.actions!r}")
        return Layout.of(parts)

    @property
    def record(self) -> dict[str, Any]:
        """All of it, ready for JSON; of a scenario its file or name."""
        told = dict(self.arguments)
        scenario = told.get("scenario")
        if isinstance(scenario, Scenario):
            told["scenario"] = scenario.name
        elif isinstance(scenario, Path):
            told["scenario"] = str(scenario)
        return asdict(replace(self, arguments=told))
