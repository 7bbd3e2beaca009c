"""Measurement models: predicted measurements and their derivatives.

Each model has a file; filters share them. A model is a compiled function of numbers,

    z_hat, *derivatives = model(*state, *constants)

with a derivative by each number of the state, in order. A filter chooses the elements of its state
that are these numbers. `MODELS` lists the models; the derivatives of each are compared with finite
differences (`tests/tracking/test_models.py`). A new model needs a file and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from tracking.models.lever_arm import lever_arm_model
from tracking.models.mean_velocity import mean_velocity_model
from tracking.models.nonholonomic import nonholonomic_model
from tracking.models.range import range_model
from tracking.models.range_bias import range_bias_model
from tracking.models.zero_velocity import zero_velocity_model


class Model(NamedTuple):
    """A measurement model and the data of its test."""

    function: Callable[..., tuple[float, ...]]
    n_state: int
    """Number of arguments that are the state, the first ones; each has a derivative."""
    n_constants: int
    noise: str
    """Name of the parameter that is the standard deviation of its noise."""


MODELS: dict[str, Model] = {
    "range": Model(range_model, 3, 0, "RangeErrorParams.white_std"),
    "lever arm": Model(lever_arm_model, 1, 4, "RangeErrorParams.white_std"),
    "range bias": Model(range_bias_model, 2, 0, "RangeErrorParams.white_std"),
    "zero velocity": Model(zero_velocity_model, 1, 0, "JointParams.rest_std"),
    "non-holonomic": Model(nonholonomic_model, 5, 4, "VehicleParams.sideways_std"),
    "mean velocity": Model(mean_velocity_model, 1, 1, "VehicleParams.speed_std"),
}
"""Models by name. A surveyed distance is a range between two origins, without bias or lever arm."""

__all__ = ["MODELS", "Model"]
