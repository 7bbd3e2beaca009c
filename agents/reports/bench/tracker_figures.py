"""The figure of `relpos bench tracker`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.bench.tracker.growth import Growth
from agents.reports.style import in_style, new_figure, plain_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE = "tracker_cost.svg"


@in_style
def cost_figure(result: Growth) -> Figure:
    """Draw the time per message over the number of nodes, of this tracker and of peers."""
    figure = new_figure(10, 3.8)
    left, right = figure.subplots(1, 2)
    left.plot(result.n, result.ours, "o-", color="C0", label="joint")
    for (name, values), colour in zip(result.peers.items(), ("C1", "C2"), strict=False):
        known = [(n, v) for n, v in zip(result.n, values, strict=True) if v is not None]
        left.plot(*zip(*known, strict=True), "s--", ms=4, lw=1, color=colour, label=name)
    left.set(title="a message, n/2 ranges", ylabel="us, one core")
    left.legend()
    per_range = [cost / m for cost, m in zip(result.ours, result.ranges, strict=True)]
    right.plot(result.n, per_range, "o-", color="C0")
    right.set(title="joint, per range", ylabel="us, one core")
    for axis in (left, right):
        axis.set(xscale="log", yscale="log", xlabel="nodes")
        axis.set_xticks(result.n, [str(n) for n in result.n])
        axis.minorticks_off()
    plain_ticks(left.yaxis, (1.0,))
    plain_ticks(right.yaxis)
    return figure
