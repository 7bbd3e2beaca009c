"""Observation fields of every mode: targets, command and the car's own motion."""

from __future__ import annotations

from relpos_env.interface._observation_kernels import FAR, FAST
from relpos_env.interface.observations.base import Field
from relpos_env.interface.rangefinders import FARTHEST


def target_fields(n_others: int) -> tuple[Field, ...]:
    """Return the fields of the relative targets of the other cars."""
    return (
        Field(
            "has_target",
            n_others,
            "-",
            "1 where the task gives that car a place",
            1.0,
            signed=False,
            per_other=True,
        ),
        Field(
            "target",
            2 * n_others,
            "m",
            "where that car should be: forward, left",
            FAR,
            per_other=True,
        ),
    )


def own_fields(n_rangefinders: int) -> tuple[Field, ...]:
    """Return the fields of the command, the car's own motion and its distance sensors."""
    near = Field(
        "near",
        n_rangefinders,
        "m",
        "distance to what is nearest: straight ahead, then counter-clockwise",
        FARTHEST,
        signed=False,
    )
    return (
        Field("command", 2, "m/s", "velocity asked by the operator: forward, left", FAST),
        Field("heading", 2, "-", "cosine and sine of the own heading; zeros if unknown", 1.0),
        Field("motion", 2, "m/s, rad", "own speed and steering angle", FAST),
        *((near,) if n_rangefinders else ()),
    )
