"""Problems of a port and their remedies, from the received data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from agents.hardware.inspection.hearing import Formats, Hearing, Voice, why_nothing_fits
from agents.hardware.inspection.inspected import CarLike, LinkLike
from hardware_bridge.ingest.naming import node_of
from hardware_bridge.ingest.sample_rates import PAUSE, WINDOW, is_off
from tracking.constellation import NodeConfig
from tracking.findings import KINDS
from tracking.findings.at_rest import find_in_samples

TELLS_OF_OTHERS = "positions"
"""Format whose lines identify nodes by node id or by a name of `ids`."""
MOST_DAMAGED = 0.05
"""[-] Largest acceptable share of damaged frames."""
MOST_MISSING = 0.05
"""[-] Largest acceptable share of lost messages."""
LONGEST_GAP = 1.0
"""[s] Longest acceptable gap of a stream, unless its chunks usually come that rarely."""
USUAL_GAPS = 5.0
"""[-] Longest acceptable gap in mean times between chunks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeReport:
    """A node, or an unconfigured device, as received on one link."""

    node: str
    """Id of the node, or of the device if it is no node."""
    known: bool
    """True if the configuration assigns it to a node."""
    imu_hz: float
    ranges_hz: dict[str, float]
    """[Hz] Rate of ranges by other node, ``2``, or by pair of nodes, ``2-3``."""
    positions_hz: float
    """[Hz] Rate of its positions or relative positions from another tracker."""
    missing_share: float
    """[-] Share of lost messages by sequence number; 0 without sequence numbers."""
    boots: int
    """[-] Number of boots seen; more than one means that it restarted while listening."""


@dataclass(slots=True, kw_only=True)
class LinkReport:
    """Report on a link or a car."""

    name: str
    port: str
    format: str
    """Configured format of a link, or driver of a car."""
    up: bool
    bytes_hz: float = 0.0
    frames_hz: float = 0.0
    damaged_share: float = 0.0
    gap_s: float = 0.0
    """[s] Longest gap after the first byte."""
    detected_format: str | None = None
    """Detected format; None if none fits."""
    nodes: list[NodeReport] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """Problems with their remedies, one line each."""

    @property
    def ok(self) -> bool:
        """True if there is no problem."""
        return not self.problems

    @property
    def record(self) -> dict[str, Any]:
        """JSON record."""
        return {"kind": "link", **asdict(self), "ok": self.ok}


def diagnose_link(
    link: LinkLike,
    hearing: Hearing,
    formats: Formats,
    *,
    seconds: float,
    down: str,
    losses: int,
    nodes: Mapping[int, NodeConfig],
) -> LinkReport:
    """Return the report on the link of measuring devices.

    Args:
        link: Configuration of the link.
        hearing: Received data.
        formats: All formats.
        seconds: Duration of listening [s].
        down: Reason why the port is not open; empty if it is open.
        losses: Number of times the port was lost while listening.
        nodes: Nodes of the configuration by id.
    """
    report = _report(link.port.name, link.port.port, link.format, hearing, seconds, down)
    voices = hearing.voices.get(link.format, {})
    report.nodes = sorted(
        (_node(device, voice, link, seconds) for device, voice in voices.items()),
        key=lambda n: (len(n.node), n.node),
    )
    fatal = _fatal(link, hearing, formats, report, down)
    if fatal:
        report.problems.append(fatal)
    else:
        report.problems += _flaws(report, hearing, seconds)
        report.problems += _wrong_rates(report, nodes, seconds)
        report.problems += _wrong_samples(link, voices, nodes)
        report.problems += _unassigned_devices(link, voices)
    if losses:
        report.problems.append(_lost(losses))
    return report


def diagnose_car(
    car: CarLike,
    hearing: Hearing,
    formats: Formats,
    *,
    seconds: float,
    down: str,
    losses: int,
) -> LinkReport:
    """Return the report on a car. A silent car is no problem, since it is not polled."""
    report = _report(car.port.name, car.port.port, car.driver, hearing, seconds, down)
    if down:
        report.problems.append(down)
    elif report.detected_format is not None and report.detected_format != car.driver:
        report.problems.append(
            f"sends {report.detected_format}, which is no car: swap the port with the one of that "
            "tracker"
        )
    if losses:
        report.problems.append(_lost(losses))
    return report


def share_a_device(reports: list[LinkReport]) -> None:
    """Add a problem for each node whose samples or ranges arrive on two links."""
    first: dict[tuple[str, str], LinkReport] = {}
    for report in reports:
        for node in report.nodes:
            if not node.known or node.positions_hz:
                continue  # reported by another tracker, it sends nothing itself
            says = {"samples": node.imu_hz > 0.0, "ranges": bool(node.ranges_hz)}
            others = {first.setdefault((node.node, k), report).name for k, v in says.items() if v}
            for name in sorted(others - {report.name}):
                report.problems.append(
                    f"node {node.node} sends on {name} too: give the devices ids of their "
                    "own, or correct `ids` and `node` of the two links"
                )


