"""A swarm's intake and trackers, driven only by chunks of bytes and times of control steps.

Pure: replaying a recording reproduces the live run to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.errors import BridgeError
from hardware_bridge.external_tracker.frozen_positions import DRIVES
from hardware_bridge.external_tracker.perception import ReadyPerception
from hardware_bridge.ingest.intake import Intake
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.silent_cars import SilentCars
from hardware_bridge.safety.picture import largest_std
from relpos_env.interface.perception import FOR_POLICIES, Perception
from relpos_env.interface.views import AgentView
from tracking.arrays import F64, I64, Bool
from tracking.calibration.calibration import Calibration, merge
from tracking.calibration.file import read_calibration
from tracking.estimate import TeamEstimate
from tracking.late_data.horizon import HorizonParams
from tracking.measurements import Kind, MeasurementBlock
from tracking.tracker import TrackerParams

GONE = 5.0
"""[s] A node without messages for this time has left, until its next message."""
SILENT = 0.5
"""[s] Age from which an operator's trim and a car's reported motion are not used."""
ROOM = 1024
"""[-] Initial capacity in measurements."""


class LiveSwarm:
    """Intake and trackers of one swarm."""

    def __init__(
        self, config: SwarmConfig, start_ns: int, calibration: Calibration | None = None
    ) -> None:
        """Create a swarm without measurements.

        Args:
            config: Nodes, cars and ports.
            start_ns: Host time that is 0 s of the estimates [ns].
            calibration: Calibration of the sensors; None uses measurements as received.
        """
        self.config, self.group = config, config.constellation
        self.intake = Intake(config, start_ns)
        self._calibration = calibration
        self._block = MeasurementBlock.empty(1, ROOM)
        self._powered: Bool = np.zeros((1, config.n_slots), dtype=bool)
        self._room = ROOM
        self._here: set[int] = set()
        self.allowed: F64 = np.zeros((config.n_slots, 2))
        """Speed [m/s] and steering [rad] last passed by the gate, (slot, 2)."""
        self.reasons: I64 = np.zeros(config.n_slots, dtype=np.int64)
        """Reason for a limit, see `hardware_bridge.safety.gate.reason_text`, (slot)."""
        self.armed: Bool = np.zeros(config.n_slots, dtype=bool)
        """True for armed cars, (slot)."""
        self._perception = self._make_perception()
        self.silent = SilentCars(config.n_slots)
        """Silent cars, which may be obstacles to the others."""
        self.tap: Callable[[MeasurementBlock], None] | None = None
        """Called with the measurements since the last step, without calibration; the block is
        overwritten by the next step."""
        self.trim: F64 = np.zeros((1, config.n_slots, 2))
        """Velocity that an operator adds to the plan, (1, slot, 2) [m/s]."""

    @property
    def view(self) -> AgentView:
        """Current view of every car; of one environment."""
        return self._perception.view

    @property
    def estimate(self) -> TeamEstimate:
        """Last estimate of the tracker, delayed by the horizon; the next one overwrites it.

        With an external tracker it is for the current time.
        """
        return self._perception.estimate

    @property
    def n_late(self) -> int:
        """Number of measurements that came later than the horizon waits."""
        return int(self._perception.n_late[0])

    def share(self, target: F64, has_target: Bool, command: F64) -> None:
        """Use arrays of the task in the view; see `Perception.share`."""
        self._perception.share(target, has_target, command)

    def take(self, chunk: Chunk) -> None:
        """Process received bytes."""
        self.intake.take(chunk)

    def apply(self, speed: F64, steering: F64, armed: F64, reason: F64) -> None:
        """Store the commands passed by the gate, for cars that do not report their motion.

        Args:
            speed: Permitted speed, (slot) [m/s].
            steering: Permitted steering angle, (slot) [rad].
            armed: 1 for armed cars, (slot).
            reason: Reason for a limit, see `hardware_bridge.safety.gate.reason_text`, (slot).
        """
        self.allowed = np.stack([speed, steering], axis=-1)
        self.reasons = reason.astype(np.int64)
        self.armed = armed > 0.0

    def step(self, t_ns: int) -> None:
        """Process all pending measurements and update the view.

        Args:
            t_ns: Current host time [ns]; not before the last step or chunk.
        """
        now = self.intake.seconds(t_ns)
        self._let_go(t_ns, now)
        events = self.intake.events
        self._make_room(len(events))
        events.move_into(self._block)
        if self.tap is not None:
            self.tap(self._block)
        if self._calibration is not None:
            corrected = self._calibration.apply(self._block, self.group)
            self._block.values[:] = corrected.values
        self._note_cars(t_ns)
        self.view.now[0] = now
        self._perception.step()
        self.silent.move(self.view, now)
        self.silent.note(
            self.view, largest_std(self.view.cov[0]), self._has_recent_message(t_ns, SILENT)
        )

    def t_last_message(self, never: float = -np.inf) -> F64:
        """Return the host time of each car's last sample, else of its last message, (slot) [s]."""
        received_ns = self.intake.received_ns
        if self.config.tracker.source != "positions":
            received_ns = received_ns | self.intake.sensed_ns
        return np.array([received_ns[k] * 1e-9 if k in received_ns else never for k in self._slots])

    @property
    def _slots(self) -> range:
        return range(self.config.n_slots)

    def _has_recent_message(self, t_ns: int, seconds: float) -> Bool:
        """Return the cars with a message in the last `seconds` before a time, (slot)."""
        received_ns, since = self.intake.received_ns, t_ns - seconds * 1e9
        return np.array([received_ns.get(k, -np.inf) >= since for k in self._slots])

    def _make_perception(self) -> Perception | ReadyPerception:
        tracker, group = self.config.tracker, self.group
        if tracker.source == "positions":
            pending = self.intake.other.pending
            n_rangefinders = self.config.task.proximity
            return ReadyPerception(
                group, tracker.positions, pending, self._block, self._powered, n_rangefinders
            )
        filter_params = FOR_POLICIES
        if tracker.accuracy is not None:
            joint = replace(filter_params.joint, accuracy=tracker.accuracy)
            filter_params = replace(filter_params, joint=joint)
        params = TrackerParams(filter=filter_params, horizon=HorizonParams(delay=tracker.delay))
        return Perception(
            group,
            params,
            self._block,
            self._powered,
            filter=tracker.filter,
            room=self._room,
            n_rangefinders=self.config.task.proximity,
        )

    def _let_go(self, t_ns: int, now: float) -> None:
        """Add joining nodes, and nodes that leave by falling silent, to the events."""
        received_ns = self.intake.received_ns
        recent = {k for k, t in received_ns.items() if (t_ns - t) * 1e-9 <= GONE}
        for node in sorted(recent - self._here):
            self.intake.events.add(now, Kind.JOIN, node, ())
            if node in self._slots:
                self.silent.forget(node)
        for node in sorted(self._here - recent):
            self.intake.events.add(now, Kind.LEAVE, node, ())
            if node in self._slots:
                self.silent.keep(node)
        self._here = recent

    def _make_room(self, n: int) -> None:
        """Enlarge the buffers if many measurements are pending, as after a pause."""
        waiting = int(self._perception.n_waiting[0])
        if n + waiting <= self._room:
            return
        while self._room < n + waiting:
            self._room *= 2
        self._block = MeasurementBlock.empty(1, self._room)
        self._perception.make_room(self._room)
        self._perception.rebind(self._block, self._powered)

    def _note_cars(self, t_ns: int) -> None:
        """Write the motion, sensor readings and operator trims of the cars."""
        view, intake = self.view, self.intake
        driving: set[int] = set()
        for k in self._slots:
            here = k in self._here
            self._powered[0, k] = view.present[0, k] = here
            speed, steering = self.allowed[k].tolist()
            at_ns, said = intake.motion.get(k, (0, None))
            if said is not None and (t_ns - at_ns) * 1e-9 <= SILENT:
                speed = said.speed
                steering = steering if said.steering is None else said.steering
            view.speed[0, k], view.steering[0, k] = speed, steering
            if abs(speed) > DRIVES:
                driving.add(k)
            asked = intake.trims.newest.get(k)
            fresh = asked is not None and (t_ns - asked[0]) * 1e-9 <= SILENT
            self.trim[0, k] = asked[1] if fresh and asked is not None else 0.0
        view.near[0] = np.where(view.present[0][:, None], intake.near.distances(t_ns), 0.0)
        intake.other.driving = frozenset(driving)


def load_calibration(config: SwarmConfig) -> Calibration | None:
    """Return the calibration of the sensors; None to use measurements as received.

    Raises:
        BridgeError: A file is invalid, or ranges are calibrated and a node's antenna is not.
    """
    if not config.calibration:
        return None
    calibration = merge(read_calibration(path) for path in config.calibration)
    known = set(config.constellation.ids)
    strange, without = (
        sorted(set(calibration.nodes) - known),
        sorted(known - set(calibration.nodes)),
    )
    if strange and without:
        raise BridgeError(
            f"calibration: has node {', '.join(map(str, strange))}, which is not in the group, and "
            f"not node {', '.join(map(str, without))}"
        )
    if calibration.ranges is not None:
        missing = set(config.constellation.ids) - set(calibration.ranges.offset)
        if missing:
            names = ", ".join(map(str, sorted(missing)))
            raise BridgeError(f"calibration: no range offset of node {names}; calibrate it too")
    return calibration
