"""Positions of an external tracker, one JSON object per line; see docs/how-to/positions.md.

    {"time": 81250000, "i": 1, "j": 2, "pos": [1.2, -0.4, 0.0], "vel": [0.1, 0.0, 0.0], "cov": 0.02}
    {"time": 81250000, "node": 1, "pos": [3.1, 0.2, 0.1], "q": [1, 0, 0, 0], "speed": 0.8}

World frame: x east, y magnetic north, z up; metres, seconds, radians; `time` counts microseconds.
Null, or a NaN among the numbers, means not measured. Unknown keys and objects without nodes are
ignored. There is no check sum: impossible values are refused here, and positions that jump in
`hardware_bridge.plausibility`.
"""

from __future__ import annotations

import math
from typing import Any

from hardware_bridge.decoders.lines import Lines
from hardware_bridge.decoders.plausible import Damaged
from hardware_bridge.decoders.uwb_core import parse
from hardware_bridge.readings import (
    MICROSECONDS_64,
    UNNAMED,
    PairReading,
    PoseReading,
    Reading,
    Source,
    Vector,
)
from tracking.estimate import Status

MOST_LINE = 2048
"""[bytes] Longest line; one with a full covariance of 36 numbers has 1200."""
MOST_PLACE = 1e4
"""[m] Largest distance from the world's origin, and between nodes."""
MOST_SPEED = 100.0
"""[m/s] Largest speed."""
MOST_VARIANCE = 1e6
"""[m2] Largest variance."""
MOST_NAME = 32
"""[-] Largest number of characters of a node's name."""
UNIT = 0.05
"""[-] Largest deviation of the norm of a quaternion from 1."""


def read_line(line: str) -> list[Reading]:
    """Return the readings of a line.

    Raises:
        Damaged: The line is not an object, or has an impossible value.
    """
    first, last = line.find("{"), line.rfind("{")
    if first < 0:
        return []
    try:
        said = parse(line[first:])
    except Damaged:
        # The end of the previous line may be lost, then the object begins at the last brace.
        if first == last:
            raise
        said = parse(line[last:])
    if "i" in said and "j" in said:
        return pair_of(said)
    return pose_of(said) if "node" in said else []


def pair_of(said: dict[str, Any]) -> list[Reading]:
    """Return the reading of an object about a pair."""
    i, j = name_of(said["i"]), name_of(said["j"])
    if i == j:
        raise Damaged
    source, nlos = source_of(said), number(said.get("nlos"), 1.0)
    status = status_of(said.get("status"))
    if nlos is not None and nlos < 0.0:
        raise Damaged
    pos, vel, cov = motion_of(said)
    if pos is None:
        return []
    return [PairReading(source, i, j, pos, vel, cov, status, nlos or 0.0)]


def pose_of(said: dict[str, Any]) -> list[Reading]:
    """Return the reading of an object about a node."""
    node, source = name_of(said["node"]), source_of(said)
    pos, vel, cov = motion_of(said)
    q, speed = attitude_of(said), number(said.get("speed"), MOST_SPEED)
    if pos is None and q is None and speed is None:
        return []
    return [PoseReading(source, node, pos, vel, cov, q, speed)]


Motion = tuple[Vector | None, Vector | None, tuple[float, ...] | None]


def motion_of(said: dict[str, Any]) -> Motion:
    """Return position, velocity and covariance, None where not measured."""
    pos = vector(said.get("pos"), MOST_PLACE)
    vel = vector(said.get("vel"), MOST_SPEED)
    n = len(said["pos"]) if pos is not None else 3
    cov = covariance(said.get("cov"), n)
    if pos is None:
        return None, None, None
    if cov is not None and vel is None:
        cov = tuple(cov[r * 6 + c] for r in range(3) for c in range(3)) if len(cov) == 36 else cov
    return pos, vel, cov


def source_of(said: dict[str, Any]) -> Source:
    """Return the source with the time of the line."""
    time = said.get("time")
    if time is None:
        return UNNAMED
    if type(time) is float and math.isfinite(time):
        time = int(time)
    if type(time) is not int or not 0 <= time < MICROSECONDS_64.modulus:
        raise Damaged
    return Source(ticks=time, clock=MICROSECONDS_64)


def name_of(value: Any) -> str:
    """Return the name of a node given as a number or a text."""
    if type(value) is int and 0 <= value < 10**9:
        return str(value)
    if type(value) is str and 0 < len(value) <= MOST_NAME and value.isprintable():
        return value.upper()
    raise Damaged


