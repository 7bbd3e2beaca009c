"""Track a live swarm, from opening to closing its ports."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

from agents.errors import UsageError
from agents.hardware.live.checks import Checks
from agents.hardware.live.monitor import Monitor
from agents.hardware.live.result import LiveResult
from hardware_bridge.config import SwarmConfig, known_by, read_config
from hardware_bridge.live.bridge import Bridge
from hardware_bridge.live.feed import LiveFeed
from hardware_bridge.live.swarm import load_calibration

Watch = Callable[[Monitor, list[tuple[float, str]]], bool | None]
"""Callback with the monitor and the new notices, time [s] and text; False ends the run."""


def live(
    config: SwarmConfig | Path | str,
    *,
    node: int | None = None,
    seconds: float | None = None,
    record: Path | str | None = None,
    watch: Watch | None = None,
    keep: bool = True,
) -> LiveResult:
    """Track a live swarm without driving it.

    Args:
        config: Path of a swarm.toml, or the result of `read_config`.
        node: Node by whose own messages the swarm is tracked, see `known_by`; None tracks it by
            those of all.
        seconds: Length [s]; None runs until Ctrl-C.
        record: File for a recording.
        watch: Called after every decision.
        keep: Whether the result has the estimates of all decisions.

    Raises:
        BridgeError: A part of the swarm cannot be used.
        UsageError: The length is out of range.
    """
    if seconds is not None and not 0.0 < seconds < float("inf"):
        raise UsageError(f"seconds: expected a number above 0, got {seconds:g}")
    swarm = config if isinstance(config, SwarmConfig) else read_config(config)
    if node is not None:
        swarm = known_by(swarm, node)
    notices: list[tuple[float, str]] = []
    checks = Checks(swarm.name, swarm.constellation, load_calibration(swarm))
    with contextlib.closing(checks), Bridge(swarm, record=record) as bridge:
        measures = swarm.tracker.source == "measurements"
        monitor = Monitor(bridge.swarm, estimates=keep, checks=checks if measures else None)
        with contextlib.suppress(KeyboardInterrupt):
            _listen(bridge, monitor, seconds, watch, notices)
        notices += _drain(bridge.feed, monitor)
        recorder, n_late = bridge.recorder, bridge.feed.n_late
    intake = monitor.swarm.intake
    return LiveResult(
        name=swarm.name,
        start_ns=intake.start_ns,
        seconds=intake.seconds(monitor.t_ns),
        decisions=monitor.decisions,
        late_decisions=n_late,
        t_ns=monitor.history.t_ns,
        estimate=monitor.history.estimate,
        counts=monitor.counts,
        streams=tuple(monitor.streams),
        notices=tuple(notices),
        findings=tuple(checks.findings),
        recording=None if record is None else str(record),
        # Final only after the recorder was closed.
        recording_lost=None if recorder is None else recorder.lost,
    )


def _listen(
    bridge: Bridge,
    monitor: Monitor,
    seconds: float | None,
    watch: Watch | None,
    notices: list[tuple[float, str]],
) -> None:
    """Run decisions until the time is up or `watch` returns False."""
    intake = bridge.swarm.intake
    while seconds is None or intake.seconds(monitor.t_ns) < seconds:
        t_ns = bridge.feed.advance()
        bridge.swarm.step(t_ns)
        for text in monitor.after_step(t_ns):
            bridge.feed.note(t_ns, text)
        new = _drain(bridge.feed, monitor)
        notices += new
        if watch is not None and watch(monitor, new) is False:
            return


def _drain(feed: LiveFeed, monitor: Monitor) -> list[tuple[float, str]]:
    """Return the notices since the last call, times in seconds since the start."""
    notices = [(monitor.swarm.intake.seconds(t_ns), text) for t_ns, text in feed.notices]
    feed.notices.clear()
    return notices
