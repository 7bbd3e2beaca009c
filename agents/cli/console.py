"""Output of commands: JSON lines and tables on stdout, progress on stderr."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import click

LINE_EVERY = 10.0
"""[s] Time between two lines about progress where there is no terminal."""
WIDEST = 10_000
"""[-] Largest width of a line in characters."""


def emit_json(records: Iterable[Mapping[str, Any]]) -> None:
    """Print one JSON object per line."""
    for record in records:
        click.echo(json.dumps(record, allow_nan=False))


@contextmanager
def progress_bar(
    label: str, *, shown: bool = True, at_once: bool = True
) -> Iterator[Callable[[float], None]]:
    """Show progress on stderr: a bar on a terminal, otherwise a line every `LINE_EVERY` seconds.

    Args:
        label: Text before the bar.
        shown: Whether anything is shown.
        at_once: Whether the bar is there before the first report, which another bar may precede.

    Yields:
        A function of the share done.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    if not shown or not console.is_terminal:
        yield _in_lines(label) if shown else lambda share: None
        return
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )
    task = bar.add_task(label, total=1.0)

    def report(share: float) -> None:
        bar.start()
        bar.update(task, completed=share)

    if at_once:
        bar.start()
    try:
        yield report
    finally:
        bar.stop()


def _in_lines(label: str) -> Callable[[float], None]:
    last = time.monotonic()

    def report(share: float) -> None:
        nonlocal last
        if time.monotonic() - last >= LINE_EVERY:
            last = time.monotonic()
            click.echo(f"{label}: {share:.0%}", err=True)

    return report


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE)
    for k, name in enumerate(header):
        table.add_column(escape(name), justify="left" if k == 0 else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    console = Console(width=None if sys.stdout.isatty() else 120)
    # Figures must not be truncated: a narrow window wraps the lines instead.
    console.width = max(console.width, Console(width=WIDEST).measure(table).maximum)
    console.print(table)
