"""Model selection: the best and the last policy of each run are evaluated on new episodes.

The maximum over many evaluations on a few episodes, or over two runs, is biased upwards.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.errors import UsageError
from agents.output import write_results
from agents.training.config import TrainConfig
from agents.training.environments import choice_environments, layout_of
from agents.training.evaluation import Evaluation
from agents.training.ppo.learner import make_policy
from agents.training.run_folder import BEST, LAST, RunFolder, restore_weights

FILE = "choice.json"
FIRST_SEED = 100_000
"""First seed of the selection episodes; these seeds are used for nothing else."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """The selected policy and the evaluations of all candidates."""

    run: Path
    """Folder of the run."""
    weights: str
    """Name of the file with the weights in that folder."""
    measured: dict[str, Any]
    """Evaluation of the selected policy, one of `rows`."""
    rows: list[dict[str, Any]]
    """Evaluations of all candidates, with seed and evaluation interval."""


def choose(config: TrainConfig, runs: Sequence[Path]) -> Choice:
    """Select the policy with the highest return among the best and the last of finished runs.

    Args:
        config: Configuration of the runs, apart from the seed.
        runs: Folders of the runs.

    Raises:
        UsageError: A run is damaged or not finished.
    """
    every, policy = choice_environments(config), make_policy(config)
    evaluation = Evaluation(
        every, layout_of(config), config.choice_episodes, config.threads, first_seed=FIRST_SEED
    )
    found: list[Choice] = []
    rows: list[dict[str, Any]] = []
    for path in runs:
        run, intervals = RunFolder(path), set()
        for name in (BEST, LAST):
            loaded = run.load(name)
            if loaded is None:
                raise UsageError(f"{path}: expected {name} of a finished run, found none")
            tensors, progress = loaded
            row = progress.log[-1]
            if row["interval"] in intervals:
                continue
            intervals.add(row["interval"])
            restore_weights(policy, tensors)
            entry = {
                "seed": run.config().seed,
                "interval": row["interval"],
                "frames": row["frames"],
            }
            rows.append(entry | evaluation.run(policy))
            found.append(Choice(run=path, weights=name, measured=rows[-1], rows=rows))
    evaluation.close()
    return max(found, key=lambda choice: float(choice.measured["return"]))


def keep_choice(folder: Path, choice: Choice) -> None:
    """Write the selected policy to the folder of the runs, or of the only run.

    Raises:
        UsageError: The folder cannot be written to.
    """
    run = choice.run.relative_to(folder).as_posix()
    record = {
        "run": run, "weights": choice.weights, "measured": choice.measured, "rows": choice.rows
    }  # fmt: skip
    write_results(folder, {FILE: json.dumps(record, indent=1, allow_nan=False) + "\n"})


def read_choice(folder: Path) -> Choice | None:
    """Return the selected policy; None if none has been selected.

    Raises:
        UsageError: The file is damaged.
    """
    path = folder / FILE
    if not path.exists():
        return None
    try:
        record = json.loads(path.read_text())
        run = folder / str(record["run"])
        weights, measured, rows = record["weights"], record["measured"], record["rows"]
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise UsageError(f"{path}: damaged, expected a choice ({error!r})") from error
    here = folder.resolve() in (run.resolve(), run.resolve().parent)
    if weights not in (BEST, LAST) or not here:
        raise UsageError(f"{path}: damaged, expected a run of this folder")
    return Choice(run=run, weights=weights, measured=measured, rows=rows)
