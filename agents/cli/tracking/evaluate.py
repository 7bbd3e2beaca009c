"""`relpos evaluate`."""

from __future__ import annotations

from pathlib import Path

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import jobs_options, json_option, out_options


@click.command()
@click.option(
    "--suite",
    default="paper",
    show_default=True,
    help="Suite of cases: paper, robustness or scaling.",
)
@click.option(
    "--filter",
    "filters",
    multiple=True,
    default=("joint", "ekf-mds", "ekf", "paper-ekf-mds", "paper-ekf"),
    help="Filter to evaluate; repeatable.  [default: joint, ekf-mds, ekf, paper-ekf-mds "
    "and paper-ekf]",
)
@click.option(
    "--seeds",
    type=int,
    help="Runs of each case, with seeds from 0.  [default: 50; robustness 20, scaling 10]",
)
@click.option(
    "--seconds",
    type=float,
    help="Length of a run, 15 to 1800 [s].  [default: 120; robustness and scaling 60]",
)
@jobs_options("Only the time of a round depends on it.")
@json_option
@out_options("report.html, its pictures and results.jsonl")
def evaluate(
    suite: str,
    filters: tuple[str, ...],
    seeds: int | None,
    seconds: float | None,
    jobs: int,
    engine: str,
    address: str | None,
    as_json: bool,
    out: Path | None,
) -> None:
    """Evaluate filters in many simulated runs: errors, consistency, lost runs, time."""
    from agents.evaluation.evaluate import evaluate as run
    from agents.output import check_folder, write_results
    from agents.reports import evaluate_report as report
    from agents.warm_up import warm_up_first

    if out is not None:
        check_folder(out, ["report.html"])
    with progress_bar(f"evaluate {suite}", at_once=False) as tell:
        result = run(
            suite=suite,
            filters=filters,
            seeds=seeds,
            seconds=seconds,
            jobs=jobs,
            engine=engine,
            address=address,
            ready=lambda: warm_up_first(filters),
            progress=tell,
        )
    if out is not None:
        write_results(out, report.evaluate_files(result))
    if as_json:
        emit_json(result.records)
        return
    print_table(result.suite.title, report.header(result), report.rows(result))
    targets = report.target_rows(result)
    if targets:
        print_table("Targets [m]", report.TARGETS, targets)
    for line in report.notes(result):
        click.echo(line)
    if out is not None:
        click.echo(f"written: {out / 'report.html'}")
