"""The figure of `relpos bench env`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from agents.reports.style import in_style, new_figure, plain_ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENV_PICTURE = "env_cost.svg"
LONG = 5.0
"""[-] Times that span more than this factor are drawn on a logarithmic axis."""


@in_style
def env_figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Draw the time of an env-step over environments, over cars, and of its parts.

    Args:
        rows: Records of `agents.bench.env.bench_env`.
    """
    curves = [r for r in rows if r["what"].startswith("growth")]
    first = curves[0]["what"]
    figure = new_figure(12, 3.6)
    envs, cars, parts = figure.subplots(1, 3, width_ratios=(1, 1, 1.2))
    _curve(envs, [r for r in curves if r["what"] == first], "envs", "environments, 3 cars")
    over_cars = [r for r in curves if r["what"] != first]
    _curve(cars, over_cars, "cars", f"cars, {over_cars[0]['envs']} environments")
    _bars(parts, rows)
    return figure


def _curve(axes: Axes, rows: Sequence[dict[str, Any]], key: str, label: str) -> None:
    x, y = [r[key] for r in rows], [r["us_per_env_step"] for r in rows]
    axes.plot(x, y, "o-", color="C0")
    axes.set(xscale="log", xlabel=label, ylabel="us per env-step, one core")
    axes.set_xticks(x, [str(n) for n in x], fontsize=7)
    if max(y) > LONG * min(y):
        axes.set_yscale("log")
        plain_ticks(axes.yaxis)
    else:
        axes.set_ylim(0.0, 1.1 * max(y))
    axes.minorticks_off()


def _bars(axes: Axes, rows: Sequence[dict[str, Any]]) -> None:
    """Draw the time of the parts of the first batch."""
    what = next(r["what"] for r in rows if "solver_share" in r)
    parts = [r for r in rows if r["what"].startswith(f"{what}: ")]
    names = [r["what"].removeprefix(f"{what}: ") for r in parts]
    axes.barh(names, [r["us_per_env_step"] for r in parts], color="C0")
    axes.invert_yaxis()
    axes.set(title=what, xlabel="us per env-step, one core")
    axes.grid(visible=False, axis="y")
