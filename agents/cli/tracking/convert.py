"""`relpos convert`."""

from __future__ import annotations

from pathlib import Path

import click

from agents.cli.console import emit_json, progress_bar
from agents.cli.options import json_option, log_out_options

FOLDER = Path(__file__).parents[2] / "convert" / "presets"
PRESETS = ", ".join(sorted(path.stem for path in FOLDER.glob("*.toml")))


@click.command()
@click.argument("source", type=Path)
@log_out_options
@click.option("--preset", help=f"A public data set: {PRESETS}.")
@click.option(
    "--mapping",
    type=Path,
    help="A file that names streams and fields, instead of a preset.",
)
@click.option(
    "--restamp", is_flag=True, help="Replace the times of IMU samples by those of a steady rate."
)
@json_option
def convert(
    source: Path,
    out: Path,
    overwrite: bool,
    preset: str | None,
    mapping: Path | None,
    restamp: bool,
    as_json: bool,
) -> None:
    """Convert a ROS bag, CSV tables, a file of arrays or a serial capture to a log folder."""
    from agents.convert import convert as run

    with progress_bar(f"reading {source}") as report:
        log = run(
            source,
            out,
            preset=preset,
            mapping=mapping,
            restamp=restamp,
            overwrite=overwrite,
            progress=report,
        )
    record = {
        "log": log.name,
        "out": str(out),
        "nodes": log.constellation.n_nodes,
        "duration_s": log.duration,
        "ranges": log.n_ranges,
        "truth_rows": len(log.truth.t),
    }
    if as_json:
        emit_json([record])
    else:
        click.echo(
            f"{out}: {record['nodes']} nodes, {log.duration:.0f} s, {log.n_ranges} ranges, "
            f"{len(log.truth.t)} rows of truth"
        )
