"""`relpos simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from agents.cli.console import emit_json, progress_bar
from agents.cli.options import json_option, log_out_options, scenario_option


@click.command()
@log_out_options
@scenario_option("; human or human-mocap.", default="cars-nlos")
@click.option(
    "--seconds", default=120.0, show_default=True, help="Length, 3 to 86400 [s]; people up to 1800."
)
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same run."
)
@click.option(
    "--cars",
    type=int,
    help="Number of cars, 2 to 20; not for people.  [default: as many as the scenario has]",
)
@click.option(
    "--channel",
    help="Radio: calibrated (default of cars), indoor, hall, outdoor, body (of people) or exact.",
)
@click.option("--antenna-delay", type=float, help="Standard deviation of antenna delays [m].")
@json_option
def simulate(out: Path, as_json: bool, **options: Any) -> None:
    """Record simulated cars or a person as a log folder with truth."""
    from agents.simulation.simulate import simulate as run

    with progress_bar(f"{options['scenario']}, seed {options['seed']}") as report:
        log = run(out=out, progress=report, **options)
    nlos = float(log.nlos.mean()) if log.nlos is not None and len(log.nlos) else 0.0
    record = {
        "log": log.name,
        "out": str(out),
        "nodes": log.constellation.n_nodes,
        "duration_s": log.duration,
        "ranges": log.n_ranges,
        "nlos_share": nlos,
    }
    if as_json:
        emit_json([record])
    else:
        click.echo(
            f"{out}: {record['nodes']} nodes, {log.duration:.0f} s, {log.n_ranges} ranges, "
            f"{100 * nlos:.0f} % of them out of sight"
        )
