"""The report of the protocol experiments: ranging frequency over time, recovery, rates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agents.protocol.experiment import ProtocolResult
from agents.protocol.recovery import EVENTS, MODES
from agents.protocol.timeline import SCRIPT
from agents.reports.page import Page
from agents.reports.style import in_style, new_figure, plain_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER_MS = {"responder-join": 12.3, "responder-leave": 12.3, "initiator-loss": 733.4}
"""[ms] Mean recovery times of Armani and Holz, ICRA 2024."""


PICTURES = ("protocol-timeline.svg", "protocol-recovery.svg", "protocol-rates.svg")


@in_style
def figures(result: ProtocolResult) -> dict[str, Figure]:
    """Return the figures by file name."""
    drawn = _timeline(result), _recovery(result), _rates(result)
    return dict(zip(PICTURES, drawn, strict=True))


def protocol_report(result: ProtocolResult, pictures: dict[str, Figure]) -> str:
    """Return the report as one HTML page, with the figures of `figures`."""
    page = Page(
        "The ranging protocol",
        "Nodes that run the real session in a simulated air: every message, clock and collision.",
    )
    page.heading("Ranging frequency while nodes come and go")
    page.figure(
        pictures["protocol-timeline.svg"],
        "Rounds per second in which every node that is on spoke, mean over ten groups.",
    )
    page.heading("Recovery")
    page.table(RECOVERY_HEADER, recovery_rows(result))
    page.figure(pictures["protocol-recovery.svg"], "All recovery times.")
    page.heading("Rate")
    page.table(RATE_HEADER, rate_rows(result))
    page.figure(pictures["protocol-rates.svg"], "Rounds per second over the size of the group.")
    page.heading("Clocks")
    page.text(
        "Errors of the ranges between node 0 and the node in each slot, 2 m/s, clocks off by so "
        "much in opposite directions; uncorrected is what single-sided ranging would be wrong by."
    )
    page.table(CLOCK_HEADER, clock_rows(result))
    return page.render()


RATE_HEADER = ["radio", "nodes", "rounds per second", "paper", "ranges resolved by all"]
RECOVERY_HEADER = ["event", "mode", "events", "mean [ms]", "p95 [ms]", "paper, mean [ms]"]
CLOCK_HEADER = ["nodes", "slot", "ppm", "bias [cm]", "std, ratio to perfect", "uncorrected [m]"]


def rate_rows(result: ProtocolResult) -> list[list[str]]:
    """Return the rows of the table of rates."""
    return [
        [
            r["phy"],
            str(r["n"]),
            f"{r['rounds_hz']:.2f}",
            "-" if r["paper_hz"] is None else f"{r['paper_hz']:.2f}",
            f"{100 * r['complete']:.1f} %",
        ]
        for r in result.rates
    ]


def recovery_rows(result: ProtocolResult) -> list[list[str]]:
    """Return the rows of the table of recovery times."""
    return [
        [
            r["event"],
            r["mode"],
            str(r["events"]),
            f"{r['mean_ms']:.1f}",
            f"{r['p95_ms']:.1f}",
            f"{PAPER_MS[r['event']]:.1f}",
        ]
        for r in result.recovery
    ]


def clock_rows(result: ProtocolResult) -> list[list[str]]:
    """Return the rows of the table of clock errors."""
    return [
        [
            str(r["n"]),
            str(r["slot"]),
            f"{r['ppm']:.0f}",
            f"{r['bias_cm']:.2f}",
            f"{r['std_ratio']:.3f}",
            f"{r['uncorrected_cm'] / 100:.1f}",
        ]
        for r in result.clock
    ]


def _timeline(result: ProtocolResult) -> Figure:

    figure = new_figure(10, 4.6)
    for ax, line in zip(figure.subplots(2, 1, sharex=True), result.timelines, strict=True):
        ax.step(line.t, line.hz, where="mid", color="C0", lw=1.2)
        for at, what, _, _ in SCRIPT:
            ax.axvline(at, color="0.6", lw=0.8, ls="--")
            if ax.get_subplotspec().is_first_row():
                ax.annotate(what, (at, 1.02), xycoords=("data", "axes fraction"), fontsize=8)
        ax.set(ylabel="rounds per second", ylim=(0, 65))
        ax.text(0.005, 0.06, line.mode, transform=ax.transAxes, weight="bold")
    ax.set(xlabel="t [s]")
    return figure


def _recovery(result: ProtocolResult) -> Figure:

    figure = new_figure(10, 3.0)
    for ax, event in zip(figure.subplots(1, 3), EVENTS, strict=True):
        ms = [1e3 * np.sort(result.times[event, mode]) for mode in MODES]
        for values, mode, colour in zip(ms, MODES, ("C1", "C0"), strict=True):
            share = np.arange(1, len(values) + 1) / len(values)
            ax.step(
                values, share, where="post", color=colour, label=f"{mode}, {len(values)} events"
            )
        ax.axvline(PAPER_MS[event], color="k", ls=":", lw=1, label="paper, mean")
        ax.set(title=event, xlabel="ms", ylim=(0, 1.02))
        if event == "initiator-loss":
            ax.set_xscale("log")
            plain_ticks(ax.xaxis)
    figure.axes[0].set_ylabel("share of events")
    figure.axes[0].legend()
    return figure


def _rates(result: ProtocolResult) -> Figure:

    figure = new_figure(10, 3.6)
    ax, right = figure.subplots(1, 2)
    for phy, colour in (("110k", "C0"), ("6M8", "C1")):
        rows = [r for r in result.rates if r["phy"] == phy]
        n = [r["n"] for r in rows]
        ax.plot(n, [r["model_hz"] for r in rows], color=colour, lw=1, label=f"{phy}, airtime")
        ax.plot(n, [r["rounds_hz"] for r in rows], "o", color=colour, label=f"{phy}, measured")
        paper = [(r["n"], r["paper_hz"]) for r in rows if r["paper_hz"] is not None]
        if paper:
            ax.plot(*zip(*paper, strict=True), "k+", ms=12, label="paper")
    ax.set(ylabel="rounds per second", title="rate")
    right.plot([r["n"] for r in result.cost], [r["us_per_round"] for r in result.cost], "o-")
    right.set(ylabel="us per round, one core", title="cost in simulation, batch")
    for axis in (ax, right):
        axis.set(xscale="log", yscale="log", xlabel="nodes")
        plain_ticks(axis.yaxis)
        axis.set_xticks([r["n"] for r in result.cost], [str(r["n"]) for r in result.cost])
        axis.minorticks_off()
    ax.legend()
    return figure
