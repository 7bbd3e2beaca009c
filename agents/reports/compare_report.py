"""The report of a comparison: tables, figures, and the median episode of every candidate."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from agents.comparison.contender import sees
from agents.comparison.meter import IN_FORMATION
from agents.comparison.result import CompareResult, Row
from agents.reports import compare_figures as figures
from agents.reports.animation import player_markup
from agents.reports.page import Page, metres
from agents.reports.style import svg

_TO = "\N{NO-BREAK SPACE}to\N{NO-BREAK SPACE}"
HEADER = (
    "driver", "trained on", "sees", "error [m]", "95 %", "place", "tracking", "collisions/min",
    "touch %", "formed %", "J/min", "ratio", "95 %",
)  # fmt: skip
"""Names of the columns."""


def rows(result: CompareResult, group: str) -> list[list[str]]:
    """Return the table of one group, one row per driver and observation mode."""
    return [
        _cells(record)
        for row, record in zip(result.rows, result.records, strict=True)
        if row.group == group
    ]


def _cells(record: dict[str, Any]) -> list[str]:
    share, touch = record["time_in_formation"], record["contact_time"]
    return [
        record["policy"],
        record["trained_on"] or "-",
        sees(record["observation"], record["proximity"]),
        metres(record["formation_error"]),
        _ends(record["ci95"]),
        metres(record["place_error"]),
        metres(record["tracking_error"]),
        _number(record["collisions_per_min"], 2),
        _number(None if touch is None else 100.0 * touch, 2),
        _number(None if share is None else 100.0 * share, 1),
        _number(record["energy"], 1),
        _number(record["ratio"], 3),
        _ends(record["ratio_ci95"]),
    ]


SHORT_HEADER = (
    "driver", "error", "95 %", "place", "track", "collisions", "formed", "ratio", "95 %",
)  # fmt: skip
"""Names of the columns of `short_rows`."""
_LONGEST = 36
"""[-] Longest name of a driver in a terminal, so that no number is truncated."""


def short_rows(result: CompareResult, group: str) -> list[list[str]]:
    """Return the table of one group for a terminal, without energy and time in contact."""
    lines = []
    for row, cells in zip(result.of(group), rows(result, group), strict=True):
        shown = f" on {row.contender.sees}"
        name, room = row.contender.called, _LONGEST - len(shown)
        if len(name) > room:
            name = f"{name[: room - 3]}..."
        kept = (*cells[3:8], cells[9], *cells[11:])
        numbers = [cell.replace(_TO, "-") for cell in kept]
        lines.append([name + shown, *numbers])
    return lines


def notes(result: CompareResult) -> list[str]:
    """Return notes on the table, one per line."""
    setting = result.rows[0].setting
    by: dict[str, list[str]] = {}
    for group in result.groups:
        by.setdefault(result.reference(group).contender.label, []).append(group)
    references = "; ".join(f"{label} in {', '.join(names)}" for label, names in by.items())
    last = result.first_seed + result.seeds - 1
    if result.errors_from == "truth":
        alike, whole = "on the same seeds", "collisions (of all cars) and the energy of a car"
        order = f"seeds {result.first_seed} to {last}, the same for all"
    else:
        alike, whole = "in the same rounds", "the energy of a car, by its odometer,"
        order = "in rounds, one driver after the other, with real cars"
    tasks = tuple(dict.fromkeys(row.setting.task for row in result.rows))
    what = f"Task{'s' if len(tasks) > 1 else ''} {', '.join(tasks)}"
    if setting.level is not None:
        what += f", level {setting.level}"
    if result.protocol is not None:
        what += f", protocol {result.protocol}"
    lines = [
        f"{what}, {result.seeds} episodes of {setting.seconds:g} s each, {order}; "
        "means with 95 % intervals.",
        f"Errors [m] and the time formed (every car's error below {IN_FORMATION:g} m) count from "
        f"{setting.settle:g} s on; {whole} from the start.",
        "place: how far the middle of the group is from where the task wants it [m].",
        f"ratio: formation error over that of {references}, {alike}.",
    ]
    if result.errors_from == "estimates":
        lines.append(
            "Errors are what the cars estimated themselves: the truth is not known, tracking error "
            "and collisions among it."
        )
    lines += [f"Left out: {note}." for note in result.notes]
    return lines + [f"{remark}." for remark in result.remarks]


def compare_files(
    result: CompareResult, films: Sequence[dict[str, Any]] = ()
) -> dict[str, str | bytes]:
    """Return the files of a comparison by name.

    Args:
        result: Result of the comparison.
        films: Frames of the median episode of every row; empty for real cars.
    """
    drawn = figures.figures(result)
    names = ", ".join(dict.fromkeys(c.called for c in result.contenders))
    tasks = ", ".join(dict.fromkeys(row.setting.task for row in result.rows))
    page = Page(f"Comparison on {tasks}", names)
    for group in result.groups:
        page.heading(group)
        page.table(HEADER, rows(result, group))
    for line in notes(result):
        page.text(line)
    for name, (title, figure, caption) in drawn.items():
        page.heading(title)
        page.figure(figure, f"{caption} ({name})")
    filmed = list(zip(result.rows, films, strict=True)) if films else []
    for n, group in enumerate(result.groups if films else ()):
        page.heading(f"Median episodes in {group}")
        drives = {_title(r): frames for r, frames in filmed if r.group == group}
        page.raw(player_markup(drives, running=n == 0))
    lines = [*result.records, *result.episode_records]
    return {
        "report.html": page.render(),
        "results.jsonl": "".join(json.dumps(r, allow_nan=False) + "\n" for r in lines),
        **{name: svg(figure) for name, (_, figure, _) in drawn.items()},
    }


def _title(row: Row) -> str:
    """Return the title of an episode in the player."""
    episode = row.median_episode
    error = metres(episode.formation_error)
    return f"{row.contender.label}: seed {episode.seed}, formation error {error} m"


def _number(value: float | None, digits: int) -> str:
    """Format a number for a table, or a dash."""
    return "-" if value is None else f"{value:.{digits}f}"


def _ends(ends: Sequence[float] | None) -> str:
    """Format an interval for a table, or a dash."""
    return "-" if ends is None else f"{ends[0]:.3f}{_TO}{ends[1]:.3f}"
