"""`relpos bench`."""

from __future__ import annotations

from typing import Any

import click

from agents.console import emit_json, print_table, progress_bar
from agents.errors import UsageError


@click.group()
def bench() -> None:
    """Measure speed, each figure beside a peer in the same run."""


@bench.command("tracker")
@click.option("--rounds", default=2000, show_default=True, help="Ranging rounds per figure.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def bench_tracker(rounds: int, as_json: bool) -> None:
    """Microseconds per ranging round, beside filterpy doing the same pair updates."""
    from agents.bench.tracker import bench_tracker as run

    if rounds < 100:
        raise UsageError(f"--rounds: expected at least 100, got {rounds}")
    with progress_bar("tracker") as report:
        rows = run(rounds=rounds, progress=report)
    _show_bench("Time of one ranging round", rows, as_json)


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
