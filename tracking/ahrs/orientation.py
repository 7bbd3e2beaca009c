"""From inertial samples to orientation and gravity-free acceleration, one VQF per node.

VQF [1] fuses gyroscope, accelerometer and, where there is one, magnetometer. With the
orientation q_wb the specific force f_b gives the acceleration of the node

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
    """Turns IMU and MAG events into STATE events.

    Laws: any split of the samples into blocks gives the same states, bit for bit; environment k
    of a batch gives what that environment alone gives, bit for bit.

    The class is a shell around `orient`, which works in place, on slices of environments too.
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
        """Everything that evolves, arrays over (env, node, ...)."""
        forget(self.coefficients, self.state, GRAVITY)

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        forget(self.coefficients, self.state.of(slice(env, env + 1)), GRAVITY)

    def part(self, envs: slice) -> Orientation:
        """Some of the environments; shares their memory."""
        part = copy.copy(self)
        part.state = self.state.of(envs)
        return part

    def save(self) -> OrientationState:
        """A copy of everything that evolves."""
        return self.state.copy()

    def restore(self, saved: OrientationState) -> None:
        """Go on from a saved copy."""
        for array, old in zip(self.state, saved, strict=True):
            array[:] = old

    def bind(self, block: MeasurementBlock) -> Callable[[], None]:
        """`step` in place, for a block that stays where it is and is filled again every time."""
        block.in_place  # noqa: B018 -- refuses what is not contiguous
        kernel, arguments = self.call(block)
        return bind(kernel, *arguments)

    def call(self, block: MeasurementBlock) -> Call:
        """The kernel, with arguments of its types."""
        arrays = (block.t, block.kind, block.i, block.values, block.valid)
        return orient, (self.coefficients, self.state, *arrays)

    def step(self, block: MeasurementBlock) -> MeasurementBlock:
        """The block with every IMU sample replaced by the state it leads to.

        MAG events become padding, and so do IMU samples whose heading is not known yet.
        """
        inertial = block.valid & ((block.kind == Kind.IMU) | (block.kind == Kind.MAG))
        if not np.any(inertial):
            return block
        kind, values, valid = block.kind.copy(), block.values.copy(), block.valid.copy()
        t, node = np.ascontiguousarray(block.t), np.ascontiguousarray(block.i)
        orient(self.coefficients, self.state, t, kind, node, values, valid)
        return replace(block, kind=kind, values=values, valid=valid)
