"""Orientation and gravity-free acceleration from inertial samples, one VQF per node.

VQF [1] fuses gyroscope, accelerometer and, if present, magnetometer. With the orientation q_wb
the specific force f_b gives the acceleration of the node

    a_w = R(q_wb) f_b - (0, 0, g)

A magnetometer makes the yaw absolute (9D, y is magnetic north). Without one (6D) the yaw
starts at `NodeConfig.initial_heading` and drifts with the gyroscope.

References:
    [1] Laidig, Seel, VQF: Highly accurate IMU orientation estimation with bias estimation and
        magnetic disturbance rejection, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tracking.ahrs.orientation_state import (
    OrientationCoefficients,
    OrientationState,
    make_coefficients,
    make_state,
)
from tracking.ahrs.params import OrientationParams
from tracking.ahrs.stage import forget, orient
from tracking.constellation import Constellation
from tracking.geometry import GRAVITY
from tracking.kernels.jit import Call, bind
from tracking.measurements import Kind, MeasurementBlock

__all__ = [
    "Orientation",
    "OrientationCoefficients",
    "OrientationState",
    "make_coefficients",
    "make_state",
    "orient",
]


class Orientation:
    """Conversion of IMU and MAG events into STATE events.

    Properties: any division of the samples into blocks gives the same states; environment k of a
    batch equals that environment alone, both bit for bit.

    The class wraps `orient`, which works in place, on slices of environments too.
    """

    def __init__(
        self,
        constellation: Constellation,
        params: OrientationParams,
        n_envs: int = 1,
        *,
        follows_bias: bool = False,
    ) -> None:
        self.coefficients = make_coefficients(constellation, params, follows_bias=follows_bias)
        """Constants of the kernels."""
        self.state = make_state(n_envs, constellation.n_nodes)
        """State of the stage, arrays over (env, node, ...)."""
        forget(self.coefficients, self.state, GRAVITY)

    def reset(self, env: int) -> None:
        """Reset one environment."""
        forget(self.coefficients, self.state.of(slice(env, env + 1)), GRAVITY)

    def part(self, envs: slice) -> Orientation:
        """Return some of the environments; shares their memory."""
        part = copy.copy(self)
        part.state = self.state.of(envs)
        return part

    def save(self) -> OrientationState:
        """Return a copy of the state."""
        return self.state.copy()

    def restore(self, saved: OrientationState) -> None:
        """Restore a saved state."""
        for array, old in zip(self.state, saved, strict=True):
            array[:] = old

    def bind(self, block: MeasurementBlock) -> Callable[[], None]:
        """Bind `step`, in place, to a block whose arrays are refilled every time."""
        block.in_place  # noqa: B018 -- raises for arrays that are not contiguous
        kernel, arguments = self.call(block)
        return bind(kernel, *arguments)

    def call(self, block: MeasurementBlock) -> Call:
        """Return the kernel with arguments of its types."""
        arrays = (block.t, block.kind, block.i, block.values, block.valid)
        return orient, (self.coefficients, self.state, *arrays)

    def step(self, block: MeasurementBlock) -> MeasurementBlock:
        """Return the block with every IMU sample replaced by its state.

        MAG events become padding, as do IMU samples before the heading is known.
        """
        inertial = block.valid & ((block.kind == Kind.IMU) | (block.kind == Kind.MAG))
        if not np.any(inertial):
            return block
        kind, values, valid = block.kind.copy(), block.values.copy(), block.valid.copy()
        t, node = np.ascontiguousarray(block.t), np.ascontiguousarray(block.i)
        orient(self.coefficients, self.state, t, kind, node, values, valid)
        return replace(block, kind=kind, values=values, valid=valid)
