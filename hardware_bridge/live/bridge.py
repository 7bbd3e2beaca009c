"""Opening of all parts of a live swarm in order, and closing in any case."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from importlib.metadata import version
from pathlib import Path
from types import TracebackType

from hardware_bridge.config.swarm import SwarmConfig
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.live.feed import LiveFeed
from hardware_bridge.live.marks import KeptMarks
from hardware_bridge.live.opened import OpenBridge
from hardware_bridge.live.start import Start, StartParams, check_pace, check_watchdogs
from hardware_bridge.live.swarm import LiveSwarm, load_calibration
from hardware_bridge.live.warm_up import warm_up
from hardware_bridge.pauses import short_pauses
from hardware_bridge.recording import Header, Recorder
from hardware_bridge.safety.charge import Charge
from hardware_bridge.safety.process import SupervisorProcess
from hardware_bridge.wire.key import REMOVED_KEY, without_keys
from tracking.calibration.file import calibration_toml


class Bridge(OpenBridge):
    """Ports, trackers, a recording, and a supervisor if cars are driven."""

    feed: LiveFeed

    def __init__(
        self,
        config: SwarmConfig,
        *,
        drive: bool = False,
        arm: bool = False,
        wait: float = 60.0,
        record: Path | str | None = None,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Open everything.

        Args:
            config: Configuration of the swarm.
            drive: True to start a gate; False to listen only.
            arm: True to open the ports of the cars, so that they can be armed. A drive without is a
                dry run.
            wait: Longest wait until all cars are armed [s].
            record: Path of the recording; must not exist.
            now_ns: The host's monotonic clock [ns].

        Raises:
            BridgeError: A port, a calibration or the recording cannot be used, or cars are to move
                without a calibration of their ranges.
        """
        if REMOVED_KEY in config.keys:
            raise BridgeError('key: "removed", expected the keys that a recording does not hold')
        if arm and not config.cars:
            raise BridgeError("cars: none in the configuration, nothing can be armed")
        measures = config.tracker.source == "measurements"
        if arm and measures and config.calibration is None:
            raise BridgeError(
                "calibration: missing; make one with `relpos calibrate`, or say "
                "uncalibrated = true if measurements are good as they come"
            )
        if arm:
            check_pace(config)
            check_watchdogs(config)
        calibration = load_calibration(config)
        no_ranges = calibration is not None and calibration.ranges is None
        if arm and measures and no_ranges and not config.uncalibrated_ranges:
            raise BridgeError(
                "calibration: nothing about ranges in its files; add that of `relpos calibrate "
                "uwb`, or say uncalibrated_ranges = true if ranges are good as they come"
            )
        self.config = config
        self._stack, self._is_open = ExitStack(), False
        warm_up(config)
        with ExitStack() as stack:
            stack.enter_context(short_pauses())
            self.links = Links([link.port for link in config.links], now_ns)
            stack.callback(self.links.close)
            start_ns, wall_ns = now_ns(), time.time_ns()
            wall_s = wall_ns // 1_000_000_000
            self.swarm = LiveSwarm(config, start_ns, calibration)
            self.marks: KeptMarks | None = None
            if config.marks is not None:
                self.marks = KeptMarks(config.marks, self.swarm.intake, wall_s)
                stack.callback(self.marks.close)
            self.recorder: Recorder | None = None
            if record is not None:
                header = Header(
                    software=f"relpos-env {version('relpos-env')}",
                    config=without_keys(config.text, config.keys),
                    links=tuple(self.swarm.intake.streams),
                    monotonic_ns=start_ns,
                    wall_ns=wall_ns,
                )
                self.recorder = Recorder(record, header)
                # The recording of a failed start is removed, since it would occupy the name of the
                # next. After a complete start it is kept, whatever error occurs later.
                stack.push(lambda kind, *_: _remove(record) if kind and not self._is_open else None)
                stack.callback(self.recorder.close)
                if calibration is not None:
                    text = calibration_toml(calibration)
                    self.recorder.add_event(start_ns, "calibration", text=text)
                if self.marks is not None:
                    self.recorder.add_event(start_ns, "marks", known=self.marks.known)
                if config.alone is not None:
                    self.recorder.add_event(start_ns, "alone", node=config.alone)
                self.recorder.add_event(start_ns, "start")
            self.supervisor: SupervisorProcess | None = None
            if drive:
                cars = tuple((config.slot_of(car), car) for car in config.cars)
                dry = () if arm else tuple(slot for slot, _ in cars)
                boot = wall_s if self.marks is None else self.marks.boot
                charge = Charge(
                    config.safety,
                    config.n_slots,
                    cars if arm else (),
                    boot,
                    dry,
                    {} if self.marks is None else self.marks.known,
                )
                self.supervisor = SupervisorProcess(charge)
                stack.callback(self.supervisor.close)
            self.feed = LiveFeed(
                self.swarm,
                self.links,
                now_ns,
                supervisor=self.supervisor,
                recorder=self.recorder,
                marks=self.marks,
            )
            self.start = Start(self.feed, arm=arm, params=StartParams(wait=wait))
            self._stack, self._is_open = stack.pop_all(), True

    @property
    def recording_lost(self) -> str | None:
        """Reason for missing records in the recording; None if it is complete or there is none."""
        return None if self.recorder is None else self.recorder.lost

    def close(self) -> None:
        """Stop the cars and close everything."""
        self._stack.close()

    def __enter__(self) -> Bridge:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _remove(path: Path | str) -> None:
    Path(path).unlink(missing_ok=True)
