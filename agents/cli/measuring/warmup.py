"""`relpos warmup`."""

from __future__ import annotations

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import json_option


@click.command()
@click.option(
    "--filter",
    "filters",
    multiple=True,
    help="Filter: joint (default), ekf-mds, ekf, paper-ekf-mds or paper-ekf; repeatable.",
)
@click.option(
    "--for",
    "purpose",
    default="track",
    show_default=True,
    help="What is compiled: track, env (also the simulator), hardware (also the bridge) or all.",
)
@click.option(
    "--jobs", type=click.IntRange(1, 64), help="Number of processes.  [default: one per core]"
)
@json_option
def warmup(purpose: str, filters: tuple[str, ...], jobs: int | None, as_json: bool) -> None:
    """Compile ahead of time, for containers, CI and laptops before a demo.

    Compiled code stays on disk until the package, numba or the processor changes.
    """
    from agents.warm_up import parts_of, warm_up
    from agents.warm_up.processes import shown_progress
    from tracking.filters import DEFAULT_FILTER

    with shown_progress() as tell:
        found = warm_up(parts_of(purpose, filters or (DEFAULT_FILTER,)), jobs=jobs, progress=tell)
    if as_json:
        emit_json([found.summary])
        return
    rows = [
        [part, "compiled now" if part in found.compiled else "on the disk"] for part in found.parts
    ]
    print_table("Warm-up", ["part", ""], rows)
    memory = f", at most {found.largest_mb:.0f} MB a process" if found.largest_mb else ""
    click.echo(f"{found.seconds:.1f} s{memory}")
