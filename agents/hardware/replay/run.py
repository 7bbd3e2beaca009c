"""Replay a recording: the same bytes through the same software give the same estimates."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from agents.errors import UsageError
from agents.hardware.live.monitor import Monitor
from agents.hardware.live.run import Watch
from agents.hardware.replay.result import ReplayResult
from agents.hardware.replay.truth import score_replay, truth_of
from hardware_bridge.config import SwarmConfig, read_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.live.replay import ReplayFeed
from hardware_bridge.recording import Kind, Recording, read_recording
from tracking.log import Log, read_log

SLOWEST, FASTEST = 1e-3, 1e6
"""[-] Limits of the replay speed, in multiples of real time."""


def replay(
    recording: Recording | Path | str,
    *,
    speed: float | None = None,
    filter: str | None = None,
    keys: SwarmConfig | Path | str | None = None,
    truth: Log | Path | str | None = None,
    truth_offset: float | None = None,
    skip: float = 10.0,
    keep: bool = True,
    watch: Watch | None = None,
    clock: Callable[[], int] = time.monotonic_ns,
    sleep: Callable[[float], None] = time.sleep,
) -> ReplayResult:
    """Track a recording as it was tracked live, up to its readable end.

    Args:
        recording: A file, or the result of `read_recording`.
        speed: Replay speed in multiples of real time; None is as fast as possible.
        filter: Filter that replaces the recorded one.
        keys: Original swarm.toml for the keys of signed messages, which a recording does not
            hold; None does not check signatures.
        truth: A log with the truth, or its folder.
        truth_offset: Offset from times of the truth to times of the recording, which start at 0
            [s]; None estimates it, see `agents.hardware.replay.truth.find_offset`.
        skip: Time after the first range that is not scored [s].
        keep: Whether the result has all estimates and measurements; always True with `truth`.
        watch: Called after every decision; ends the replay by returning False.
        clock: Monotonic clock [ns].
        sleep: Sleeps for a number of seconds.

    Raises:
        BridgeError: Not a recording, one with a damaged header, or without any decision.
        ConfigError: No such filter.
        LogError: The truth cannot be read.
        UsageError: A number is out of range, or the truth does not fit the recording.
    """
    if speed is not None and not SLOWEST <= speed <= FASTEST:
        raise UsageError(f"speed: expected {SLOWEST:g} to {FASTEST:g}, got {speed:g}")
    read = recording if isinstance(recording, Recording) else read_recording(recording)
    pace = None if speed is None else _Pace(speed, read.header.monotonic_ns, clock, sleep)
    if keys is not None and not isinstance(keys, SwarmConfig):
        keys = read_config(keys)
    feed = ReplayFeed(read, pace, filter=filter, keys=keys)
    log = None
    if truth is not None:
        log = truth if isinstance(truth, Log) else read_log(truth)
        truth_of(log, feed.config.constellation)
    keep = keep or log is not None
    monitor = Monitor(feed.swarm, estimates=keep, measurements=keep)
    started = clock()
    notices, stopped = _run(feed, monitor, watch)
    elapsed = 1e-9 * (clock() - started)
    if not monitor.decisions:
        raise BridgeError(f"{read.path}: has no decision, so there is nothing to replay")
    estimate, block = monitor.history.estimate, monitor.block
    last = monitor.snapshot()
    scored = None
    if log is not None:
        scored = score_replay(estimate, block, log, offset=truth_offset, skip=skip)
    return ReplayResult(
        recording=read,
        config=feed.config,
        decisions=monitor.decisions,
        calibration=feed.calibration,
        t_ns=monitor.history.t_ns,
        estimate=estimate,
        block=block,
        last=last,
        counts=monitor.counts,
        streams=tuple(monitor.streams),
        notices=tuple(notices),
        lost=_lost(read),
        stopped=stopped,
        realtime_factor=last.t / max(elapsed, 1e-9),
        scored=scored,
    )


def _run(
    feed: ReplayFeed, monitor: Monitor, watch: Watch | None
) -> tuple[list[tuple[float, str]], bool]:
    """Run all decisions; return notices (time since the start [s], text) and if it was stopped."""
    intake = feed.swarm.intake
    notices: list[tuple[float, str]] = []
    try:
        while (t_ns := feed.advance()) is not None:
            feed.swarm.step(t_ns)
            monitor.after_step(t_ns)
            new = [(intake.seconds(at), text) for at, text in feed.notices]
            feed.notices.clear()
            notices += new
            if watch is not None and watch(monitor, new) is False:
                return notices, True
    except KeyboardInterrupt:
        return notices, True
    return notices, False


def _lost(recording: Recording) -> tuple[tuple[float, int, str], ...]:
    """Return the dropped records by the events of the recorder: time [s], number, reason."""
    lost = []
    for record in recording:
        event = recording.event(record) if record.kind == Kind.EVENT else {}
        if event.get("event") == "recording_lost":
            t = 1e-9 * (record.t_ns - recording.header.monotonic_ns)
            records = event.get("records", 0)
            n = records if isinstance(records, int) else 0
            lost.append((t, n, str(event.get("why", ""))))
    return tuple(lost)


class _Pace:
    """Wait until a decision is due at a multiple of real time."""

    def __init__(
        self,
        speed: float,
        start_ns: int,
        clock: Callable[[], int],
        sleep: Callable[[float], None],
    ) -> None:
        self._speed, self._start_ns = speed, start_ns
        self._clock, self._sleep = clock, sleep
        self._begun: int | None = None

    def __call__(self, t_ns: int) -> None:
        now = self._clock()
        if self._begun is None:
            # The loading time before the first decision is not caught up.
            self._begun = now - round((t_ns - self._start_ns) / self._speed)
        wait = self._begun + round((t_ns - self._start_ns) / self._speed) - now
        if wait > 0:
            self._sleep(wait * 1e-9)
