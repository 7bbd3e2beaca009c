"""The picture of `relpos bench tracker`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.bench.tracker.growth import Growth

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE = "tracker_cost.png"


def cost_figure(result: Growth) -> Figure:
    """Time of a message over the size of the group, ours and the peers'."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator

    figure = Figure(figsize=(10, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(result.n, result.ours, "o-", color="tab:blue", label="joint")
    for (name, values), colour in zip(
        result.peers.items(), ("tab:orange", "tab:green"), strict=False
    ):
        known = [(n, v) for n, v in zip(result.n, values, strict=True) if v is not None]
        left.plot(*zip(*known, strict=True), "s--", ms=4, lw=1, color=colour, label=name)
    left.set(title="a message, n/2 ranges", ylabel="us, one core")
    left.legend(fontsize=8)
    per_range = [cost / m for cost, m in zip(result.ours, result.ranges, strict=True)]
    right.plot(result.n, per_range, "o-", color="tab:blue")
    right.set(title="joint, per range", ylabel="us, one core")
    for axis in (left, right):
        axis.set(xscale="log", yscale="log", xlabel="nodes")
        axis.set_xticks(result.n, [str(n) for n in result.n])
        axis.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    right.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    return figure
