"""`relpos bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from agents.console import emit_json, print_table, progress_bar
from agents.errors import UsageError


@click.group()
def bench() -> None:
    """Measure speed, each figure beside a peer in the same run."""


@bench.command("tracker")
@click.option("--rounds", default=2000, show_default=True, help="Ranging rounds per figure.")
@click.option("--out", type=Path, help="Folder for a picture of the time over the group's size.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def bench_tracker(rounds: int, out: Path | None, as_json: bool) -> None:
    """Time of ranging rounds, messages and an hour, beside filterpy and GTSAM."""
    from agents.bench.tracker import bench_tracker as run
    from agents.output import check_folder
    from agents.report.bench_figures import PICTURE

    if rounds < 100:
        raise UsageError(f"--rounds: expected at least 100, got {rounds}")
    if out is not None:
        check_folder(out, [PICTURE])
    with progress_bar("tracker") as report:
        rows = run(rounds=rounds, progress=report, tell=lambda note: click.echo(note, err=True))
    if out is not None:
        _draw_growth(out)
    _show_bench("Time of the tracker", rows, as_json)
    if out is not None and not as_json:
        click.echo(f"written: {out / PICTURE}")


def _draw_growth(out: Path) -> None:
    from agents.bench.tracker.growth import growth
    from agents.output import write_results
    from agents.report.bench_figures import PICTURE, cost_figure
    from agents.report.page import png

    with progress_bar("sizes of groups") as report:
        result = growth(progress=report)
    write_results(out, {PICTURE: png(cost_figure(result))})


@bench.command("radio")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def bench_radio(as_json: bool) -> None:
    """Microseconds per message-level round in a batch, beside the reference session."""
    from agents.bench.radio import bench_radio as run

    with progress_bar("radio") as report:
        rows = run(progress=report)
    _show_bench("Time of one message-level round", rows, as_json)


def _show_bench(title: str, rows: list[dict[str, Any]], as_json: bool) -> None:
    if as_json:
        emit_json(rows)
        return
    header = ["case", "value", "unit", "peer", "peer value", "ratio"]
    figures = [(f"{r['value']:.2f}", f"{r['peer_value']:.1f}", f"{r['ratio']:.0f}") for r in rows]
    cells = [
        [r["case"], value, r["unit"], r["peer"], peer, ratio]
        for r, (value, peer, ratio) in zip(rows, figures, strict=True)
    ]
    print_table(title, header, cells)
