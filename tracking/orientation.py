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

import itertools
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from vqf import VQF

from tracking.arrays import F64, Bool
from tracking.constellation import WHEELED, Constellation, NodeConfig
from tracking.geometry import GRAVITY, quat_from_yaw, quat_multiply, rotate, yaw_of
from tracking.inertial_faults import InertialHealth, at_limit, inspect
from tracking.measurements import Kind, MeasurementBlock


@dataclass(frozen=True, slots=True, kw_only=True)
class OrientationParams:
    """What the orientation stage believes."""

    tau_acc: float = 3.0
    """[s] VQF's accelerometer time constant. Longer trusts the gyroscope more. VQF default."""
    tau_acc_wheeled: float = 30.0
    """[s] The same on cars and robots, which accelerate sideways for seconds in every turn: a
    short time constant takes that for tilt and turns the acceleration by tens of degrees."""
    tau_mag: float = 9.0
    """[s] VQF's magnetometer time constant. VQF default."""
    max_gap: float = 0.5
    """[s] Missing samples up to here are filled by interpolation, so that the gyroscope is
    integrated over them. After a longer silence the orientation is found anew, where there is a
    magnetometer; elsewhere it goes on from where it was."""
    gravity_tau: float = 0.5
    """[s] Time constant with which a node at rest learns the length of gravity that its own
    accelerometer reads, which removes the vertical part of its offset."""


@dataclass(slots=True)
class _NodeState:
    """Everything of one node that evolves, beside its VQF."""

    gravity: float = GRAVITY
    yaw: float = 0.0
    t: float = 0.0
    n_samples: int = 0
    gyr: F64 | None = None
    acc: F64 | None = None
    mag: F64 | None = None
    mag_seen: bool = False
    health: InertialHealth = field(default_factory=InertialHealth)


