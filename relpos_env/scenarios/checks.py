"""Validation of scenarios; errors name the argument and the permitted values."""

from __future__ import annotations

import math
import re
from typing import Any, Protocol

from relpos_env.errors import EnvError
from relpos_env.scenarios.layout import LAYOUTS, first_in_the_way, most_cars, track
from relpos_env.scenarios.limits import check_params
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.scenarios.rooms.floor import Area, Floor
from relpos_env.scenarios.rooms.gap import Gap
from relpos_env.scenarios.rooms.obstacle import Obstacle, boxes_of
from relpos_env.scenarios.rooms.overlap import overlap
from relpos_env.world.car import CarParams
from tracking.arrays import F64
from tracking.errors import ConfigError
from tracking.mount import Mount

MOST_CARS = 20
"""[-] Maximum number of cars for which radio messages and trackers are tested."""
LARGEST_ROOM = 100.0
"""[m] Maximum side of a room: the range of the radio."""
MOST_OBSTACLES = 200


class _Checked(Protocol):
    """The fields of a scenario (`relpos_env.scenarios.base`) that are checked together."""

    @property
    def name(self) -> str: ...
    @property
    def room(self) -> tuple[float, float]: ...
    @property
    def ring(self) -> tuple[float, float]: ...
    @property
    def layout(self) -> Any: ...
    @property
    def start_area(self) -> Area | None: ...
    @property
    def obstacles(self) -> tuple[Obstacle, ...]: ...
    @property
    def mounts(self) -> tuple[Mount, ...]: ...
    @property
    def gap(self) -> Gap | None: ...
    @property
    def n_cars(self) -> int: ...
    @property
    def n_cars_range(self) -> tuple[int, int]: ...
    @property
    def randomisation(self) -> Randomisation: ...
    @property
    def car(self) -> CarParams: ...


def check_scenario(s: _Checked) -> None:
    """Check a scenario.

    Raises:
        EnvError: Invalid scenario; names the argument and the permitted values.
    """
    for name in ("car", "imu", "mag", "odometer", "proximity", "radio"):
        check_params(name, getattr(s, name))
    _check_room(s)
    _check_numbers(s)
    if s.gap is not None:
        _check_gap(s.gap, s)
    _check_start(s)


def _check_room(s: _Checked) -> None:
    if not re.fullmatch(r"[\w .+-]{1,80}", s.name):
        raise EnvError(f"name: expected 1 to 80 letters, digits, spaces or .+-_, got {s.name!r}")
    least = 2.0 * math.hypot(s.car.length, s.car.width)
    for side in s.room:
        if not least <= side <= LARGEST_ROOM:
            raise EnvError(f"room: expected {least:.2f} to {LARGEST_ROOM:g} m a side, got {side}")
    for axis, side in zip(s.ring, s.room, strict=True):
        if not 0.0 < axis < 0.5 * side:
            raise EnvError(f"ring: expected above 0 and below {0.5 * side:g} m, got {axis}")
    if not isinstance(s.obstacles, tuple):
        raise EnvError(f"obstacles: expected a tuple of them, got {s.obstacles!r}")
    if len(s.obstacles) > MOST_OBSTACLES:
        raise EnvError(f"obstacles: expected at most {MOST_OBSTACLES}, got {len(s.obstacles)}")
    for k, o in enumerate(s.obstacles):
        if abs(o.x) > 0.5 * s.room[0] or abs(o.y) > 0.5 * s.room[1]:
            raise EnvError(
                f"obstacles[{k}]: expected its centre in the room of {s.room[0]:g} m x "
                f"{s.room[1]:g} m, got x = {o.x:g}, y = {o.y:g}"
            )
    if s.layout not in LAYOUTS:
        raise EnvError(f"layout: expected one of {', '.join(LAYOUTS)}, got {s.layout!r}")
    if s.start_area is not None:
        _check_area(s.start_area)
    _check_mounts(s.mounts)


