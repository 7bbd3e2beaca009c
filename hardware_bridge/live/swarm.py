"""A swarm as its trackers see it, from chunks of bytes and times of decisions alone.

Pure: what a live drive saw is what its recording gives, to the last bit.
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
"""[s] A node that was not heard for so long has left, until it is heard again."""
SILENT = 0.5
"""[s] What an operator asked for so long ago is not asked any more; what a car said of its motion
is not true any more."""
ROOM = 1024
"""[-] Measurements that there is room for at first."""


class LiveSwarm:
    """Intake and trackers of one swarm."""

    def __init__(
        self, config: SwarmConfig, start_ns: int, calibration: Calibration | None = None
    ) -> None:
        """Begin with nothing heard.

        Args:
            config: Who is in it, and where bytes come from.
            start_ns: Host time that is 0 s of the estimates [ns].
            calibration: Of the sensors; None takes them as they come.
        """
        self.config, self.group = config, config.constellation
        self.intake = Intake(config, start_ns)
        self._calibration = calibration
        self._block = MeasurementBlock.empty(1, ROOM)
        self._powered: Bool = np.zeros((1, config.n_slots), dtype=bool)
        self._room = ROOM
        self._here: set[int] = set()
        self.allowed: F64 = np.zeros((config.n_slots, 2))
        """Speed [m/s] and steering [rad] that the gate let pass last, (slot, 2)."""
        self.reasons: I64 = np.zeros(config.n_slots, dtype=np.int64)
        """Why these are less than asked, see `hardware_bridge.safety.gate.reason_text`, (slot)."""
        self.armed: Bool = np.zeros(config.n_slots, dtype=bool)
        """Which cars the gate lets move, (slot)."""
        self._perception = self._make_perception()
        self.silent = SilentCars(config.n_slots)
        """Those that may stand in the way of the others."""
        self.tap: Callable[[MeasurementBlock], None] | None = None
        """Called with what was measured since the last step, as it came, without calibration; the
        block is overwritten by the next."""
        self.trim: F64 = np.zeros((1, config.n_slots, 2))
        """Velocity that an operator asks for on top of the plan, (1, slot, 2) [m/s]."""

    @property
    def view(self) -> AgentView:
        """What every car sees now; of one environment."""
        return self._perception.view

    @property
    def estimate(self) -> TeamEstimate:
        """The tracker's last estimate, as old as the horizon, overwritten by the next.

        Where positions come ready it is that of now.
        """
        return self._perception.estimate

    @property
    def n_late(self) -> int:
        """Measurements that came later than the horizon waits."""
        return int(self._perception.n_late[0])

    def share(self, target: F64, wanted: Bool, command: F64) -> None:
        """Let the view have what the task wants; see `Perception.share`."""
        self._perception.share(target, wanted, command)

    def take(self, chunk: Chunk) -> None:
        """Take bytes as they came."""
        self.intake.take(chunk)

    def apply(self, speed: F64, steering: F64, armed: F64, reason: F64) -> None:
        """Note what the gate let the cars do, for cars that do not tell themselves.

        Args:
            speed: (slot) [m/s]
            steering: (slot) [rad]
            armed: 1 where the car may move, (slot).
            reason: Why it is slower than wanted, see `hardware_bridge.safety.gate.reason_text`.
        """
        self.allowed = np.stack([speed, steering], axis=-1)
        self.reasons = reason.astype(np.int64)
        self.armed = armed > 0.0

    def step(self, t_ns: int) -> None:
        """Let the trackers catch up with what arrived, and see.

        Args:
            t_ns: Now, by the host's clock [ns]; not before the last step or chunk.
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
        self.silent.note(self.view, largest_std(self.view.cov[0]), self._heard_since(t_ns, SILENT))

    def heard(self, never: float = -np.inf) -> F64:
        """When each car's node last told of its motion, by the host's clock, (slot) [s]."""
        heard_ns = self.intake.heard_ns
        if self.config.tracker.source != "positions":
            heard_ns = heard_ns | self.intake.sensed_ns
        return np.array([heard_ns[k] * 1e-9 if k in heard_ns else never for k in self._slots])

    @property
    def _slots(self) -> range:
        return range(self.config.n_slots)

    def _heard_since(self, t_ns: int, seconds: float) -> Bool:
        """Which cars were heard in so long before a time, (slot)."""
        heard_ns, since = self.intake.heard_ns, t_ns - seconds * 1e9
        return np.array([heard_ns.get(k, -np.inf) >= since for k in self._slots])

    def _make_perception(self) -> Perception | ReadyPerception:
        tracker, group = self.config.tracker, self.group
        if tracker.source == "positions":
            told = self.intake.other.told
            n_beams = self.config.task.proximity
            return ReadyPerception(
                group, tracker.positions, told, self._block, self._powered, n_beams
            )
        believed = FOR_POLICIES
        if tracker.accuracy is not None:
            joint = replace(believed.joint, accuracy=tracker.accuracy)
            believed = replace(believed, joint=joint)
        params = TrackerParams(filter=believed, horizon=HorizonParams(delay=tracker.delay))
        return Perception(
            group,
            params,
            self._block,
            self._powered,
            filter=tracker.filter,
            room=self._room,
            n_beams=self.config.task.proximity,
        )

    def _let_go(self, t_ns: int, now: float) -> None:
        """Nodes that are heard join; those that have fallen silent leave."""
        heard_ns = self.intake.heard_ns
        recent = {k for k, t in heard_ns.items() if (t_ns - t) * 1e-9 <= GONE}
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
        """Grow, after a pause in which much has piled up."""
        waiting = int(self._perception.n_waiting[0])
        if n + waiting <= self._room:
            return
        while self._room < n + waiting:
            self._room *= 2
        self._block = MeasurementBlock.empty(1, self._room)
        self._perception.make_room(self._room)
        self._perception.rebind(self._block, self._powered)

    def _note_cars(self, t_ns: int) -> None:
        """What the cars are known to do, and what is asked of them."""
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
        view.near[0] = np.where(view.present[0][:, None], intake.near.beams(t_ns), 0.0)
        intake.other.driving = frozenset(driving)


def load_calibration(config: SwarmConfig) -> Calibration | None:
    """What is known of the sensors' errors; None where they are taken as they come.

    Raises:
        BridgeError: A file is wrong, or ranges are calibrated and a node's antenna is not.
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