def status_of(value: Any) -> Status:
    """Return a status given by its name or number."""
    if value is None:
        return Status.OK
    try:
        return Status[value.upper()] if type(value) is str else Status(whole(value))
    except (KeyError, ValueError):
        raise Damaged from None


def whole(value: Any) -> int:
    """Return the value if it is an integer and not a bool."""
    if type(value) is not int:
        raise Damaged
    return value


def number(value: Any, most: float) -> float | None:
    """Return the number, or None if it was not measured."""
    if value is None or (type(value) is float and math.isnan(value)):
        return None
    if type(value) not in (int, float) or not -most <= value <= most:
        raise Damaged
    return float(value)


def vector(value: Any, most: float) -> Vector | None:
    """Return two or three numbers, with z = 0 if there are two; None if one was not measured."""
    if value is None:
        return None
    if type(value) is not list or len(value) not in (2, 3):
        raise Damaged
    numbers = [number(each, most) for each in value]
    if None in numbers:
        return None
    x, y, z = (*numbers, 0.0)[:3]
    return x, y, z  # type: ignore[return-value]


def attitude_of(said: dict[str, Any]) -> tuple[float, float, float, float] | None:
    """Return the orientation, from a quaternion or from the yaw from east, counter-clockwise."""
    value, yaw = said.get("q"), number(said.get("yaw"), 1e6)
    if value is None:
        return None if yaw is None else (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
    if type(value) is not list or len(value) != 4:
        raise Damaged
    numbers = [number(each, 1.0 + UNIT) for each in value]
    if None in numbers:
        return None
    w, x, y, z = (each or 0.0 for each in numbers)
    length = math.hypot(w, x, y, z)
    if abs(length - 1.0) > UNIT:
        raise Damaged
    return w / length, x / length, y / length, z / length


def covariance(value: Any, n: int) -> tuple[float, ...] | None:
    """Return the covariance of n axes or of position and velocity from a std, or n or 2n rows.

    Returns:
        3 x 3 or 6 x 6; if n is 2, the variance of z is the larger one of x and y.
    """
    if value is None:
        return None
    if type(value) is not list:
        std = number(value, math.sqrt(MOST_VARIANCE))
        if std is not None and std <= 0.0:
            raise Damaged
        if std is None:
            return None
        return tuple(std * std if r == c else 0.0 for r in range(3) for c in range(3))
    size = len(value)
    if size not in (n, 2 * n) or any(type(row) is not list or len(row) != size for row in value):
        raise Damaged
    rows = [[number(each, MOST_VARIANCE) for each in row] for row in value]
    if any(each is None for row in rows for each in row):
        return None
    return spread(rows, n)  # type: ignore[arg-type]


def spread(rows: list[list[float]], n: int) -> tuple[float, ...]:
    """Expand a covariance of n axes to three axes."""
    check_definite(rows)
    blocks = len(rows) // n
    full = [[0.0] * (3 * blocks) for _ in range(3 * blocks)]
    for r, row in enumerate(rows):
        for c, each in enumerate(row):
            # Symmetrise: printed numbers are rounded.
            full[r // n * 3 + r % n][c // n * 3 + c % n] = 0.5 * (each + rows[c][r])
    if n == 2:
        for b in range(blocks):
            full[3 * b + 2][3 * b + 2] = max(full[3 * b][3 * b], full[3 * b + 1][3 * b + 1])
    return tuple(each for row in full for each in row)


def check_definite(rows: list[list[float]]) -> None:
    """Raise `Damaged` if not symmetric and positive definite, by Cholesky decomposition."""
    size = len(rows)
    low = [[0.0] * size for _ in range(size)]
    largest = max(abs(each) for row in rows for each in row)
    for r in range(size):
        for c in range(r + 1):
            if abs(rows[r][c] - rows[c][r]) > 1e-6 * largest:
                raise Damaged
            rest = 0.5 * (rows[r][c] + rows[c][r])
            rest -= sum(low[r][k] * low[c][k] for k in range(c))
            if r != c:
                low[r][c] = rest / low[c][c]
            elif rest > 0.0:
                low[r][r] = math.sqrt(rest)
            else:
                raise Damaged


def positions_decoder() -> Lines:
    """Return a decoder for one port."""
    return Lines(read_line, MOST_LINE)
