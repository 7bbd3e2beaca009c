"""Floor plans: walls from a table of their end points."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from relpos_env.errors import EnvError
from relpos_env.scenarios.rooms.obstacle import Obstacle

COLUMNS = ("x1", "y1", "x2", "y2", "thickness")
"""[m] End points of the centre line of a wall, from the centre of the room, and thickness."""


def read_floor_plan(path: str | Path) -> tuple[Obstacle, ...]:
    """Read walls from a CSV file with one wall per line.

    Args:
        path: CSV file whose first line is `COLUMNS`.

    Returns:
        Walls, as boxes that are not movable.

    Raises:
        EnvError: No such file, or an invalid line; names the file and the line.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        raise EnvError(f"floor_plan: expected a file, got {path.name!r}")
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = list(csv.reader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise EnvError(f"floor_plan: cannot read {path.name!r}: {error}") from error
    if not rows or tuple(name.strip() for name in rows[0]) != COLUMNS:
        raise EnvError(f"{path.name}:1: expected the columns {','.join(COLUMNS)}")
    walls = []
    for k, row in enumerate(rows[1:], start=2):
        if row:
            try:
                walls.append(_wall(row))
            except EnvError as error:
                raise EnvError(f"{path.name}:{k}: {error}") from error
    return tuple(walls)


def _wall(row: list[str]) -> Obstacle:
    """Return the wall of a line of the table.

    Raises:
        EnvError: The line is invalid.
    """
    try:
        x1, y1, x2, y2, thickness = map(float, row)
    except ValueError as error:
        raise EnvError(f"expected five numbers, got {','.join(row)!r}") from error
    length = math.hypot(x2 - x1, y2 - y1)
    angle = math.atan2(y2 - y1, x2 - x1)
    x, y = 0.5 * (x1 + x2), 0.5 * (y1 + y2)
    return Obstacle(x=x, y=y, width=length, height=thickness, angle=angle)
