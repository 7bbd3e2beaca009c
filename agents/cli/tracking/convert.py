"""`relpos convert`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import json_option, log_out_options

FOLDER = Path(__file__).parents[2] / "convert" / "presets"
MOST_NAMES = 8
"""[-] Streams that are named in a line."""
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
        done = run(
            source,
            out,
            preset=preset,
            mapping=mapping,
            restamp=restamp,
            overwrite=overwrite,
            progress=report,
        )
    log = done.log
    record = {
        "log": log.name,
        "out": str(out),
        "nodes": log.constellation.n_nodes,
        "duration_s": log.duration,
        "ranges": log.n_ranges,
        "truth_rows": len(log.truth.t),
        "streams": [asdict(use) for use in done.used],
        "unused_streams": list(done.unused),
    }
    if as_json:
        emit_json([record])
        return
    rows = [(u.table, _few(u.streams), f"{u.rows:,}", f"{u.left_out:,}") for u in done.used]
    print_table("Streams", ["table", "of", "rows", "left out"], rows)
    if any(use.left_out for use in done.used):
        click.echo(
            "Left out: measurements of nodes outside the mapping, invalid or missing numbers."
        )
    if done.unused:
        click.echo(f"Not in the mapping: {_few(done.unused)}.")
    if done.unsurveyed:
        ids = ", ".join(map(str, done.unsurveyed))
        click.echo(
            f"The distances between the static nodes {ids} are not given: [places] in the mapping "
            "makes them known."
        )
    click.echo(f"{out}: {record['nodes']} nodes, {log.duration:.0f} s, {log.n_ranges} ranges")


def _few(names: Sequence[str]) -> str:
    """Return the first few names as a text."""
    rest = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {rest} more" if rest > 0 else "")
