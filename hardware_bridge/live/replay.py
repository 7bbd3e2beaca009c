"""Replay of a recording in place of ports: equal chunks and control steps give equal estimates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hardware_bridge.config import SwarmConfig, known_by, parse_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.marks import Marks, parse_marks
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.recording import Kind, Recording, read_recording
from hardware_bridge.safety.gate import is_reason
from hardware_bridge.safety.picture import Picture
from tracking.arrays import F64
from tracking.calibration.calibration import Calibration
from tracking.calibration.file import parse_calibration
from tracking.filters import filter_builder

APPLIED = ("speed", "steering", "armed", "reason")


class ReplayFeed:
    """A recording as a `hardware_bridge.live.group.Feed`."""

    def __init__(
        self,
        recording: Recording,
        pace: Callable[[int], None] | None = None,
        *,
        filter: str | None = None,
        keys: SwarmConfig | None = None,
    ) -> None:
        """Open a recording.

        Args:
            recording: Result of `read_recording`.
            pace: Called with the time of every control step [ns]; it may wait. None replays as fast
                as possible.
            filter: Filter that replaces the recorded one; one of `tracking.filters.FILTERS`.
            keys: Configuration of the recorded run, used for its keys, since recordings contain
                none. Without it signatures are not checked.

        Raises:
            BridgeError: The recorded configuration is invalid, or the calibration is damaged.
            ConfigError: Unknown filter.
        """
        self.recording, self._pace = recording, pace
        file = recording.path.name
        config = parse_config(recording.header.config, file=file, folder=Path(), with_files=False)
        node = _alone(recording)
        if node is not None:
            config = known_by(config, node)
        if filter is not None:
            filter_builder(filter)
            config = replace(config, tracker=replace(config.tracker, filter=filter))
        self.config: SwarmConfig = config if keys is None else with_keys_of(config, keys)
        config = self.config
        self.calibration = _calibration(recording)
        """Calibration of the measurements; None uses them as received."""
        if config.calibration and self.calibration is None:
            raise BridgeError(f"{file}: the calibration in it is lost, nothing can be tracked")
        self.swarm = LiveSwarm(config, recording.header.monotonic_ns, self.calibration)
        self.swarm.intake.restore(_marks(recording))
        for name in self.swarm.intake.streams:
            if name not in recording.header.links:
                raise BridgeError(f"{file}: has no stream {name} of its own configuration")
        self._records = iter(recording)
        self.notices: list[tuple[int, str]] = []
        """Notices of the recorded run; time [ns] and text."""

    def advance(self) -> int | None:
        """Advance to the next control step; see `Feed`."""
        names = self.recording.header.links
        for record in self._records:
            if record.kind == Kind.BYTES_IN:
                name = names[record.link] if record.link < len(names) else ""
                if name in self.swarm.intake.streams:
                    self.swarm.take(Chunk(name, record.t_ns, record.payload))
            elif record.kind == Kind.EVENT:
                event = self.recording.event(record)
                if event.get("event") == "applied":
                    self.swarm.apply(**self._applied(event))
                elif event.get("event") == "notice":
                    self.notices.append((record.t_ns, str(event.get("text", ""))))
            elif record.kind == Kind.TICK:
                self.swarm.intake.notices.clear()
                if self._pace is not None:
                    self._pace(record.t_ns)
                return record.t_ns
        return None

    def _applied(self, event: Mapping[str, Any]) -> dict[str, F64]:
        """Return the commands passed by the gate, from a record.

        Raises:
            BridgeError: The record lacks a number for a car, or has an invalid one.
        """
        n, found = self.swarm.config.n_slots, {}
        for key in APPLIED:
            try:
                found[key] = np.array(event[key], dtype=np.float64)
            except (KeyError, TypeError, ValueError):
                found[key] = np.zeros(0)
            if found[key].shape != (n,) or not np.isfinite(found[key]).all():
                raise BridgeError(
                    f"{self.recording.path.name}: a record 'applied' expected {n} numbers as {key}"
                )
        if not all(is_reason(int(code)) for code in found["reason"]):
            raise BridgeError(f"{self.recording.path.name}: a record 'applied' has unknown reasons")
        return found

    def decide(self, picture: Picture) -> None:
        """Do nothing, since no car moves in a replay."""


def open_replay(
    path: Path | str,
    pace: Callable[[int], None] | None = None,
    *,
    filter: str | None = None,
) -> ReplayFeed:
    """Open a recording file; arguments as of `ReplayFeed`.

    Raises:
        BridgeError: The file is no recording, or its configuration is invalid.
        ConfigError: Unknown filter.
    """
    return ReplayFeed(read_recording(path), pace, filter=filter)


def _alone(recording: Recording) -> int | None:
    """Return the node whose computer recorded for it alone; None if all cars were driven."""
    for record in recording:
        if record.kind == Kind.EVENT:
            event = recording.event(record)
            if event.get("event") == "alone":
                if not isinstance(event.get("node"), int):
                    raise BridgeError(f"{recording.path.name}: a record 'alone' is damaged")
                return int(event["node"])
            if event.get("event") == "start":
                break
    return None


def _calibration(recording: Recording) -> Calibration | None:
    """Return the calibration used in the recorded run, which the recording contains."""
    for record in recording:
        if record.kind != Kind.EVENT:
            continue
        event = recording.event(record)
        if event.get("event") == "calibration":
            return parse_calibration(str(event.get("text")), recording.path.name)
        if event.get("event") == "start":
            return None
    return None


def _marks(recording: Recording) -> Marks:
    """Return the marks of signed messages at the start of the recording."""
    for record in recording:
        if record.kind == Kind.EVENT:
            event = recording.event(record)
            if event.get("event") == "marks":
                try:
                    return parse_marks(event["known"])
                except (KeyError, ValueError, TypeError, AttributeError) as error:
                    raise BridgeError(
                        f"{recording.path.name}: a record 'marks' is damaged"
                    ) from error
            if event.get("event") == "start":
                break
    return {}


def with_keys_of(config: SwarmConfig, keys: SwarmConfig) -> SwarmConfig:
    """Return a configuration with the keys of another, by the names of links and cars."""
    links = {link.name: link.key for link in keys.links}
    cars = {car.node: car.key for car in keys.cars}
    return replace(
        config,
        links=tuple(replace(link, key=links.get(link.name, link.key)) for link in config.links),
        cars=tuple(replace(car, key=cars.get(car.node, car.key)) for car in config.cars),
    )
