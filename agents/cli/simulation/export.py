"""`relpos export`."""

from __future__ import annotations

import json
from pathlib import Path

import click

from agents.cli.console import emit_json
from agents.errors import UsageError


@click.command()
@click.argument("run", type=Path)
@click.option("--out", type=Path, required=True, help="Folder for NAME.onnx and NAME.json.")
@click.option("--name", help="Name of the policy.  [default: that of the run's folder]")
@click.option(
    "--results", type=Path, help="results.jsonl of `relpos compare`, for the policy's card."
)
@click.option(
    "--last", is_flag=True, help="Export the last policy of a run in place of the chosen one."
)
@click.option("--overwrite", is_flag=True, help="Replace a policy of that name.")
@click.option(
    "--json", "as_json", is_flag=True, help="Print the card as JSON on stdout, nothing else."
)
def export(
    run: Path,
    out: Path,
    name: str | None,
    results: Path | None,
    last: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Export the policy of a training run to files that run without torch."""
    try:
        from agents.training.export import export_policy, read_results
    except ImportError as error:
        raise UsageError(
            f"exporting needs {error.name}: pip install -e '.[train]' in its source folder"
        ) from error
    names = {run.resolve().name, name or run.resolve().name}
    measured = read_results(results, names) if results is not None else []
    path = export_policy(run, out, name=name, results=measured, last=last, overwrite=overwrite)
    if as_json:
        from agents.policies import load_policy

        emit_json([json.loads(load_policy(path).card.to_json())])
    else:
        click.echo(f"written: {path} and {path.with_suffix('.json').name}")
