"""Inspect ports, links and cars before a drive (`relpos doctor`)."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from agents.errors import UsageError
from agents.hardware.inspection.diagnosis import (
    LinkReport,
    diagnose_car,
    diagnose_link,
    share_a_device,
)
from agents.hardware.inspection.hearing import Formats, Hearing, known_formats
from agents.hardware.inspection.inspected import ConfigLike
from hardware_bridge.links.links import Links
from hardware_bridge.links.port_list import (
    Listing,
    SerialPortInfo,
    list_serial_ports,
    permission_remedy,
)
from hardware_bridge.links.port_users import port_users

TURN = 0.05
"""[s] Longest wait for bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PortReport:
    """A serial port of this computer, inspected without opening it."""

    info: SerialPortInfo
    may_open: bool
    users: list[str]
    """Programs that have it open."""
    remedy: str
    """Remedy for missing permissions; empty if it may be opened."""

    @property
    def record(self) -> dict[str, Any]:
        """JSON record."""
        return {
            "kind": "port",
            "path": self.info.path,
            "by_id": self.info.by_id,
            "serial_number": self.info.serial_number,
            "maker": self.info.maker,
            "product": self.info.product,
            "may_open": self.may_open,
            "users": self.users,
            "ok": not self.remedy,
            "do": self.remedy,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """Findings on all ports, links and cars."""

    ports: list[PortReport]
    links: list[LinkReport] = field(default_factory=list)
    """Links, then cars, in the order of the configuration."""
    configured: bool = False
    """True if a configuration was given; then only its links and cars decide `ok`."""

    @property
    def ok(self) -> bool:
        """True if there is no problem."""
        if self.configured:
            return all(link.ok for link in self.links)
        return bool(self.ports) and all(not port.remedy for port in self.ports)

    @property
    def records(self) -> list[dict[str, Any]]:
        """JSON records, the verdict last; rates to 0.1 Hz, other figures to three decimals."""
        verdict = {"kind": "verdict", "ok": self.ok}
        found = [*(p.record for p in self.ports), *(each.record for each in self.links), verdict]
        return [_rounded(record) for record in found]


def _rounded(value: Any, name: str = "") -> Any:
    """Return a value rounded to the accuracy of a few seconds of listening."""
    if isinstance(value, dict):
        # Dictionaries of rates by node take the rounding of their own name.
        return {k: _rounded(v, name if name.endswith("_hz") else str(k)) for k, v in value.items()}
    if isinstance(value, list):
        return [_rounded(each, name) for each in value]
    if isinstance(value, float):
        return round(value, 1 if name.endswith("_hz") else 3)
    return value


def doctor(
    config: ConfigLike | None = None,
    *,
    seconds: float = 3.0,
    formats: Formats | None = None,
    listing: Listing = list_serial_ports,
    now_ns: Callable[[], int] = time.monotonic_ns,
) -> Diagnosis:
    """Inspect the ports, and listen to those of a configuration, without writing to any port.

    Args:
        config: Configuration whose links and cars are opened; None inspects the ports only.
        seconds: Duration of listening [s], 0.1 to 3600.
        formats: Formats to try on the received bytes; by default all known formats.
        listing: Lists the serial ports.
        now_ns: Monotonic clock of the host [ns].

    Raises:
        UsageError: `seconds` is out of range.
        BridgeError: Two links use the same device, or pyserial is not installed.
    """
    if not 0.1 <= seconds <= 3600.0:
        raise UsageError(f"--seconds: expected 0.1 to 3600, got {seconds:g}")
    ports = [_look_at(info) for info in listing()]
    if config is None:
        return Diagnosis(ports=ports)
    formats = known_formats() if formats is None else formats
    specs = [link.port for link in config.links] + [car.port for car in config.cars]
    hearings = {link.port.name: Hearing(formats, link.key) for link in config.links}
    hearings |= {car.port.name: Hearing(formats) for car in config.cars}
    Hearing.get_ready(formats)
    with Links(specs, now_ns, wait_for_ports=True) as links:
        listened = listen(links, hearings, seconds, now_ns)
        reasons = {spec.name: links.reason(spec.name) for spec in specs}
        losses = dict.fromkeys(reasons, 0)
        came_up: set[str] = set()
        for notice in links.drain_notices():
            if notice.up:
                came_up.add(notice.link)
            else:
                losses[notice.link] += notice.link in came_up
    reports = [
        diagnose_link(
            link,
            hearings[link.port.name],
            formats,
            seconds=listened,
            down=reasons[link.port.name],
            losses=losses[link.port.name],
            nodes={node.id: node for node in config.constellation.nodes},
        )
        for link in config.links
    ]
    share_a_device(reports)
    reports += [
        diagnose_car(
            car,
            hearings[car.port.name],
            formats,
            seconds=listened,
            down=reasons[car.port.name],
            losses=losses[car.port.name],
        )
        for car in config.cars
    ]
    return Diagnosis(ports=ports, links=reports, configured=True)


def listen(
    links: Links, hearings: Mapping[str, Hearing], seconds: float, now_ns: Callable[[], int]
) -> float:
    """Pass the bytes of all links to their hearings; return the elapsed time [s]."""
    start = now_ns()
    end = start + round(seconds * 1e9)
    while (left := end - now_ns()) > 0:
        for chunk in links.wait(min(TURN, left / 1e9)):
            hearings[chunk.link].take(chunk)
    stop = now_ns()
    for hearing in hearings.values():
        hearing.silent_until(stop)
    return (stop - start) / 1e9


def _look_at(info: SerialPortInfo) -> PortReport:
    may_open = os.access(info.path, os.R_OK | os.W_OK)
    return PortReport(
        info=info,
        may_open=may_open,
        users=port_users(info.path),
        remedy="" if may_open else permission_remedy(info.path),
    )
