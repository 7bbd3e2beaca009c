"""Connection of the tracker and of policies to real nodes and cars.

    nodes -> links -> decoders -> identity, clocks, plausibility -> live -> policy
    cars  <- links <- drivers  <- safety (separate process)      <-

`config`
    swarm.toml: the nodes of the group, the ports and the permitted actions.
`links`
    Serial ports and TCP connections: bytes with the time of arrival.
`decoders`, `readings`, `wire`
    Bytes of devices to readings in SI units; our own wire format and its C header.
`identity`, `clocks`, `plausibility`
    The device that sent a reading, the host time of its measurement, and plausibility checks.
`ingest`, `external_tracker`
    Readings to measurements of nodes; positions from an external tracker.
`live`
    Trackers of a swarm, the environment on real cars, the start-up of a drive.
`drivers`
    Speed and steering to bytes for motor controllers.
`safety`
    The gate that checks every command, and the process that owns the ports of the cars.
`recording`, `exports`
    Recordings of every byte, and runs in the formats of other programs.
`emulator`
    Emulated nodes and cars behind ports, and their faults.

Host time is nanoseconds of a monotonic clock and always an argument; only owners of a port or a
process read the clock. Errors that a user can correct are `errors.BridgeError`.
docs/explanation/architecture.md has a diagram.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_MODULES = {
    "Bridge": "hardware_bridge.live.bridge",
    "BridgeError": "hardware_bridge.errors",
    "HardwareFormationEnv": "hardware_bridge.live.env",
    "open_replay": "hardware_bridge.live.replay",
    "read_config": "hardware_bridge.config",
    "read_recording": "hardware_bridge.recording.reader",
}
"""Module of each name, imported on first use."""

__all__ = [
    "Bridge", "BridgeError", "HardwareFormationEnv", "open_replay", "read_config", "read_recording",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)
