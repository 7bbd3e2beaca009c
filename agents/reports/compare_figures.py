"""Figures of a comparison: metrics with intervals, error over time, scatter, ratios."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agents.comparison.meter import IN_FORMATION
from agents.comparison.result import FIGURES, CompareResult, Row
from agents.comparison.statistics import Interval
from agents.reports.style import BAND, COLOURS, in_style, new_figure, plain_ticks
from relpos_env.timing import DECISION

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LABELS = {
    "formation_error": "formation error [m]",
    "place_error": "distance from the goals [m]",
    "tracking_error": "tracking error [m]",
    "disagreement": "disagreement of two cars [m]",
    "collisions_per_min": "collisions [1/min]",
    "contact_time": "time in contact [%]",
    "time_in_formation": f"time below {IN_FORMATION:g} m [%]",
    "energy": "energy [J/min]",
}
WIDE = 4.0
"""[-] Ratios that span more than this factor are drawn on a logarithmic axis."""
COLUMNS = 3
"""[-] Panels per row."""


@in_style
def figures(result: CompareResult) -> dict[str, tuple[str, Figure, str]]:
    """Return title, figure and caption by file name."""
    settle = result.rows[0].setting.settle
    drawn = {
        "compare-figures.svg": (
            "Figures",
            _bars(result),
            "Means over the episodes with 95 % intervals. The axis of the energy does not begin at "
            "0: differences are small compared with what rolling takes.",
        ),
        "compare-time.svg": (
            "Formation error over time",
            _over_time(result),
            f"Median over the episodes, and the band of the middle half of them. Grey: before "
            f"{settle:g} s, not scored.",
        ),
    }
    if "tracking_error" in _measured(result):
        drawn["compare-scatter.svg"] = (
            "What the tracker costs",
            _scatter(result),
            "Every episode: formation error over the error of the relative positions that the "
            "cars knew. Rings: means.",
        )
    if len(result.contenders) > 1:
        drawn["compare-ratios.svg"] = (
            "Ratio to the best controller",
            _ratios(result),
            "Formation error over that of the reference on the same seeds (real cars: in the same "
            "rounds), with 95 % intervals; left of 1 is better. Dotted: a "
            "fifth better.",
        )
    return drawn


def _measured(result: CompareResult) -> list[str]:
    """Return the metrics that are defined for at least one row."""
    return [name for name in FIGURES if any(row.means[name] for row in result.rows)]


def _colours(result: CompareResult) -> dict[str, str]:
    """Return a colour per candidate, the same in all figures."""
    return {c.label: COLOURS[n % len(COLOURS)] for n, c in enumerate(result.contenders)}


def _bars(result: CompareResult) -> Figure:

    colours, groups, measured = _colours(result), result.groups, _measured(result)
    counts = [len(result.of(s)) for s in groups]
    height = sum(0.34 * n + 0.9 for n in counts) + 0.2
    figure = new_figure(3.0 + 2.0 * len(measured), height)
    axes = figure.subplots(
        len(groups), len(measured), squeeze=False, sharey="row",
        height_ratios=[n + 0.6 for n in counts],
    )  # fmt: skip
    for line, group in zip(axes, groups, strict=True):
        rows = result.of(group)
        for ax, name in zip(line, measured, strict=True):
            scale = _scale(name)
            for y, row in enumerate(rows):
                bar = name != "energy"
                _bar(ax, y, row.means[name], scale, colours[row.contender.label], bar=bar)
            ax.set_xlim(_limits(name, [row.means[name] for row in rows]))
            ax.grid(visible=False, axis="y")
            ax.set_ylim(len(rows) - 0.4, -0.6)
            ax.tick_params(axis="y", length=0)
            ax.locator_params(axis="x", nbins=3)
        line[0].set_yticks(range(len(rows)), [r.contender.label for r in rows])
        line[0].set_title(group, loc="left", fontweight="bold")
    for ax, name in zip(axes[-1], measured, strict=True):
        ax.set_xlabel(LABELS[name])
    figure.suptitle(f"means of {_episodes(result)}, 95 % intervals", fontsize=9)
    return figure


def _bar(ax: Axes, y: int, found: Interval | None, scale: float, colour: str, *, bar: bool) -> None:
    """Draw one bar, or a dot if the axis does not begin at 0, with its interval."""
    if found is None:
        return
    if found.ends is not None:
        ax.hlines(y, scale * found.ends[0], scale * found.ends[1], color="k", lw=1.6, zorder=3)
    if bar:
        ax.barh(y, scale * found.value, height=0.62, color=colour, alpha=0.75)
    else:
        ax.plot(scale * found.value, y, "o", color=colour, ms=7, zorder=2)


def _limits(name: str, found: Sequence[Interval | None]) -> tuple[float, float]:
    """Return the limits of the axis of a metric."""
    if name == "time_in_formation":
        return 0.0, 100.0
    ends = [e for m in found if m is not None for e in (m.ends or [m.value])] or [0.0]
    low, high = min(ends), max(ends)
    if name == "energy":
        margin = 0.15 * (high - low) + 0.01 * high + 1e-3
        return low - margin, high + margin
    return 0.0, 1.08 * _scale(name) * high or 1.0


def _scale(name: str) -> float:
    """Return the factor of a metric for display: 100 for shares, drawn in percent."""
    return 100.0 if LABELS[name].endswith("[%]") else 1.0


def _panels(result: CompareResult, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per group."""
    names = result.groups
    columns = min(len(names), COLUMNS)
    lines = -(-len(names) // columns)
    width = max(width * columns, 7.0)
    figure = new_figure(width, height * lines + 0.4)
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for ax in axes[len(names) :]:
        ax.remove()
    for ax, name in zip(axes, names, strict=False):
        ax.set_title(name)
    return figure, list(axes[: len(names)])


def _over_time(result: CompareResult) -> Figure:
    colours = _colours(result)
    figure, axes = _panels(result, 4.0, 3.2)
    for ax, group in zip(axes, result.groups, strict=True):
        rows, top = result.of(group), 0.0
        setting = rows[0].setting
        ax.axvspan(0, setting.settle, color="0.94", lw=0)
        for row in rows:
            t, (low, middle, high) = _quartiles(row)
            colour = colours[row.contender.label]
            ax.fill_between(t, low, high, color=colour, alpha=BAND, lw=0)
            ax.plot(t, middle, color=colour, lw=1.3, label=row.contender.label)
            scored = high[t > setting.settle]
            top = max(top, float(np.nanmax(scored if len(scored) else high)))
        ax.set(xlim=(0, setting.seconds), ylim=(0, 1.3 * top or 1.0), xlabel="t [s]")
    _finish(figure, "formation error [m]", f"median and middle half of {_episodes(result)}")
    return figure


def _quartiles(row: Row) -> tuple[np.ndarray, np.ndarray]:
    """Return times (step,) and quartiles of the error over running episodes (3, step)."""
    cycles = max(len(e.error) for e in row.episodes)
    error = np.full((len(row.episodes), cycles), np.nan)
    for line, episode in zip(error, row.episodes, strict=True):
        line[: len(episode.error)] = episode.error
    out = np.full((3, cycles), np.nan)
    some = np.isfinite(error).any(axis=0)
    out[:, some] = np.nanquantile(error[:, some], (0.25, 0.5, 0.75), axis=0)
    return DECISION * np.arange(1, cycles + 1), out


def _scatter(result: CompareResult) -> Figure:
    colours = _colours(result)
    figure, axes = _panels(result, 4.0, 3.4)
    for ax, group in zip(axes, result.groups, strict=True):
        for row in result.of(group):
            x, y = row.values("tracking_error"), row.values("formation_error")
            colour = colours[row.contender.label]
            ax.plot(x, y, ".", color=colour, ms=7, alpha=0.45, mew=0, label=row.contender.label)
        for row in result.of(group):
            x_mean, y_mean = row.means["tracking_error"], row.means["formation_error"]
            if x_mean is not None and y_mean is not None:
                colour = colours[row.contender.label]
                x_y = (x_mean.value, y_mean.value)
                ax.plot(*x_y, "o", zorder=3, mfc="none", mec=colour, mew=2, ms=8)
        ax.set_xlabel("tracking error [m]")
        ax.locator_params(axis="x", nbins=6)
        ax.set_xlim(left=-0.03 * ax.get_xlim()[1])
        ax.set_ylim(bottom=0)
    _finish(figure, "formation error [m]", f"{_episodes(result)}, ring: their mean")
    return figure


def _ratios(result: CompareResult) -> Figure:
    colours, groups = _colours(result), result.groups
    counts = [len(result.of(s)) for s in groups]
    figure = new_figure(9, sum(0.34 * n + 0.9 for n in counts) + 0.2)
    heights = [n + 0.6 for n in counts]
    axes = figure.subplots(len(groups), 1, squeeze=False, height_ratios=heights)[:, 0]
    for ax, group in zip(axes, groups, strict=True):
        rows, reference = result.of(group), result.reference(group)
        for y, row in enumerate(rows):
            found = row.ratio(reference)
            if found is None:
                continue
            colour = colours[row.contender.label]
            if found.ends is not None:
                ax.hlines(y, *found.ends, color=colour, lw=3, alpha=0.6)
            ax.plot(found.value, y, "o", color=colour, ms=6)
            ax.annotate(
                f"{found.value:.2f}",
                (found.value, y),
                (0, 7),
                textcoords="offset points",
                ha="center",
                fontsize=8,
            )
        ax.axvline(1.0, color="k", lw=1)
        ax.axvline(0.8, color="k", lw=1, ls=":")
        ax.set_yticks(range(len(rows)), [r.contender.label for r in rows])
        ax.set_ylim(len(rows) - 0.4, -0.8)
        ax.grid(visible=False, axis="y")
        title = f"{group}: over {reference.contender.label}"
        ax.set_title(title, loc="left", fontweight="bold")
        ax.margins(x=0.08)
        low, high = ax.dataLim.intervalx
        if high > WIDE * low > 0.0:
            ax.set_xscale("log")
            plain_ticks(ax.xaxis)
    axes[-1].set_xlabel("ratio of formation errors")
    return figure


def _episodes(result: CompareResult) -> str:
    """Return the number of episodes per candidate as text."""
    counts = [len(row.episodes) for row in result.rows]
    low, high = min(counts), max(counts)
    return f"{high} episodes" if low == high else f"{low} to {high} episodes"


def _finish(figure: Figure, label: str, title: str) -> None:
    """Label the panels of the first column and draw one common legend."""
    for ax in figure.axes:
        spec = ax.get_subplotspec()
        if spec is not None and spec.is_first_col():
            ax.set_ylabel(label)
    handles, labels = _legend_of(figure.axes)
    figure.legend(
        handles,
        labels,
        title=title,
        loc="outside upper center",
        ncols=3,
        markerscale=1.5,
    )


def _legend_of(axes: Sequence[Axes]) -> tuple[list[Artist], list[str]]:
    """Return handles and labels of the panels, each label once."""
    entries: dict[str, Artist] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    return list(entries.values()), list(entries)
