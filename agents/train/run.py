"""A run from nothing to a policy that can be used: what `relpos train` does, as a function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.output import write_results
from agents.report.train_report import train_report
from agents.train.config import TrainConfig
from agents.train.export import export_policy
from agents.train.train import train


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyResult:
    """A trained policy."""

    policy: Path
    """The file with its network; the card is beside it."""
    best: dict[str, Any]
    """What was measured of it in training."""
    records: list[dict[str, Any]]
    """What was measured after every leg."""


def train_policy(
    config: TrainConfig | None,
    folder: Path,
    *,
    progress: Callable[[float, dict[str, Any]], None] | None = None,
) -> PolicyResult:
    """Train, then write the best policy and a report into the folder of the run.

    Args:
        config: Of a new run; None to go on with the run in the folder.
        folder: New or empty, or that of the run.
        progress: Called after every leg with the share done and what was measured.

    Raises:
        UsageError: The folder does not fit, or cannot be written to.
        EnvError: An environment that cannot be.
    """
    result = train(config, folder, progress=progress)
    policy = export_policy(folder, folder)
    write_results(folder, {"report.html": train_report(result.config, result.records)})
    return PolicyResult(policy=policy, best=result.best, records=result.records)
