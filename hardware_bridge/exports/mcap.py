"""A run as an MCAP file with messages of ROS 2, for Foxglove, PlotJuggler, rosbag2 and others."""

from __future__ import annotations

from heapq import merge
from pathlib import Path
from typing import Any

from hardware_bridge.errors import BridgeError
from hardware_bridge.exports.ros_definitions import definition
from hardware_bridge.exports.ros_estimates import estimate_messages
from hardware_bridge.exports.ros_measurements import measurement_messages
from hardware_bridge.exports.tum import check_reference
from hardware_bridge.exports.whole import whole_file
from tracking.constellation import Constellation
from tracking.estimate import TeamEstimate
from tracking.measurements import MeasurementBlock


def export_mcap(
    path: Path | str,
    block: MeasurementBlock,
    constellation: Constellation,
    estimate: TeamEstimate | None = None,
    *,
    reference: int | None = None,
    offset_ns: int = 0,
    notes: dict[str, str] | None = None,
) -> int:
    """Write measurements and estimates, in order of time.

    Args:
        path: A new file.
        block: Of one environment, in any order.
        constellation: Who took part.
        estimate: Arrays over (time, ...).
        reference: Id of the node at the origin of the frame ``map``; default: the first.
        offset_ns: [ns] Added to every time, `Header.wall_ns` for UTC.
        notes: Written as metadata ``relpos``.

    Returns:
        Messages in the file.

    Raises:
        BridgeError: The file exists or cannot be written, no such node, a time that ROS cannot
            say, or the libraries of MCAP are not installed.
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError as error:
        raise BridgeError(
            "MCAP needs the libraries mcap and mcap-ros2-support: "
            "pip install 'relpos-env[hardware]'"
        ) from error
    if block.n_envs != 1:
        raise BridgeError(f"block: expected one environment, got {block.n_envs}")
    reference = constellation.ids[0] if reference is None else reference
    check_reference(constellation, reference)
    streams = [measurement_messages(block, constellation, offset_ns)]
    if estimate is not None:
        streams.append(estimate_messages(estimate, reference, offset_ns))
    schemas: dict[str, Any] = {}
    counts: dict[str, int] = {}
    with whole_file(path) as scratch, open(scratch, "xb") as file, Writer(file) as writer:
        if notes:
            writer.add_metadata("relpos", notes)
        for message in merge(*streams, key=lambda one: one.t_ns):
            if message.type not in schemas:
                schemas[message.type] = writer.register_msgdef(
                    message.type, definition(message.type)
                )
            n = counts.get(message.topic, 0)
            writer.write_message(
                message.topic, schemas[message.type], message.content, message.t_ns, sequence=n
            )
            counts[message.topic] = n + 1
    return sum(counts.values())
