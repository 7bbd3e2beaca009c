"""Input of controllers: fields of observations as arrays, for any number of cars at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.errors import UsageError
from relpos_env.interface.observations import OBSERVATIONS, Field, observation_mode, total_size
from relpos_env.interface.observations.base import F32
from tracking.arrays import F64, Bool
from tracking.params.short_repr import short_repr

TINY = 1e-9
"""Lower limit of divisors that may be zero."""

Plane = tuple[F64, F64]
"""Vectors in the body frame: components forward and left, of the same shape."""


@dataclass(frozen=True, slots=True)
class Certainty:
    """Uncertainty of positions, each (..., other)."""

    __repr__ = short_repr

    ahead: F64
    """Standard deviation forward [m]."""
    left: F64
    """Standard deviation to the left [m]."""
    mixed: F64
    """Correlation of the two components [-]."""


@dataclass(frozen=True, slots=True)
class Sight:
    """Perceived state of cars; leading axes are those of the observations.

    For observations with ranges instead of positions, `pos` is the range in the direction of the
    target, which is accurate near the target formation.
    """

    __repr__ = short_repr

    ok: Bool
    """True where the position is usable, (..., other)."""
    pos: Plane
    """Positions of the others relative to the car, (..., other) [m]."""
    vel: Plane | None
    """Velocities of the others relative to the car, (..., other) [m/s]."""
    certainty: Certainty | None
    """Uncertainty of `pos`; None if not observed, then positions count as exact."""
    placed: Bool
    """True where the task sets a target, (..., other)."""
    target: Plane
    """Target positions of the others, (..., other) [m]."""
    command: Plane
    """Velocity commanded by the operator, (...) [m/s]."""
    heading: Plane
    """Cosine and sine of the own heading, zeros if unknown, (...)."""
    speed: F64
    """Own forward speed, (...) [m/s]."""
    steering: F64
    """Own steering angle, (...) [rad]."""
    age: F64 | None
    """Age of the range of each pair, (..., other) [s]; None without ranges."""
    gap: F64 | None
    """Total minus first-path power of the range, (..., other) [dB]; None without ranges."""
    near: F64 | None = None
    """Readings of the distance sensors, (..., ray) [m]; None without them."""

    @property
    def used(self) -> Bool:
        """True for known others with a target; for all known if no car has one (rendezvous)."""
        return self.ok & (self.placed | ~self.placed.any(axis=-1, keepdims=True))


class Reader:
    """Parser of observations of one mode, by the names of their fields."""

    def __init__(self, fields: tuple[Field, ...], controller: str, modes: tuple[str, ...]) -> None:
        """Check the fields.

        Args:
            fields: Fields of one observation.
            controller: Name of the controller in errors.
            modes: Names of the supported observation modes.

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
        """Parse the newest of the stacked observations.

        Args:
            observations: Observations, (..., history * size), the newest first.

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
                # Samples of the observation space may have values that trackers never report.
                certainty = Certainty(
                    np.abs(o[..., first:last:3]),
                    np.abs(o[..., first + 1 : last : 3]),
                    np.clip(o[..., first + 2 : last : 3], -1.0, 1.0),
                )
        else:
            age, gap, vel = o[..., where["age"]], o[..., where["gap"]], None
            share = np.maximum(o[..., where["range"]], 0.0) / np.maximum(length(target), TINY)
            pos = share * target[0], share * target[1]
            # Without a target there is no direction.
            ok = ok & (o[..., where["has_target"]] > 0.5) & (length(target) > TINY)
        return Sight(
            ok=ok,
            pos=pos,
            vel=vel,
            certainty=certainty,
            placed=o[..., where["has_target"]] > 0.5,
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
    """Return the slice of each field of an observation, by name."""
    ends = np.cumsum([f.size for f in fields])
    return {f.name: slice(int(e) - f.size, int(e)) for f, e in zip(fields, ends, strict=True)}


def mode_of(fields: tuple[Field, ...]) -> str:
    """Return the name of the observation mode with these fields, or the fields' names if none.

    `estimate` and `truth` have the same fields; both return `estimate`.
    """
    names = [f.name for f in fields]
    others = next((f.size for f in fields if f.name == "mask"), 0)
    n_rangefinders = next((f.size for f in fields if f.name == "near"), 0)
    for name in OBSERVATIONS:
        if others and observation_mode(name, others + 1, n_rangefinders).fields == fields:
            return name
    return f"fields {', '.join(names)}"


def length(vector: Plane) -> F64:
    """Return the lengths of vectors."""
    lengths: F64 = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1])
    return lengths


def shortened(vector: Plane, limit: float) -> Plane:
    """Return vectors scaled down to at most a maximum length."""
    share = limit / np.maximum(length(vector), limit)
    return share * vector[0], share * vector[1]


def _plane(o: F64, where: slice) -> Plane:
    return o[..., where.start : where.stop : 2], o[..., where.start + 1 : where.stop : 2]


def _vector(o: F64, where: slice) -> Plane:
    return o[..., where.start], o[..., where.start + 1]