def _report(
    name: str, port: str, form: str, hearing: Hearing, seconds: float, down: str
) -> LinkReport:
    return LinkReport(
        name=name,
        port=port,
        format=form,
        up=not down,
        bytes_hz=hearing.n_bytes / seconds,
        frames_hz=hearing.frames(form) / seconds,
        damaged_share=hearing.damaged_share(form),
        gap_s=hearing.longest_gap_ns / 1e9,
        detected_format=hearing.best(form),
    )


def _node(device: str | None, voice: Voice, link: LinkLike, seconds: float) -> NodeReport:
    node = _node_of(device, link)
    total = voice.numbered + voice.missing
    return NodeReport(
        node=str(node) if node is not None else str(device),
        known=node is not None,
        imu_hz=voice.imu / seconds,
        ranges_hz={_label(ends, link): n / seconds for ends, n in voice.ranges.items()},
        positions_hz=voice.positions / seconds,
        missing_share=voice.missing / total if total else 0.0,
        boots=voice.boots,
    )


def _node_of(device: str | None, link: LinkLike) -> int | None:
    return node_of(device, link.node, link.ids, mixed=link.format == TELLS_OF_OTHERS)


def _label(ends: tuple[str | None, str], link: LinkLike) -> str:
    """Return the other end of a range, or both ends if the reporting device is neither."""
    names = [end for end in ends if end is not None]
    nodes = [_node_of(name, link) for name in names]
    return "-".join(name if n is None else str(n) for name, n in zip(names, nodes, strict=True))


def _fatal(
    link: LinkLike, hearing: Hearing, formats: Formats, report: LinkReport, down: str
) -> str:
    """Return the problem that makes a link unusable; empty if there is none."""
    if down and not hearing.n_bytes:
        return down
    if not hearing.n_bytes:
        return (
            "silent: see that the device has power, its stream is switched on, and its TX is "
            "wired to RX"
        )
    if report.detected_format not in (None, link.format):
        return (
            f"sends {report.detected_format}, configured {link.format}: "
            f'set format = "{report.detected_format}", or correct the port'
        )
    if hearing.frames(link.format):
        return ""
    if link.key is not None and hearing.damaged_share(link.format) > 0.0:
        return "every message is refused: set `key` to the one that the device has"
    return why_nothing_fits(hearing, link.port.baud, formats)


def _flaws(report: LinkReport, hearing: Hearing, seconds: float) -> list[str]:
    """Return the problems of a stream that can be decoded."""
    flaws = []
    if report.damaged_share > MOST_DAMAGED:
        flaws.append(
            f"{100 * report.damaged_share:.0f} % of the frames are damaged: shorten the cable, "
            "see that both ends have the same baud rate and a common ground"
        )
    if report.gap_s > max(LONGEST_GAP, USUAL_GAPS * seconds / max(1, hearing.chunks)):
        flaws.append(f"silent for {report.gap_s:.1f} s: see the plug and the device's power")
    for node in report.nodes:
        if node.missing_share > MOST_MISSING:
            flaws.append(
                f"node {node.node}: {100 * node.missing_share:.0f} % of its messages did not "
                "arrive: lower its rates, or raise the baud rate"
            )
        if node.boots > 1:
            flaws.append(f"node {node.node} started {node.boots} times: see its power")
    return flaws


def _wrong_samples(
    link: LinkLike, voices: Mapping[str | None, Voice], nodes: Mapping[int, NodeConfig]
) -> list[str]:
    """Return the problems of IMU samples that are implausible at rest."""
    problems = []
    for device, voice in voices.items():
        known = _node_of(device, link)
        if known is None or known not in nodes or not voice.samples:
            continue
        node = nodes[known]
        turn = node.imu_axes.turn
        values = np.array(voice.samples)
        values = np.concatenate([turn(values[:, :3]), turn(values[:, 3:])], axis=1)
        for found in find_in_samples(node, np.arange(len(values)) / node.imu_hz, values):
            if found.severity != "note":
                problems.append(f"{found.text}: {KINDS[found.name].remedy}")
    return problems


def _wrong_rates(report: LinkReport, nodes: Mapping[int, NodeConfig], seconds: float) -> list[str]:
    """Return the nodes whose sample rate differs from the configured one."""
    if seconds < WINDOW or report.gap_s > PAUSE:
        return []  # listened too briefly, or the stream paused
    return [
        f"node {node.node}: {node.imu_hz:.0f} inertial samples a second, configured "
        f"{nodes[int(node.node)].imu_hz:g}: set imu_hz, or orientations lag behind"
        for node in report.nodes
        if node.known and node.imu_hz > 0.0 and is_off(node.imu_hz, nodes[int(node.node)].imu_hz)
    ]


def _unassigned_devices(link: LinkLike, voices: Mapping[str | None, Voice]) -> list[str]:
    """Return the devices that the configuration does not assign to a node."""
    devices: dict[str | None, None] = {}
    for device, voice in voices.items():
        devices[device] = None
        devices.update(dict.fromkeys(end for ends in voice.ranges for end in ends if end))
    names = [d for d in devices if _node_of(d, link) is None]
    flaws = [f'device {d} is no node: add `ids = {{ "{d}" = NODE }}`' for d in names if d]
    if None in names:
        flaws.append("the format does not name the sender: set `node`")
    return flaws


def _lost(losses: int) -> str:
    times = "once" if losses == 1 else f"{losses} times"
    return f"lost {times} while listening: see plug, cable and hub"
