"""The report of a demonstration: the animation, errors by filter, formation error over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agents.reports.animation import animation_markup
from agents.reports.page import Page, metres
from agents.reports.style import in_style, new_figure
from agents.simulation.demo import SETTLE, DemoResult
from tracking.filters import DESCRIPTIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def demo_report(result: DemoResult, missing: Sequence[str] = ()) -> str:
    """Return the report as one HTML page.

    Args:
        result: Result of the demonstration.
        missing: Filters whose results are not available yet.
    """
    page = Page(
        "Three cars, one formation, no anchors"
        if len(result.frames["pos"][0]) == 3
        else "One formation, no anchors",
        f"Task {result.task}, scenario {result.scenario}, driven by {result.driver}, "
        f"seed {result.seed}, "
        f"{result.seconds:.0f} s{' until it was done' if result.done else ''}: the cars know "
        "each other only through simulated UWB ranges, inertial sensors and the tracker.",
    )
    page.raw(animation_markup(result.frames))
    page.heading("Formation error")
    page.table(
        ["information of the cars", f"mean after {SETTLE:.0f} s [m]"],
        [
            ["what the tracker estimates", metres(result.formation_error)],
            ["the truth", metres(result.formation_error_truth)],
            ["nothing, only the operator's command", metres(result.formation_error_blind)],
        ],
    )
    page.text(
        f"{100 * result.nlos_share:.0f} % of the ranges had an obstacle in their way; the "
        f"cars touched something {result.collisions} times."
    )
    page.figure(_over_time(result), "Errors over time, the tracker in the loop.")
    page.heading("The same drive, tracked by other filters")
    rows = [
        [
            r.filter,
            DESCRIPTIONS.get(r.filter, ""),
            *(metres(r.summary[k]) for k in ("rmse", "rmse_yaw", "rmse_shape")),
        ]
        for r in result.tracks
    ]
    page.table(["filter", "which is", "rmse [m]", "rmse_yaw [m]", "rmse_shape [m]"], rows)
    if missing:
        page.text(f"Others are being compiled, once; this table will have {', '.join(missing)}.")
    return page.render()


@in_style
def _over_time(result: DemoResult) -> Figure:

    figure = new_figure(11, 3.2)
    ax = figure.subplots()
    f = result.frames
    tracking = [np.nan if v is None else v for v in f["tracking"]]
    ax.plot(f["t"], tracking, color="C0", label="tracking error")
    ax.plot(f["t"], f["formation"], color="C2", label="formation error")
    ax.set(xlabel="t [s]", ylabel="error [m]", ylim=(0, None))
    ax.legend()
    return figure
