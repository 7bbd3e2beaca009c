"""`relpos compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from agents.console import emit_json, print_table, progress_bar


@click.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "--observation",
    "observations",
    multiple=True,
    default=("estimate",),
    show_default=True,
    help="What they see: estimate, estimate_cov, ranges, truth; may be given several times.",
)
@click.option(
    "--scenario",
    "scenarios",
    multiple=True,
    help="cars-los, cars-nlos, gap, hall, open, random, ring-los, ring-nlos, swarm-nlos, "
    "warehouse, or a file *.toml; may be given several times. By default that of the task.",
)
@click.option(
    "--task",
    default="ring",
    show_default=True,
    help="ring, hold, travel, gap, rendezvous or follow.",
)
@click.option(
    "--cars", type=int, help="Number of cars, 2 to 20; by default as many as the scenario has."
)
@click.option(
    "--proximity",
    type=int,
    help="Beams that measure distances round each car, 0 to 32; default: as the policies.",
)
@click.option("--level", type=int, help="Randomisation of a level, 0 to 4, in every scenario.")
@click.option("--episodes", default=100, show_default=True, help="Of each of them.")
@click.option("--first-seed", default=1000, show_default=True, help="Of the first episode.")
@click.option("--seconds", default=60.0, show_default=True, help="Length of an episode, to 3600.")
@click.option("--settle", default=10.0, show_default=True, help="Errors are scored from then on.")
@click.option(
    "--jobs", default=1, show_default=True, help="Processes at a time; no figure depends on it."
)
@click.option("--engine", default="local", show_default=True, help="Where jobs run: local or ray.")
@click.option("--address", help="Of a Ray cluster that runs, for --engine ray: auto or host:port.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
@click.option("--out", type=Path, help="New folder for report.html, its pictures, results.jsonl.")
def compare(
    names: tuple[str, ...],
    observations: tuple[str, ...],
    scenarios: tuple[str, ...],
    jobs: int,
    engine: str,
    address: str | None,
    as_json: bool,
    out: Path | None,
    **numbers: Any,
) -> None:
    """Compare drivers on the same episodes: formation error, contacts, energy, with intervals.

    NAME is a controller (consensus, leader-follower, range-only) or a trained policy: its name,
    its file or its folder.
    """
    from agents.compare.compare import compare as run
    from agents.compare.film import median_films
    from agents.output import check_folder, check_new, write_results
    from agents.report import compare_report as report

    if out is not None:
        check_new(out)
        check_folder(out, ["report.html"])
    with progress_bar("compare") as tell:
        result = run(
            drivers=names,
            observations=observations,
            scenarios=scenarios or (None,),
            jobs=jobs,
            engine=engine,
            address=address,
            progress=tell,
            **numbers,
        )
    if out is not None:
        with progress_bar("film") as tell:
            films = median_films(result, jobs=jobs, engine=engine, address=address, progress=tell)
        write_results(out, report.compare_files(result, films))
    if as_json:
        emit_json(result.records)
        return
    for scenario in result.scenarios:
        print_table(scenario, report.SHORT_HEADER, report.short_rows(result, scenario))
    for line in report.notes(result):
        click.echo(line)
    if out is not None:
        click.echo(f"written: {out / 'report.html'}")
