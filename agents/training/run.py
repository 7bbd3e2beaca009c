"""A run from nothing to a policy that can be used: what `relpos train` does, as a function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.output import write_results
from agents.policies.card import check_name
from agents.reports.train_report import train_report
from agents.training.begin import begin_with
from agents.training.choice import choose, keep_choice
from agents.training.config import TrainConfig
from agents.training.environments import check_environments
from agents.training.export import export_policy
from agents.training.ppo.learner import make_policy
from agents.training.run_folder import RunFolder
from agents.training.side_by_side import train_side_by_side
from agents.training.train import train


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyResult:
    """A trained policy."""

    policy: Path
    """The file with its network; the card is next to it."""
    best: dict[str, Any]
    """What was measured of it when it was chosen: seed and leg too."""
    records: list[dict[str, Any]]
    """What was measured after every leg, of one run after the other, each with its seed."""


def train_policy(
    config: TrainConfig | None,
    folder: Path,
    *,
    progress: Callable[[float, dict[str, Any] | None], None] | None = None,
) -> PolicyResult:
    """Train, then write the policy that drives best and a report into the folder of the run.

    Several runs have folders in it, ``seed-0`` and so on, and the calling script must be
    importable then: its work belongs below `if __name__ == "__main__"`.

    Args:
        config: Of a new run; None to go on with the run in the folder.
        folder: New or empty, or that of the run.
        progress: Called with the share done, and after every leg with what was measured, else None.

    Raises:
        UsageError: The folder does not fit, cannot be written to, or has a name that no policy can
            have.
        EnvError: An environment that cannot be.
    """
    check_name(folder.resolve().name, "--out")
    resumed = config is None
    config = RunFolder(folder).config() if config is None else config
    done = [0.0] * config.runs

    def tell(k: int, share: float, row: dict[str, Any] | None) -> None:
        done[k] = share
        if progress is not None:
            told = None if row is None else {"seed": seeds[k], **row}
            progress(sum(done) / len(done), told)

    configs = [config.of_run(k) for k in range(config.runs)]
    seeds = [c.seed for c in configs]
    if config.runs == 1:
        folders = [folder]
        given = None if resumed else config
        results = [train(given, folder, progress=lambda *leg: tell(0, *leg))]
    else:
        if not resumed:
            check_environments(config)
            if config.begin:
                begin_with(make_policy(config), config)
            RunFolder(folder).create(config)
        folders = [folder / f"seed-{seed}" for seed in seeds]
        results = train_side_by_side(configs, folders, tell)
    choice = choose(config, folders)
    keep_choice(folder, choice)
    policy = export_policy(folder, folder, overwrite=True)
    records = [
        {"seed": seed, **row}
        for seed, result in zip(seeds, results, strict=True)
        for row in result.records
    ]
    write_results(folder, {"report.html": train_report(config, records, choice)})
    return PolicyResult(policy=policy, best=choice.measured, records=records)
