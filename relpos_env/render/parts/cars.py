"""Cars at their true poses: body, windows, wheels, number, and sign of a power loss."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relpos_env.render import palette
from relpos_env.render.canvas import Canvas
from relpos_env.render.layout import Layout
from relpos_env.render.palette import Colour
from relpos_env.render.parts import car_shape
from relpos_env.render.parts.lettering import Lettering
from relpos_env.render.snapshot import Snapshot
from tracking.arrays import F64

if TYPE_CHECKING:
    import pygame

_ROOM_FOR_NUMBER = 12.0
"""[units] Minimum width of cars with their number on the roof."""


def draw_cars(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw all present cars."""
    cars = np.flatnonzero(snapshot.present).tolist()
    for car in cars:
        colour = palette.car_colour(car)
        if not snapshot.powered[car]:
            colour = palette.mix(palette.NO_POWER, colour, 0.18)
        draw_car(
            canvas,
            layout,
            snapshot.pose[car],
            float(snapshot.steering[car]),
            snapshot.car_size,
            colour,
        )
    for car in cars:
        if not snapshot.powered[car]:
            reach = 0.5 * snapshot.car_size[0] * layout.scale + 5.0 * layout.unit
            at = layout.pixels(snapshot.pose[car, :2]) + np.array([0.75, -0.75]) * reach
            draw_crossed_antenna(canvas, at)


def draw_viewer(canvas: Canvas, layout: Layout, snapshot: Snapshot) -> None:
    """Draw the mark of the viewer, below its car."""
    if snapshot.present[snapshot.viewer]:
        centre = layout.pixels(snapshot.pose[snapshot.viewer, :2])
        radius = max(0.64 * snapshot.car_size[0] * layout.scale, 11.0 * layout.unit)
        draw_halo(canvas, centre, radius, palette.car_colour(snapshot.viewer))


def draw_halo(canvas: Canvas, centre: F64, radius: float, colour: Colour) -> None:
    """Draw the halo of the car whose estimates are shown [pixels]."""
    canvas.circle(centre, radius, palette.mix(colour, palette.FLOOR, 0.86))
    canvas.circle(centre, radius, palette.mix(colour, palette.FLOOR, 0.15), 1.4)


def draw_car(
    canvas: Canvas,
    layout: Layout,
    pose: F64,
    steering: float,
    size: tuple[float, float],
    colour: Colour,
) -> None:
    """Draw a car at x, y, heading [m, m, rad] with the steering angle of its wheels [rad]."""
    x, y, heading = pose.tolist()

    def place(outline: F64) -> F64:
        return layout.shape(outline * size, x, y, heading)

    c, s = np.cos(steering), np.sin(steering)
    turn = np.array([[c, s], [-s, c]])
    tyre = car_shape.TYRE * size
    canvas.polygon(place(car_shape.BODY) + np.array([1.5, 2.5]) * layout.unit, palette.SHADOW, 60)
    for wheel in car_shape.REAR_WHEELS * size:
        canvas.polygon(layout.shape(tyre + wheel, x, y, heading), palette.TYRE)
    for wheel in car_shape.FRONT_WHEELS * size:
        canvas.polygon(layout.shape(tyre @ turn + wheel, x, y, heading), palette.TYRE)
    body = place(car_shape.BODY)
    canvas.polygon(body, colour)
    canvas.lines(body, palette.mix(colour, palette.INK, 0.45), 1.0, closed=True)
    if size[1] * layout.scale < 7.0 * layout.unit:
        canvas.polygon(place(car_shape.WINDSCREEN), palette.GLASS)
        return
    canvas.polygon(place(car_shape.ROOF), palette.mix(colour, palette.INK, 0.14))
    canvas.polygon(place(car_shape.WINDSCREEN), palette.GLASS)
    canvas.polygon(place(car_shape.REAR_WINDOW), palette.GLASS)
    for lamp in car_shape.LAMPS:
        canvas.polygon(place(lamp), palette.LIGHT)


def draw_crossed_antenna(canvas: Canvas, at: F64) -> None:
    """Draw the sign of a tracker without power, about 17 units wide, at a point [pixels]."""
    u = canvas.unit
    canvas.circle(at, 8.5 * u, palette.FLOOR)
    canvas.circle(at, 8.5 * u, palette.CROSSED, 1.3)
    for points in (
        [(0.0, 5.0), (0.0, -1.0)],
        [(-3.6, -4.6), (0.0, -0.6), (3.6, -4.6)],
        [(-2.2, 5.0), (2.2, 5.0)],
    ):
        canvas.lines(at + np.array(points) * u, palette.INK, 1.3)
    canvas.lines(at + np.array([(-5.8, 5.8), (5.8, -5.8)]) * u, palette.CROSSED, 1.5)


def write_numbers(
    picture: pygame.Surface, layout: Layout, snapshot: Snapshot, letters: Lettering
) -> None:
    """Write the number of every car on its roof, or above a car whose roof is too small."""
    width = snapshot.car_size[1] * layout.scale
    inside = width >= _ROOM_FOR_NUMBER * layout.unit
    size = min(0.62 * width, 18.0 * layout.unit) if inside else 10.0 * layout.unit
    for car in np.flatnonzero(snapshot.present).tolist():
        x, y, heading = snapshot.pose[car].tolist()
        if inside:
            back = -0.1 * snapshot.car_size[0]
            point = np.array([x + back * np.cos(heading), y + back * np.sin(heading)])
            at, colour = layout.pixels(point), palette.FLOOR
        else:
            reach = 0.5 * snapshot.car_size[0] * layout.scale + 6.0 * layout.unit
            at = layout.pixels(np.array([x, y])) - np.array([0.0, reach])
            colour = palette.mix(palette.car_colour(car), palette.INK, 0.3)
        letters.write(
            picture,
            str(car),
            (at[0], at[1]),
            size,
            colour,
            bold=True,
            anchor=(0.5, 0.5),
            rim=None if inside else palette.FLOOR,
        )
