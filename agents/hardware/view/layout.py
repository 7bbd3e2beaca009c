"""Layout of the view."""

from __future__ import annotations

from typing import Any

TIME = "time"
"""Name of the timeline [s] since the start of the run."""
HEIGHT = 6.0
"""[m] Initial height of the camera above the origin; the y axis points up on the screen."""


def layout() -> Any:
    """Return the blueprint: plan and notices on the left, time series on the right."""
    import rerun.blueprint as rrb

    plots = [
        rrb.TimeSeriesView(origin="distance", name="distance [m]"),
        rrb.TimeSeriesView(origin="sigma", name="sigma [m]"),
        rrb.TimeSeriesView(origin="nlos", name="probability of no line of sight"),
        rrb.TimeSeriesView(origin="ranges", name="ranges a second of each node"),
        rrb.TimeSeriesView(origin="error", name="error against the truth [m]"),
    ]
    plan = rrb.Vertical(
        rrb.Spatial3DView(
            origin="plan",
            name="relative positions",
            eye_controls=rrb.EyeControls3D(
                position=(0.0, 0.0, HEIGHT), look_target=(0.0, 0.0, 0.0), eye_up=(0.0, 1.0, 0.0)
            ),
        ),
        rrb.TextLogView(origin="notices", name="notices"),
        row_shares=[4, 1],
    )
    return rrb.Blueprint(
        rrb.Horizontal(plan, rrb.Vertical(*plots), column_shares=[3, 2]),
        rrb.TimePanel(timeline=TIME, state="collapsed"),
        collapse_panels=True,
    )
