"""Figures of an evaluation: error over time, consistency, error over seeds, and over nodes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from agents.evaluation.evaluate import CaseResult, EvaluateResult
from agents.evaluation.over_time import NIS_EDGES
from agents.evaluation.run import SKIP
from agents.reports.style import BAND, COLOURS, in_style, new_figure, plain_ticks
from tracking.metrics.consistency import chi_square_band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LIKELY = 0.95
"""[-] Probability of the chi-square band."""


@in_style
def figures(result: EvaluateResult) -> dict[str, tuple[str, Figure, str]]:
    """Return title, figure and caption by file name."""
    has_paper = any(c.paper is not None for c in result.cases)
    paper = " Dotted: the paper's error of that filter." if has_paper else ""
    drawn = {
        "evaluate-time.svg": (
            "Error over time",
            _over_time(result),
            "Position error after one constant yaw, mean over the pairs: median over the seeds, "
            f"and the band from 10 % to 90 % of them.{paper}",
        ),
        "evaluate-seeds.svg": (
            "Error over seeds",
            _over_seeds(result),
            "rmse_yaw of every run with the median as a bar; lost runs as crosses. Dashed: the "
            "expected error of an efficient estimator, median over the seeds.",
        ),
        "evaluate-nees.svg": (
            "Consistency: position errors",
            _nees(result),
            "NEES over time, mean over pairs and seeds; 1 is right, above it the filter is too "
            "sure. The first seconds may lie beyond the frame. Grey: 95 % of the chi-square "
            "distribution that alike and independent errors of the nodes would have.",
        ),
        "evaluate-nis.svg": (
            "Consistency: ranges",
            _nis(result),
            "NIS of the ranges of all seeds and the share of those above 10; black: the chi-square "
            "distribution of one degree of freedom that it should have.",
        ),
    }
    if result.suite.name == "scaling":
        drawn["evaluate-scaling.svg"] = (
            "Cost and error over the size of the group",
            _scaling(result),
            "Left: time of the tracker for a ranging round. Right: errors, medians over the "
            "seeds; dashed: the rmse expected of an efficient estimator.",
        )
    return drawn


def _panels(
    result: EvaluateResult, width: float, height: float
) -> tuple[Figure, Iterator[tuple[Axes, list[CaseResult]]]]:
    """Return a figure with one panel per case."""
    cases = result.by_case
    columns = min(len(cases), 3)
    lines = -(-len(cases) // columns)
    figure = new_figure(width * columns, height * lines + 0.4)
    axes = figure.subplots(lines, columns, squeeze=False, sharey=True).ravel()
    for ax in axes[len(cases) :]:
        ax.remove()
    for ax, (case, _) in zip(axes, cases, strict=False):
        ax.set_title(case.name)
    return figure, iter([(ax, rows) for ax, (_, rows) in zip(axes, cases, strict=False)])


def _over_time(result: EvaluateResult) -> Figure:
    figure, panels = _panels(result, 3.7, 2.9)
    for ax, rows in panels:
        for colour, c in zip(COLOURS, rows, strict=False):
            t = c.runs[0].over_time.t
            error = np.array([r.over_time.error for r in c.runs])
            low, middle, high = _quantiles(error, (0.1, 0.5, 0.9))
            ax.fill_between(t, low, high, color=colour, alpha=BAND, lw=0)
            ax.plot(t, middle, color=colour, lw=1.3, label=c.filter)
            if c.paper is not None:
                ax.axhline(c.paper, color=colour, ls=":", lw=1.2)
        ax.set(yscale="log", xlim=(0, result.seconds), xlabel="t [s]")
        plain_ticks(ax.yaxis)
    _finish(figure, "error [m]", f"median, 10 to 90 % of {result.seeds} seeds")
    return figure


def _quantiles(values: np.ndarray, at: tuple[float, ...]) -> np.ndarray:
    """Return quantiles over the runs, NaN in bins without data, (quantile, bin)."""
    out = np.full((len(at), values.shape[1]), np.nan)
    some = np.isfinite(values).any(axis=0)
    out[:, some] = np.nanquantile(values[:, some], at, axis=0)
    return out


def _over_seeds(result: EvaluateResult) -> Figure:
    figure, panels = _panels(result, 3.4, 2.7)
    rng = np.random.default_rng(0)
    for ax, rows in panels:
        for k, (colour, c) in enumerate(zip(COLOURS, rows, strict=False)):
            runs = [r for r in c.runs if r.rmse_yaw is not None]
            x = k + rng.uniform(-0.22, 0.22, len(runs))
            errors = np.array([_or_nan(r.rmse_yaw) for r in runs])
            for lost, marker in ((False, "."), (True, "x")):
                chosen = [n for n, r in enumerate(runs) if r.lost == lost]
                ax.plot(x[chosen], errors[chosen], marker, color=colour, ms=5, alpha=0.6, mew=1)
            if runs:
                ax.hlines(np.median(errors), k - 0.34, k + 0.34, color=colour, lw=2)
        bound = rows[0].median("bound_yaw")
        if bound is not None:
            ax.axhline(bound, color="k", ls="--", lw=1)
        ax.set(yscale="log", xlim=(-0.6, len(rows) - 0.4))
        ax.set_xticks(range(len(rows)), [c.filter for c in rows], fontsize=9, rotation=20)
        plain_ticks(ax.yaxis)
    _finish(figure, "rmse_yaw [m]")
    figure.suptitle(f"{result.seeds} seeds, bar: their median", fontsize=9)
    return figure


def _nees(result: EvaluateResult) -> Figure:

    figure, panels = _panels(result, 3.7, 2.9)
    highest = 3.0
    for ax, rows in panels:
        # For independent, identically distributed errors of nodes, the mean over all pairs is
        # that of n - 1 independent positions.
        dimensions = 3 if rows[0].case.scenario.name.startswith("human") else 2
        free = dimensions * (rows[0].runs[0].nodes - 1) * result.seeds
        low, high = chi_square_band(free, 1, LIKELY)
        ax.axhspan(low, high, color="0.8")
        top = 2.0
        for colour, c in zip(COLOURS, rows, strict=False):
            nees = np.array([r.over_time.nees for r in c.runs])
            some = np.isfinite(nees).any(axis=0)
            t = c.runs[0].over_time.t[some]
            mean = np.nanmean(nees[:, some], axis=0)
            ax.plot(t, mean, color=colour, lw=1.2, label=c.filter)
            top = max(top, float(mean[t > SKIP].max(initial=0.0)))
        # Large values before the scored time would compress the axis.
        highest = max(highest, 1.5 * top)
        ax.set(yscale="log", xlim=(0, result.seconds), xlabel="t [s]", ylim=(0.2, highest))
        plain_ticks(ax.yaxis, (1.0, 3.0))
    _finish(figure, "NEES", f"mean of {result.seeds} seeds")
    return figure


def _nis(result: EvaluateResult) -> Figure:
    from scipy.stats import chi2

    figure, panels = _panels(result, 3.7, 2.7)
    right = np.diff(chi2.cdf(NIS_EDGES, 1)) / np.diff(NIS_EDGES)
    for ax, rows in panels:
        for colour, c in zip(COLOURS, rows, strict=False):
            counts = np.sum([r.over_time.nis_counts for r in c.runs], axis=0)
            total = max(int(counts.sum()), 1)
            density = counts[:-1] / total / np.diff(NIS_EDGES)
            label = f"{c.filter}, {100 * counts[-1] / total:.1f} % above"
            ax.stairs(density, NIS_EDGES, color=colour, lw=1.3, label=label)
        ax.stairs(right, NIS_EDGES, color="k", lw=1)
        ax.set(yscale="log", xlim=(0, NIS_EDGES[-1]), ylim=(2e-4, 10), xlabel="NIS")
        plain_ticks(ax.yaxis, (1.0,))
        ax.legend()
    _finish(figure, "density")
    figure.suptitle(f"ranges of {result.seeds} seeds", fontsize=9)
    return figure


def _scaling(result: EvaluateResult) -> Figure:

    figure = new_figure(10, 3.6)
    cost, errors = figure.subplots(1, 2)
    nodes = [c.runs[0].nodes for c in result.cases if c.filter == result.filters[0]]
    for colour, name in zip(COLOURS, result.filters, strict=False):
        mine = [c for c in result.cases if c.filter == name]
        cost.plot(nodes, [c.median("us_per_round") for c in mine], "o-", color=colour, label=name)
        for figure_name, style in (("rmse_yaw", "o-"), ("rmse_shape", "s:")):
            values = [_or_nan(c.median(figure_name)) for c in mine]
            label = f"{name}, {figure_name}"
            errors.plot(nodes, values, style, color=colour, ms=4, label=label)
    bound = [_or_nan(c.median("bound")) for c in result.cases if c.filter == result.filters[0]]
    errors.plot(nodes, bound, "k--", lw=1, label="bound")
    cost.set(ylabel="us per round")
    errors.set(ylabel="error [m]")
    for ax in (cost, errors):
        ax.set(xscale="log", yscale="log", xlabel="nodes")
        plain_ticks(ax.yaxis)
        ax.set_xticks(nodes, [str(n) for n in nodes])
        ax.minorticks_off()
    cost.legend()
    errors.legend(ncols=2)
    return figure


def _finish(figure: Figure, label: str, legend: str = "") -> None:
    """Label the panels of the first column and draw one common legend with the title `legend`."""
    for ax in figure.axes:
        spec = ax.get_subplotspec()
        if spec is not None and spec.is_first_col():
            ax.set_ylabel(label)
    if legend:
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, title=legend, loc="outside upper center", ncols=len(labels))


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value
