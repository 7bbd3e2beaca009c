"""Targets of the cars: positions relative to the viewer, and the plan in the room."""

from __future__ import annotations

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import DASHED, Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.palette import Colour
from relpos_env.render.snapshot import Snapshot
from tracking.arrays import F64

PLACE_RADIUS = 0.45
"""[car lengths] Radius of a target's circle, which a car at the target extends beyond."""


def draw_formation(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw circles at the relative targets, joined by a pale outline of the formation."""
    viewer = snapshot.viewer
    has_target = np.asarray(snapshot.has_target) & snapshot.present
    has_target[viewer] = False
    cars = np.flatnonzero(has_target)
    if not snapshot.present[viewer] or len(cars) == 0:
        return
    places = snapshot.pose[viewer, :2] + snapshot.target[cars]
    corners = np.vstack([snapshot.pose[viewer, :2], places])
    offset = corners - corners.mean(axis=0)
    order = np.argsort(np.arctan2(offset[:, 1], offset[:, 0]), kind="stable")
    outline = layout.pixels(corners[order])
    canvas.lines(outline, palette.TARGET, 4.0, closed=True)
    radius = PLACE_RADIUS * snapshot.car_size[0] * layout.scale
    for car, place in zip(cars.tolist(), layout.pixels(places), strict=True):
        draw_place(canvas, place, radius, palette.car_colour(car))


def draw_place(canvas: Canvas, centre: F64, radius: float, colour: Colour) -> None:
    """Draw a relative target: a hollow circle [pixels]."""
    radius = max(radius, 4.5 * canvas.unit)
    canvas.circle(centre, radius, colour, 1.6)


def draw_plan(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw the path of the plan as a dashed line, and the goals of the cars as crosses."""
    if snapshot.path is not None and len(snapshot.path) > 1:
        canvas.lines(layout.pixels(snapshot.path), palette.PLAN, 1.4, DASHED)
    if snapshot.goal is None:
        return
    for car, place in enumerate(layout.pixels(snapshot.goal)):
        if snapshot.present[car]:
            draw_cross(canvas, place, 5.0 * layout.unit, palette.car_colour(car))


def draw_cross(canvas: Canvas, centre: F64, half: float, colour: Colour) -> None:
    """Draw a goal of the plan: a diagonal cross [pixels]."""
    for turn in (1.0, -1.0):
        arm = half * np.array([1.0, turn])
        canvas.lines(np.array([centre - arm, centre + arm]), colour, 1.8)
