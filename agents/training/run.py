"""Training, model selection, export and report of a policy in one call (`relpos train`)."""

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
    """File with the network; the model card is in the same folder."""
    best: dict[str, Any]
    """Evaluation of the policy in the model selection, with seed and evaluation interval."""
    records: list[dict[str, Any]]
    """Records of all evaluation intervals, run by run, each with its seed."""


def train_policy(
    config: TrainConfig | None,
    folder: Path,
    *,
    progress: Callable[[float, dict[str, Any] | None], None] | None = None,
) -> PolicyResult:
    """Train, then write the best policy and a report into the folder of the run.

    Parallel runs have subfolders, ``seed-0`` and so on. They require an importable calling script:
    put its code below `if __name__ == "__main__"`.

    Args:
        config: Configuration of a new run; None to resume the run in the folder.
        folder: New or empty folder, or that of the run to resume.
        progress: Called with the completed share, and with the record of an evaluation interval
            after it, else None.

    Raises:
        UsageError: The folder is unsuitable or not writable, or its name is no policy name.
        EnvError: An environment is invalid.
    """
    check_name(folder.resolve().name, "--out")
    resumed = config is None
    config = RunFolder(folder).config() if config is None else config
    done = [0.0] * config.runs

    def tell(k: int, share: float, row: dict[str, Any] | None) -> None:
        done[k] = share
        if progress is not None:
            record = None if row is None else {"seed": seeds[k], **row}
            progress(sum(done) / len(done), record)

    configs = [config.of_run(k) for k in range(config.runs)]
    seeds = [c.seed for c in configs]
    if config.runs == 1:
        folders = [folder]
        given = None if resumed else config
        results = [train(given, folder, progress=lambda *args: tell(0, *args))]
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
