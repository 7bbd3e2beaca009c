"""`relpos train`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import json_option
from agents.errors import UsageError
from agents.settings import from_options, is_given, leaves, options
from agents.training.config import TrainConfig


@click.command()
@click.option("--out", type=Path, help="New folder for the run; its name is that of the policy.")
@click.option("--resume", type=Path, metavar="RUN", help="Go on with the run in this folder.")
@json_option
@options(TrainConfig)
def train(out: Path | None, resume: Path | None, as_json: bool, **given: Any) -> None:
    """Train one policy for all cars; writes a file that runs without torch, and a report.

    The performance of a policy depends strongly on the seed: --runs 2 trains two policies at the
    same time and keeps the better one.
    """
    if (out is None) == (resume is None):
        raise UsageError("--out, --resume: expected one of them, a new folder or that of a run")
    changed = [k for k, v in given.items() if is_given(v)]
    if resume is not None and changed:
        raise UsageError(
            f"{_option(changed[0])}: a run goes on with its own configuration, "
            "expected no other options with --resume"
        )
    config = from_options(TrainConfig, given)
    folder = out if out is not None else resume
    assert folder is not None
    try:
        from agents.reports.page import metres
        from agents.training.run import train_policy
        from agents.warm_up import warm_up_first
        from tracking.filters import DEFAULT_FILTER
    except ImportError as error:
        raise UsageError(
            f"training needs {error.name}: pip install -e '.[train]' in its source folder"
        ) from error
    warm_up_first([DEFAULT_FILTER], purpose="env", in_space=False)
    with progress_bar(f"training {folder.name}") as tell:

        def report(share: float, row: dict[str, Any] | None) -> None:
            tell(share)
            if row is None:
                return
            if as_json:
                emit_json([row])
            else:
                click.echo(_line(row), err=True)

        try:
            result = train_policy(config if resume is None else None, folder, progress=report)
        except KeyboardInterrupt as error:
            raise UsageError(f"interrupted; relpos train --resume {folder} goes on") from error
    if as_json:
        emit_json([{"result": "policy", "path": str(result.policy), **result.best}])
        return
    best = result.best
    print_table(
        "The policy that is kept",
        ["", ""],
        [
            ["seed, interval, frames", f"{best['seed']}, {best['interval']}, {best['frames']}"],
            ["formation error [m]", f"{best['formation_error']:.3f}"],
            ["tracking error [m]", metres(best["tracking_error"])],
            ["collisions per minute", f"{best['collisions_per_min']:.2f}"],
        ],
    )
    click.echo(f"written: {result.policy} and its card; open {folder / 'report.html'}")


def _option(name: str) -> str:
    return next(leaf.option for leaf in leaves(TrainConfig) if leaf.name == name)


def _line(row: dict[str, Any]) -> str:
    rate = row["frames"] / max(row["seconds"], 1e-9)
    return (
        f"seed {row['seed']}  interval {row['interval']:3d}  {row['frames']:>11,d} frames  "
        f"{rate:7.0f}/s  return {row['return']:6.3f}  formation {row['formation_error']:.3f} m  "
        f"collisions {row['collisions_per_min']:.2f}/min"
    )