class Orientation:
    """Turns IMU and MAG events into STATE events.

    Law: any split of the samples into blocks gives the same states, bit for bit.
    """

    def __init__(
        self, constellation: Constellation, params: OrientationParams, n_envs: int = 1
    ) -> None:
        self._nodes = constellation.nodes
        self._magnetic = constellation.heading == "magnetic"
        self._params = params
        self._vqf: dict[tuple[int, int], Any] = {}
        self._state: dict[tuple[int, int], _NodeState] = {}
        self._n_envs = n_envs

    def reset(self, env: int) -> None:
        """Forget everything of one environment."""
        for key in [k for k in self._vqf if k[0] == env]:
            del self._vqf[key], self._state[key]

    def save(self) -> dict[str, Any]:
        """A copy of everything that evolves."""
        return {
            "vqf": {k: v.state for k, v in self._vqf.items()},
            "node": {k: _copy(s) for k, s in self._state.items()},
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Go on from a saved copy."""
        self._vqf = {}
        for key, state in saved["vqf"].items():
            self._vqf[key] = self._make_vqf(self._nodes[key[1]])
            self._vqf[key].state = state
        self._state = {k: _copy(s) for k, s in saved["node"].items()}

    def step(self, block: MeasurementBlock) -> MeasurementBlock:
        """The block with every IMU sample replaced by the state it leads to.

        MAG events become padding, and so do IMU samples whose heading is not known yet.
        """
        inertial = block.valid & ((block.kind == Kind.IMU) | (block.kind == Kind.MAG))
        if not inertial.any():
            return block
        out = MeasurementBlock(*(getattr(block, f.name) for f in fields(block)))
        kind, values, valid = block.kind.copy(), block.values.copy(), block.valid.copy()
        out = replace(out, kind=kind, values=values, valid=valid)
        present = np.zeros((block.n_envs, len(self._nodes)), dtype=bool)
        rows, columns = np.nonzero(inertial)
        present[rows, block.i[rows, columns]] = True
        for env, node in np.argwhere(present):
            events = np.nonzero(inertial[env] & (block.i[env] == node))[0]
            self._step_node(int(env), int(node), events, block, out)
        return out

    def _step_node(
        self, env: int, node: int, events: Any, block: MeasurementBlock, out: MeasurementBlock
    ) -> None:
        """Feed one node's samples, in runs that VQF can take as a batch."""
        state = self._state.setdefault((env, node), _NodeState())
        is_mag = block.kind[env, events] == Kind.MAG
        out.valid[env, events[is_mag]] = False
        imu = events[~is_mag]
        mag, has_mag = _latest_before(block.values[env, events, :3], is_mag, state)
        if len(imu) == 0:
            return
        samples, usable = inspect(state.health, block.values[env, imu, :6])
        out.valid[env, imu[~usable]] = False
        imu, samples, mag, has_mag = imu[usable], samples[usable], mag[usable], has_mag[usable]
        if len(imu) == 0:
            return
        cut_off, upright = at_limit(state.health, samples[:, 3:])
        t = block.t[env, imu]
        gap = np.diff(t, prepend=state.t if state.n_samples else t[0])
        cut = gap > 1.5 / self._nodes[node].imu_hz
        cut[1:] |= has_mag[1:] != has_mag[:-1]
        edges = [0, *np.nonzero(cut[1:])[0] + 1, len(imu)]
        for a, b in itertools.pairwise(edges):
            used = mag[a:b] if has_mag[a] else mag[:0]
            self._feed(
                env, node, imu[a:b], samples[a:b], cut_off[a:b], upright[a:b], used, block, out
            )

    def _feed(
        self,
        env: int,
        node: int,
        run: Any,
        samples: F64,
        cut_off: Bool,
        upright: Bool,
        mag: F64,
        block: MeasurementBlock,
        out: MeasurementBlock,
    ) -> None:
        """One run of evenly spaced samples, all with magnetometer or all without."""
        key, state = (env, node), self._state[env, node]
        t, gyr, acc = block.t[env, run], samples[:, :3], samples[:, 3:]
        if key not in self._vqf:
            self._vqf[key] = self._make_vqf(self._nodes[node])
        elif t[0] - state.t > self._params.max_gap and self._magnetic:
            # Where it points now, nobody knows; what its gyroscope reads at rest is still true.
            bias, sigma = self._vqf[key].getBiasEstimate()
            self._vqf[key] = self._make_vqf(self._nodes[node])
            self._vqf[key].setBiasEstimate(bias, sigma)
            state.mag_seen = False
        vqf = self._vqf[key]
        self._bridge_gap(vqf, state, t[0], gyr[0], acc[0], self._nodes[node].imu_hz)

        gyr, acc = np.ascontiguousarray(gyr), np.ascontiguousarray(acc)
        # VQF leaves zeros out.
        tilt = np.where(upright[:, None], acc, 0.0)
        result = vqf.updateBatch(gyr, tilt, mag if len(mag) else None)
        state.mag_seen |= bool(len(mag))
        if self._magnetic:
            q = result["quat9D"] if len(mag) else _turn(result["quat6D"], vqf)
        else:
            if state.n_samples == 0:
                heading = self._nodes[node].initial_heading or 0.0
                state.yaw = heading - float(yaw_of(result["quat6D"][0]))
            q = quat_multiply(quat_from_yaw(state.yaw), result["quat6D"])
        resting = result["restDetected"] & upright
        gravity = self._learn_gravity(state, acc, resting, self._nodes[node].imu_hz)
        accel_w = rotate(q, acc)
        accel_w[:, 2] -= gravity

        out.kind[env, run] = Kind.STATE
        out.values[env, run, :4] = q
        out.values[env, run, 4:7] = accel_w
        out.values[env, run, 7] = np.where(cut_off[:, :2].any(axis=1), 2, cut_off[:, 2])
        out.valid[env, run] = state.mag_seen or not self._magnetic
        state.t, state.gyr, state.acc = float(t[-1]), gyr[-1].copy(), acc[-1].copy()
        state.n_samples += len(run)

    def _bridge_gap(
        self, vqf: Any, state: _NodeState, t: float, gyr: F64, acc: F64, imu_hz: float
    ) -> None:
        """Feed interpolated samples for those that were lost since the last one."""
        gap = t - state.t
        missing = round(gap * imu_hz) - 1
        if state.gyr is None or state.acc is None or missing < 1 or gap > self._params.max_gap:
            return
        w = (np.arange(1, missing + 1) / (missing + 1))[:, None]
        vqf.updateBatch(state.gyr + w * (gyr - state.gyr), state.acc + w * (acc - state.acc))

    def _learn_gravity(self, state: _NodeState, acc: F64, rest: Any, imu_hz: float) -> F64:
        """Length of gravity as the node's accelerometer reads it at rest, (sample) [m/s2]."""
        gain = 1.0 / (imu_hz * self._params.gravity_tau)
        gravity = np.empty(len(acc))
        for k, length in enumerate(np.linalg.norm(acc, axis=1)):
            if rest[k]:
                state.gravity += gain * (float(length) - state.gravity)
            gravity[k] = state.gravity
        return gravity

    def _make_vqf(self, node: NodeConfig) -> Any:
        wheeled = node.vehicle in WHEELED
        return VQF(
            1.0 / node.imu_hz,
            -1.0,
            1.0 / (node.mag_hz or node.imu_hz),
            tauAcc=self._params.tau_acc_wheeled if wheeled else self._params.tau_acc,
            tauMag=self._params.tau_mag,
        )


def _copy(state: _NodeState) -> _NodeState:
    return replace(state, health=replace(state.health))


def _latest_before(values: F64, is_mag: Bool, state: _NodeState) -> tuple[F64, Bool]:
    """The field that came since the sample before, for every inertial sample.

    Args:
        values: Fields where `is_mag`, (event, 3) [uT].
        is_mag: True for magnetometer readings, False for inertial samples, (event).
        state: Of the node; a reading that no sample followed yet waits in it.

    Returns:
        Fields, (sample, 3) [uT], and where there was one, (sample).
    """
    index = np.arange(len(is_mag))
    latest = np.maximum.accumulate(np.where(is_mag, index, -1))
    imu = index[~is_mag]
    before = np.concatenate([[-1], imu[:-1]]) if len(imu) else imu
    has_mag = latest[imu] > before
    mag = values[np.maximum(latest[imu], 0)]
    if len(imu) and not has_mag[0] and state.mag is not None:
        mag[0], has_mag[0] = state.mag, True
    if len(imu):
        state.mag = None
    if len(index) and latest[-1] > (imu[-1] if len(imu) else -1):
        state.mag = values[latest[-1]].copy()
    return mag, has_mag


def _turn(q_6d: F64, vqf: Any) -> F64:
    """6D orientations turned by the heading correction that the magnetometer left, (..., 4)."""
    return quat_multiply(quat_from_yaw(float(vqf.getDelta())), q_6d)
