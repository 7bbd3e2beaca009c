"""From what was heard on a port to what is wrong with it, and what to do."""

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
"""The format whose lines name nodes by their ids next to names of `ids`."""
MOST_DAMAGED = 0.05
"""[-] A larger share of damaged frames is a problem."""
MOST_MISSING = 0.05
"""[-] A larger share of messages that did not arrive is a problem."""
LONGEST_GAP = 1.0
"""[s] A longer silence of a stream is a problem, unless it comes that seldom anyway."""
USUAL_GAPS = 5.0
"""[-] Silence that a stream may have, in mean times between its pieces."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeReport:
    """A node, or a device that is none, as one link hears it."""

    node: str
    """Id of the node; of a device that is no node its own id."""
    known: bool
    """Whether the configuration makes a node of it."""
    imu_hz: float
    ranges_hz: dict[str, float]
    """How often [1/s] to which other node, ``2``, or between which two, ``2-3``."""
    positions_hz: float
    """How often another tracker tells of it [1/s]."""
    missing_share: float
    """Messages that did not arrive [-], by their numbers; 0 where they have none."""
    boots: int
    """Starts that were heard; more than one means that it went off meanwhile."""


@dataclass(slots=True, kw_only=True)
class LinkReport:
    """A link or a car, listened to."""

    name: str
    port: str
    format: str
    """What the configuration says: a format, or the driver of a car."""
    up: bool
    bytes_hz: float = 0.0
    frames_hz: float = 0.0
    damaged_share: float = 0.0
    gap_s: float = 0.0
    """Longest silence after the first byte."""
    speaks: str | None = None
    """The format that fits best, if any does."""
    nodes: list[NodeReport] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """What is wrong and what to do, one line each."""

    @property
    def ok(self) -> bool:
        """Whether nothing needs mending."""
        return not self.problems

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
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
    """A stream that measures.

    Args:
        link: Its configuration.
        hearing: What was heard.
        formats: All formats.
        seconds: How long [s].
        down: Why the port is not open; empty if it is.
        losses: How often the port was lost meanwhile.
        nodes: Those of the configuration, by id.
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
        report.problems += _strangers(link, voices)
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
    """The port of a car; that it says nothing is no fault, since nothing is asked of it."""
    report = _report(car.port.name, car.port.port, car.driver, hearing, seconds, down)
    if down:
        report.problems.append(down)
    elif report.speaks is not None and report.speaks != car.driver:
        report.problems.append(
            f"speaks {report.speaks}, which is no car: swap the port with the one of that tracker"
        )
    if losses:
        report.problems.append(_lost(losses))
    return report


def share_a_device(reports: list[LinkReport]) -> None:
    """Note nodes whose samples, or whose ranges, come on two links."""
    first: dict[tuple[str, str], LinkReport] = {}
    for report in reports:
        for node in report.nodes:
            if not node.known or node.positions_hz:
                continue  # who is told of does not speak
            says = {"samples": node.imu_hz > 0.0, "ranges": bool(node.ranges_hz)}
            others = {first.setdefault((node.node, k), report).name for k, v in says.items() if v}
            for name in sorted(others - {report.name}):
                report.problems.append(
                    f"node {node.node} speaks on {name} too: give the devices ids of their "
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
        speaks=hearing.best(form),
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
    """The other end, or both where the speaker is neither."""
    names = [end for end in ends if end is not None]
    nodes = [_node_of(name, link) for name in names]
    return "-".join(name if n is None else str(n) for name, n in zip(names, nodes, strict=True))


def _fatal(
    link: LinkLike, hearing: Hearing, formats: Formats, report: LinkReport, down: str
) -> str:
    """What makes a link useless; empty if nothing does."""
    if down and not hearing.n_bytes:
        return down
    if not hearing.n_bytes:
        return (
            "silent: see that the device has power, its stream is switched on, and its TX is "
            "wired to RX"
        )
    if report.speaks not in (None, link.format):
        return (
            f"speaks {report.speaks}, configured {link.format}: "
            f'set format = "{report.speaks}", or correct the port'
        )
    if hearing.frames(link.format):
        return ""
    if link.key is not None and hearing.damaged_share(link.format) > 0.0:
        return "every message is refused: set `key` to the one that the device has"
    return why_nothing_fits(hearing, link.port.baud, formats)


def _flaws(report: LinkReport, hearing: Hearing, seconds: float) -> list[str]:
    """What is wrong with a stream that can be read."""
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
    """What IMUs read that they cannot at rest."""
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
    """Nodes whose samples come at another rate than the configured one."""
    if seconds < WINDOW or report.gap_s > PAUSE:
        return []  # too short to say, or there were none for a while
    return [
        f"node {node.node}: {node.imu_hz:.0f} inertial samples a second, configured "
        f"{nodes[int(node.node)].imu_hz:g}: set imu_hz, or orientations lag behind"
        for node in report.nodes
        if node.known and node.imu_hz > 0.0 and is_off(node.imu_hz, nodes[int(node.node)].imu_hz)
    ]


def _strangers(link: LinkLike, voices: Mapping[str | None, Voice]) -> list[str]:
    """Devices that the configuration makes no node of."""
    heard: dict[str | None, None] = {}
    for device, voice in voices.items():
        heard[device] = None
        heard.update(dict.fromkeys(end for ends in voice.ranges for end in ends if end))
    names = [d for d in heard if _node_of(d, link) is None]
    flaws = [f'device {d} is no node: add `ids = {{ "{d}" = NODE }}`' for d in names if d]
    if None in names:
        flaws.append("the format does not say who speaks: set `node`")
    return flaws


def _lost(losses: int) -> str:
    times = "once" if losses == 1 else f"{losses} times"
    return f"lost {times} while listening: see plug, cable and hub"
