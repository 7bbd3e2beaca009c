"""Output of `relpos live` and `relpos replay` during the run."""

from __future__ import annotations

from collections import deque
from types import TracebackType
from typing import TYPE_CHECKING, Protocol

import click

from agents.cli.console import emit_json
from agents.hardware.live.monitor import Monitor
from agents.hardware.live.text import NODE_HEADER, line, node_rows, pair_header, pair_rows

if TYPE_CHECKING:
    from rich.table import Table

MOST_NOTICES = 4
"""[-] Number of notices shown above the tables."""
EVERY = 2
"""[-] Decisions per update of the tables."""
SECOND = 1.0

Notices = list[tuple[float, str]]


class Screen(Protocol):
    """Output of every decision; a context that is left at the end of the run."""

    def __enter__(self) -> Screen: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def show(self, monitor: Monitor, notices: Notices) -> None:
        """Show the state of the monitor and the notices since the last call."""


class JsonLines:
    """JSON records of each notice, and of each pair at each decision."""

    def __enter__(self) -> JsonLines:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def show(self, monitor: Monitor, notices: Notices) -> None:
        """Write the records."""
        emit_json({"result": "notice", "t": round(t, 6), "text": text} for t, text in notices)
        emit_json(monitor.snapshot().pair_records)


class Lines:
    """One line of text per second and per notice."""

    def __init__(self) -> None:
        self._next = SECOND

    def __enter__(self) -> Lines:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def show(self, monitor: Monitor, notices: Notices) -> None:
        """Write the lines."""
        for t, text in notices:
            click.echo(f"{t:7.1f} s  {text}")
        if monitor.swarm.intake.seconds(monitor.t_ns) >= self._next:
            snapshot = monitor.snapshot()
            click.echo(line(snapshot))
            self._next = snapshot.t + SECOND - snapshot.t % SECOND


class LiveTable:
    """Tables of nodes and pairs on a terminal, updated in place."""

    def __init__(self, title: str) -> None:
        """Prepare tables with a title in the first line."""
        from rich.live import Live

        self._title = title
        self._notices: deque[tuple[float, str]] = deque(maxlen=MOST_NOTICES)
        self._live = Live(auto_refresh=False, transient=True)

    def __enter__(self) -> LiveTable:
        self._live.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._live.__exit__(kind, error, trace)

    def show(self, monitor: Monitor, notices: Notices) -> None:
        """Draw the tables."""
        from rich.console import Group
        from rich.text import Text

        self._notices.extend(notices)
        if monitor.decisions % EVERY:
            return
        snapshot = monitor.snapshot()
        texts = [
            Text(f"{t:7.1f} s  {text}", no_wrap=True, overflow="ellipsis")
            for t, text in self._notices
        ]
        usable = f"{snapshot.n_ok} of {len(snapshot.pairs)} pairs ok"
        head = f"{self._title}   {snapshot.t:.0f} s   {usable}"
        self._live.update(
            Group(
                Text(head, style="bold"),
                *texts,
                table(list(NODE_HEADER), node_rows(snapshot)),
                table(pair_header(snapshot), pair_rows(snapshot), status=True),
            ),
            refresh=True,
        )


def table(header: list[str], rows: list[list[str]], *, status: bool = False) -> Table:
    """Return a table for a terminal.

    Args:
        header: Names of the columns.
        rows: Cells of the rows.
        status: Whether the last column is a status, which is coloured.
    """
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    drawn = Table(box=box.SIMPLE)
    for k, name in enumerate(header):
        drawn.add_column(escape(name), justify="left" if k == 0 else "right", no_wrap=True)
    for row in rows:
        colour = _COLOURS.get(row[-1], "yellow") if status else None
        last = f"[{colour}]{escape(row[-1])}[/]" if colour else escape(row[-1])
        drawn.add_row(*(escape(cell) for cell in row[:-1]), last)
    return drawn


_COLOURS = {"ok": "green", "lost": "red", "doubtful": "red", "absent": "dim"}
