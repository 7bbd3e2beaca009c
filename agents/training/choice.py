"""Which policy is kept: those that may be it drive once more, in episodes that are new to them.

The best of many legs on a few episodes is partly luck, and so is the better of two runs.
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
"""Episodes that decide have seeds from here on, never used otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What is kept, and why."""

    run: Path
    """Folder of its run."""
    weights: str
    """File with its weights in there."""
    measured: dict[str, Any]
    """Its row."""
    rows: list[dict[str, Any]]
    """What was measured of all that might have been it: seed and leg too."""


def choose(config: TrainConfig, runs: Sequence[Path]) -> Choice:
    """Find the policy with the highest return among the best and the last of finished runs.

    Args:
        config: Of the runs, but for the seed.
        runs: Their folders.

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
        run, legs = RunFolder(path), set()
        for name in (BEST, LAST):
            loaded = run.load(name)
            if loaded is None:
                raise UsageError(f"{path}: expected {name} of a finished run, found none")
            tensors, progress = loaded
            row = progress.log[-1]
            if row["leg"] in legs:
                continue
            legs.add(row["leg"])
            restore_weights(policy, tensors)
            told = {"seed": run.config().seed, "leg": row["leg"], "frames": row["frames"]}
            rows.append(told | evaluation.run(policy))
            found.append(Choice(run=path, weights=name, measured=rows[-1], rows=rows))
    evaluation.close()
    return max(found, key=lambda choice: float(choice.measured["return"]))


def keep_choice(folder: Path, choice: Choice) -> None:
    """Note in the folder of the runs, or of the one run, what was chosen.

    Raises:
        UsageError: It cannot be written to.
    """
    run = choice.run.relative_to(folder).as_posix()
    record = {
        "run": run, "weights": choice.weights, "measured": choice.measured, "rows": choice.rows
    }  # fmt: skip
    write_results(folder, {FILE: json.dumps(record, indent=1, allow_nan=False) + "\n"})


def read_choice(folder: Path) -> Choice | None:
    """What was chosen; None before that.

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