def _check_mounts(mounts: tuple[Mount, ...]) -> None:
    if len(mounts) > MOST_CARS:
        raise EnvError(f"mounts: expected at most {MOST_CARS}, got {len(mounts)}")
    for k, mount in enumerate(mounts):
        try:
            mount.check(f"mounts[{k}]")
        except ConfigError as error:
            raise EnvError(str(error)) from None


def _check_area(area: Area) -> None:
    if not (all(map(math.isfinite, area)) and area[0] < area[2] and area[1] < area[3]):
        raise EnvError(f"start_area: expected x from, y from, x to, y to, got {area}")


def _check_numbers(s: _Checked) -> None:
    low, high = s.n_cars_range
    if not 2 <= low <= high <= MOST_CARS:
        raise EnvError(f"n_cars_range: expected 2 <= low <= high <= {MOST_CARS}, got {low}, {high}")
    if s.n_cars < 2:
        raise EnvError(f"n_cars: expected at least 2, got {s.n_cars}")
    most = most_that_start(s)
    for name, n in _initial_numbers(s):
        if n > most:
            where = "into" if s.layout == "scattered" else "on the loop of"
            if s.layout == "line":
                where = "on the line of"
            raise EnvError(
                f"{name}: {n} do not fit {where} scenario {s.name!r}, expected at most {most}"
            )
    for name, n in _initial_numbers(s):
        if not low <= n <= high:
            raise EnvError(f"{name}: expected {low} to {high} in scenario {s.name!r}, got {n}")


def _initial_numbers(s: _Checked) -> list[tuple[str, int]]:
    """Return the possible initial numbers of cars with the names of their arguments."""
    drawn = s.randomisation.n_cars or ()
    return [("n_cars", s.n_cars), *(("randomisation.n_cars", n) for n in drawn)]


def most_that_start(s: _Checked) -> int:
    """Return the maximum number of cars that fit at the start."""
    if s.layout != "scattered":
        return most_cars(s.layout, s.ring, s.car)
    floor = Floor(s.room, s.car, boxes_of(s.obstacles))
    return floor.room_for(floor.patches(floor.clearance, s.start_area)[2])


def _check_start(s: _Checked) -> None:
    poses = track(s.layout, s.ring)
    hit = first_in_the_way(poses, s.car, s.room, boxes_of(s.obstacles))
    if hit == -2:
        return
    what = "a wall" if hit == -1 else f"obstacles[{hit}]"
    raise EnvError(
        f"ring: cars would start in {what}; expected a loop (or line) clear of walls and "
        f'obstacles, or layout = "scattered"'
    )


def _check_gap(gap: Gap, s: _Checked) -> None:
    least = s.car.width + 0.1
    if gap.width < least:
        raise EnvError(f"gap.width: expected at least {least:g} m for a car, got {gap.width:g}")
    gap.wall(s.room)
    boxes = boxes_of(s.obstacles)
    for k in (1.0, -1.0):
        # A thin slice of the wall just next to the opening.
        edge = _slice(gap, k * (0.5 * gap.width + 0.005), 0.002)
        if not overlap(edge, boxes).any():
            raise EnvError("gap: expected walls at both its sides, see Scenario.with_gap")
    blocked = overlap(_slice(gap, 0.0, gap.width - 0.002), boxes)[0]
    if blocked.any():
        raise EnvError(f"gap: obstacles[{int(blocked.argmax())}] blocks it")


def _slice(gap: Gap, aside: float, width: float) -> F64:
    """Return a part of the wall's line as a box, (1, 6)."""
    along = gap.direction + 0.5 * math.pi
    return boxes_of(
        (
            Obstacle(
                x=gap.x + aside * math.cos(along),
                y=gap.y + aside * math.sin(along),
                width=max(width, 0.01),
                height=gap.thickness,
                angle=along,
            ),
        )
    )
