"""Configuration of a training with RLlib."""

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
"""Minimum and maximum of the integer fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RllibConfig:
    """Configuration of PPO [1] with one network for all cars.

    References:
        [1] Schulman et al., Proximal policy optimization algorithms, arXiv 1707.06347 (2017).
    """

    arguments: Mapping[str, Any] = field(default_factory=dict)
    """Arguments of the environment, see `relpos_env.config.FormationConfig`."""
    iterations: int = 100
    """[-] Number of iterations of sampling and learning."""
    workers: int = 2
    """[-] Number of env runners with one core each; with 0 this process samples."""
    envs: int = 4
    """[-] Number of environments per env runner."""
    steps: int = 4000
    """[-] Environment steps per iteration, each with all cars of an environment."""
    width: int = 64
    """[-] Number of units per layer."""
    seed: int = 0
    """Seed of weights and episodes. Equal seeds give different results: workers are not in sync."""
    learning_rate: float = 3e-4
    gamma: float = 0.99
    """[-] Discount factor per step of 0.1 s."""
    trace: float = 0.95
    """[-] lambda of generalised advantage estimation."""
    clip: float = 0.2
    """[-] Clip parameter of PPO: limit of the change of probability ratios in an iteration."""
    epochs: int = 10
    """[-] Number of passes over the samples of an iteration."""
    minibatch: int = 512
    """[-] Samples per gradient step, of one car each."""

    def __post_init__(self) -> None:
        for name, (least, most) in RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise UsageError(f"--{name}: expected {least} to {most}, got {value}")

    @property
    def layout(self) -> Layout:
        """Layout of the observations.

        Raises:
            EnvError: The arguments of the environment are invalid.
        """
        parts = configure(dict(self.arguments))
        if parts.config.actions != "continuous":
            raise UsageError(f"actions: expected 'continuous', got {parts.config.actions!r}")
        return Layout.of(parts)

    @property
    def record(self) -> dict[str, Any]:
        """Configuration for JSON, with the file or name of the scenario."""
        arguments = dict(self.arguments)
        scenario = arguments.get("scenario")
        if isinstance(scenario, Scenario):
            arguments["scenario"] = scenario.name
        elif isinstance(scenario, Path):
            arguments["scenario"] = str(scenario)
        return asdict(replace(self, arguments=arguments))
