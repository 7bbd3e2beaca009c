"""`relpos protocol`."""

from __future__ import annotations

from pathlib import Path

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import json_option, out_options
from agents.errors import UsageError


@click.command()
@click.option(
    "--events", default=200, show_default=True, help="Number of events of each kind and mode."
)
@click.option(
    "--nodes",
    default="3,4,5,6,10,20,50",
    show_default=True,
    help="Numbers of nodes, 2 to 62, separated by commas.",
)
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same figures."
)
@out_options("report.html and the pictures in it")
@json_option
def protocol(events: int, nodes: str, seed: int, out: Path | None, as_json: bool) -> None:
    """Measure the ranging protocol: rate, recovery after joins and leaves, clock errors."""
    from agents.output import check_folder, write_results
    from agents.protocol.experiment import protocol as run
    from agents.reports import protocol_report as report
    from agents.reports.style import svg

    try:
        sizes = tuple(int(n) for n in nodes.split(","))
    except ValueError:
        raise UsageError(f"--nodes: expected numbers such as 3,6,10, got {nodes!r}") from None
    if out is not None:
        check_folder(out, ["report.html", *report.PICTURES])
    with progress_bar("protocol") as tell:
        result = run(events=events, nodes=sizes, seed=seed, progress=tell)
    if out is not None:
        figures = report.figures(result)
        pictures = {name: svg(figure) for name, figure in figures.items()}
        write_results(out, {"report.html": report.protocol_report(result, figures), **pictures})
    if as_json:
        emit_json(result.records)
        return
    print_table("Rate", report.RATE_HEADER, report.rate_rows(result))
    print_table("Recovery", report.RECOVERY_HEADER, report.recovery_rows(result))
    print_table("Range errors by clocks", report.CLOCK_HEADER, report.clock_rows(result))
    if out is not None:
        click.echo(f"written: {out / 'report.html'}")
