"""What controllers see: the stretches of observations as arrays, for any number of cars at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.errors import UsageError
from relpos_env.interface.observations import OBSERVATIONS, Field, observation_mode, total_size
from relpos_env.interface.observations.base import F32
from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

TINY = 1e-9
"""Divisions by what may be zero are by this at least."""

Plane = tuple[F64, F64]
"""Vectors in the frame of the car: components forward and to the left, of the same shape."""


@dataclass(frozen=True, slots=True)
class Certainty:
    """How sure positions are, each (..., other)."""

    __repr__ = short_repr

    ahead: F64
    """Standard deviation forward [m]."""
    left: F64
    """Standard deviation to the left [m]."""
    mixed: F64
    """Correlation of the two [-]."""


@dataclass(frozen=True, slots=True)
class Sight:
    """What cars see; leading axes are those of the observations.

    Where the observation has ranges in place of positions, `pos` is the range in the direction of
    the other's place: good where the formation is nearly right.
    """

    __repr__ = short_repr

    ok: Bool
    """Whose position can be used, (..., other)."""
    pos: Plane
    """Where the others are, (..., other) [m]."""
    vel: Plane | None
    """Their velocities relative to the car, (..., other) [m/s]."""
    certainty: Certainty | None
    """None where the observation does not tell; then positions are taken for certain."""
    placed: Bool
    """To whom the task gives a place, (..., other)."""
    target: Plane
    """Where they should be, (..., other) [m]."""
    command: Plane
    """Velocity asked by the operator, (...) [m/s]."""
    heading: Plane
    """Cosine and sine of the own heading, zeros if unknown, (...)."""
    speed: F64
    """Own forward speed, (...) [m/s]."""
    steering: F64
    """Own steering angle, (...) [rad]."""
    age: F64 | None
    """Since the range of each pair, (..., other) [s]; of ranges only."""
    gap: F64 | None
    """Received less first-path power of that range, (..., other) [dB]; of ranges only."""
    near: F64 | None = None
    """What the distance sensors read, (..., beam) [m]; None without them."""

    @property
    def used(self) -> Bool:
        """Known others with a place; where no car has one, as at a rendezvous, all known."""
        return self.ok & (self.placed | ~self.placed.any(axis=-1, keepdims=True))


class Reader:
    """Observations of one mode, taken apart by the names of their fields."""

    def __init__(self, fields: tuple[Field, ...], controller: str, modes: tuple[str, ...]) -> None:
        """Say what is read.

        Args:
            fields: Stretches of one observation.
            controller: Who reads, for the message.
            modes: Names of the observations that it can read.

        Raises:
            UsageError: The fields are those of another mode.
        """
        name = mode_of(fields)
        if name not in modes:
            raise UsageError(
                f"observation: {controller} expects one of {', '.join(modes)}, got {name}"
            )
        self._where, self._size = split_fields(fields), total_size(fields)

    def read(self, observations: F32) -> Sight:
        """The newest observation in each.

        Args:
            observations: (..., history * size), the newest first.

        Raises:
            UsageError: The length is not a multiple of the fields' size.
        """
        observations = np.asarray(observations)
        if (
            observations.ndim == 0
            or not observations.shape[-1]
            or (observations.shape[-1] % self._size)
        ):
            raise UsageError(
                f"observations: expected a last axis of {self._size} or a multiple of it, "
                f"got shape {observations.shape}"
            )
        o = observations[..., : self._size].astype(np.float64)
        where = self._where
        ok, target = o[..., where["mask"]] > 0.5, _plane(o, where["target"])
        own, age, gap, certainty = where["motion"].start, None, None, None
        if "pos" in where:
            pos, vel = _plane(o, where["pos"]), _plane(o, where["vel"])
            if "std" in where:
                first, last = where["std"].start, where["std"].stop
                # Observations in the space, though not from the tracker, may have any numbers.
                certainty = Certainty(
                    np.abs(o[..., first:last:3]),
                    np.abs(o[..., first + 1 : last : 3]),
                    np.clip(o[..., first + 2 : last : 3], -1.0, 1.0),
                )
        else:
            age, gap, vel = o[..., where["age"]], o[..., where["gap"]], None
            share = np.maximum(o[..., where["range"]], 0.0) / np.maximum(length(target), TINY)
            pos = share * target[0], share * target[1]
            # No place, no direction.
            ok = ok & (o[..., where["wanted"]] > 0.5) & (length(target) > TINY)
        return Sight(
            ok=ok,
            pos=pos,
            vel=vel,
            certainty=certainty,
            placed=o[..., where["wanted"]] > 0.5,
            target=target,
            command=_vector(o, where["command"]),
            heading=_vector(o, where["heading"]),
            speed=o[..., own],
            steering=o[..., own + 1],
            age=age,
            gap=gap,
            near=o[..., where["near"]] if "near" in where else None,
        )


def split_fields(fields: tuple[Field, ...]) -> dict[str, slice]:
    """Where each named stretch of an observation stands."""
    ends = np.cumsum([f.size for f in fields])
    return {f.name: slice(int(e) - f.size, int(e)) for f, e in zip(fields, ends, strict=True)}


def mode_of(fields: tuple[Field, ...]) -> str:
    """Name of the observation mode with these fields, or the fields' names if there is none.

    `estimate` and `truth` have the same fields, and are `estimate` here.
    """
    names = [f.name for f in fields]
    others = next((f.size for f in fields if f.name == "mask"), 0)
    beams = next((f.size for f in fields if f.name == "near"), 0)
    for name in OBSERVATIONS:
        if others and observation_mode(name, others + 1, beams).fields == fields:
            return name
    return f"fields {', '.join(names)}"


def length(vector: Plane) -> F64:
    """Lengths of vectors."""
    lengths: F64 = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1])
    return lengths


def shortened(vector: Plane, limit: float) -> Plane:
    """Vectors made no longer than a limit."""
    share = limit / np.maximum(length(vector), limit)
    return share * vector[0], share * vector[1]


def _plane(o: F64, where: slice) -> Plane:
    return o[..., where.start : where.stop : 2], o[..., where.start + 1 : where.stop : 2]


def _vector(o: F64, where: slice) -> Plane:
    return o[..., where.start], o[..., where.start + 1]
