"""Content of one image, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from relpos_env.errors import EnvError
from tracking.arrays import F64, I64, Bool

LINE_OF_SIGHT, NO_LINE_OF_SIGHT, NO_RANGE = 0, 1, 2
"""Kinds of links: the third column of `Snapshot.links`."""

_SHAPES: dict[str, tuple[int | str, ...]] = {
    "boxes": ("box", 6),
    "movable": ("box",),
    "pose": ("car", 3),
    "steering": ("car",),
    "present": ("car",),
    "powered": ("car",),
    "estimate": ("car", 2),
    "estimate_cov": ("car", 2, 2),
    "estimate_ok": ("car",),
    "estimate_status": ("car",),
    "estimate_heading": ("car",),
    "links": ("pair", 3),
    "target": ("car", 2),
    "has_target": ("car",),
    "goal": ("car", 2),
    "path": ("point", 2),
    "history_t": ("time",),
    "formation_error": ("time",),
    "tracking_error": ("time",),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """One instant of a room with cars, and the estimates of one car's tracker.

    World frame: origin in the centre of the room, x to the right, y up. Cars have the indices
    0 .. n - 1; cars that are not ``present`` are not drawn.

    Raises:
        EnvError: A field has the wrong shape or an invalid car index; names the field.
    """

    t: float
    """[s] Time."""
    room: tuple[float, float]
    """[m] Width along x, depth along y."""
    boxes: F64
    """Obstacles: centre x y, half width, half depth [m], cosine, sine, (box, 6). Rows with a
    half size of 0 are not drawn."""
    movable: Bool
    """True for boxes that cars can push, (box)."""
    pose: F64
    """True x, y, heading, (car, 3) [m, m, rad]."""
    steering: F64
    """Angle of the front wheels, (car) [rad]."""
    present: Bool
    """True for cars in the room, (car)."""
    powered: Bool
    """True for cars whose tracker has power, (car)."""
    car_size: tuple[float, float]
    """[m] Length, width."""
    viewer: int
    """Index of the car whose estimates are drawn."""
    estimate: F64
    """Estimated positions of the others relative to the viewer, in the viewer's estimate of the
    world frame, (car, 2) [m]. The viewer's own row is not used."""
    estimate_cov: F64
    """Covariance of `estimate`, (car, 2, 2) [m2]."""
    estimate_ok: Bool
    """True where the estimate is usable, (car)."""
    estimate_status: I64
    """`tracking.estimate.Status`, (car). ABSENT and STARTING are not drawn."""
    estimate_heading: F64 | None = None
    """Estimated headings, (car) [rad]. If given, estimates are drawn with their headings, and
    rotated by the error of the viewer's own heading."""
    links: I64
    """Cars i and j and the kind of their link, (pair, 3): 0 LOS, 1 NLOS, 2 no recent range."""
    target: F64
    """Target positions relative to the viewer, world frame, (car, 2) [m]."""
    has_target: Bool
    """True for cars with a target, (car)."""
    goal: F64 | None = None
    """Goal positions in the room, (car, 2) [m]."""
    path: F64 | None = None
    """Path of the plan through the room, (point, 2) [m]."""
    history_t: F64
    """Times of the errors of the recent past, ascending, (time) [s]."""
    formation_error: F64
    """Formation error, (time) [m]; non-finite values are gaps."""
    tracking_error: F64
    """Error of the estimates, (time) [m]; non-finite values are gaps."""
    title: str = ""

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for field in fields(self):
            value, shape = getattr(self, field.name), _SHAPES.get(field.name)
            if shape is None or value is None:
                continue
            got = np.shape(value)
            expected = tuple(
                axis if isinstance(axis, int) else sizes.get(axis, got[k] if k < len(got) else axis)
                for k, axis in enumerate(shape)
            )
            if got != expected:
                raise EnvError(f"snapshot: {field.name}: expected shape {expected}, got {got}")
            sizes.update({axis: got[k] for k, axis in enumerate(shape) if isinstance(axis, str)})
        n = len(self.pose)
        if not 0 <= self.viewer < n:
            raise EnvError(f"snapshot: viewer: expected 0 to {n - 1}, got {self.viewer}")
        if np.any((self.links[:, :2] < 0) | (self.links[:, :2] >= n)):
            raise EnvError(f"snapshot: links: expected cars 0 to {n - 1}")
        if min(*self.room, *self.car_size) <= 0.0:
            raise EnvError("snapshot: room and car_size: expected lengths above 0")

    @property
    def n_cars(self) -> int:
        """Number of cars, present or not."""
        return len(self.pose)
