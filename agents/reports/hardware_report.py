"""The report of emulated drives: trajectories, and errors compared with the simulator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.hardware.demo import HardwareDemoResult, error_ratio
from agents.reports.page import Page, metres
from agents.reports.style import COLOURS, in_style, new_figure
from agents.simulation.demo import SETTLE
from relpos_env.timing import DECISION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEADER = ("seed", "through the bridge [m]", "simulator [m]", "ratio", "collisions", "late p99 [ms]")


def demo_rows(results: Sequence[HardwareDemoResult]) -> list[list[str]]:
    """Return one row per drive, as `HEADER`, and the mean of the drives with both errors."""
    rows = []
    for result in results:
        s = result.summary
        rows.append(
            [
                str(s["seed"]),
                metres(s["formation_error"]),
                metres(s["simulated_error"]),
                "-" if s["ratio"] is None else f"{s['ratio']:.2f}",
                f"{s['collisions']} / {s['simulated_collisions']}",
                "-" if s["lag_p99_ms"] is None else f"{s['lag_p99_ms']:.1f}",
            ]
        )
    if len(results) > 1:
        keys = ("formation_error", "simulated_error")
        both = [[r.summary[key] for key in keys] for r in results]
        both = [row for row in both if None not in row]
        ours, theirs = np.mean(both, axis=0) if both else (None, None)
        found = error_ratio(results)
        ratio = "-" if found is None else f"{found.value:.2f}"
        ends = "" if found is None or found.ends is None else "{:.2f} to {:.2f}".format(*found.ends)
        rows.append(["mean", metres(ours), metres(theirs), ratio, "", ""])
        rows.append(["95 %", "", "", ends, "", ""])
    return rows


def ratio_record(results: Sequence[HardwareDemoResult]) -> dict[str, Any]:
    """Return the ratio of the means as a record."""
    found = error_ratio(results)
    return {
        "result": "hardware-demo-ratio",
        "drives": len(results),
        "ratio": None if found is None else found.value,
        "ratio_ci95": None if found is None else found.ends,
    }


def hardware_report(results: Sequence[HardwareDemoResult], room: tuple[float, float]) -> str:
    """Return the report as one HTML page."""
    first = results[0]
    way = "in memory, under a virtual clock" if first.virtual else "over pseudo terminals"
    page = Page(
        "Emulated cars, real bytes",
        f"Driven by {first.drive.driver}: sensor bytes {way}, decoders, clocks, "
        "trackers, observations, safety gate, command bytes; and the same in the simulator.",
    )
    page.heading("Formation error")
    page.text(
        f"By the truth, from {SETTLE:.0f} s after the cars had found each other. Collisions: "
        "through the bridge / in the simulator. Late: from the last byte that a decision rests on "
        "to the bytes of its command."
    )
    page.table(HEADER, demo_rows(results))
    for result in results:
        text = f"Seed {result.seed}. Dots: where cars began. Grey: obstacles at that time."
        page.figure(drive_figure(result, room), text)
    return page.render()


@in_style
def drive_figure(result: HardwareDemoResult, room: tuple[float, float]) -> Figure:
    """Draw the trajectories of the cars, and errors over time."""
    figure = new_figure(11, 3.8)
    ways, errors = figure.subplots(1, 2, width_ratios=(1, 2.2))
    _ways(ways, result, room)
    errors.plot(result.t, result.error, color="C0", label="through the bridge")
    t = DECISION * np.arange(1, len(result.simulated) + 1)
    errors.plot(t, result.simulated, color="0.5", label="simulator")
    errors.plot(result.t, result.drive.error, color="C2", lw=0.8, label="estimated by the cars")
    errors.set(xlabel="t [s]", ylabel="formation error [m]", ylim=(0, None))
    errors.legend()
    return figure


def _ways(axes: Axes, result: HardwareDemoResult, room: tuple[float, float]) -> None:
    truth, group = result.log.truth, result.log.constellation
    for k in range(group.n_nodes):
        mine = (truth.node == k) & truth.valid
        x, y = truth.pos_w[mine, 0], truth.pos_w[mine, 1]
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(x, y, color=colour, lw=0.7, label=f"car {group.ids[k]}")
        axes.plot(x[:1], y[:1], "o", color=colour)
    width, depth = room
    x, y = 0.5 * width, 0.5 * depth
    axes.plot([-x, x, x, -x, -x], [-y, -y, y, y, -y], color="black")
    for x, y, *half, c, s in result.boxes[result.boxes[:, 2] > 0.0].tolist():
        corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * half
        axes.fill(x + corners @ (c, -s), y + corners @ (s, c), color="0.6", zorder=0)
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
