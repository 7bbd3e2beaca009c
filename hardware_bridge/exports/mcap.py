"""Export of a run as an MCAP file with ROS 2 messages, for Foxglove, PlotJuggler, rosbag2."""

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
        path: File to create.
        block: Measurements of one environment, in any order.
        constellation: Nodes of the run.
        estimate: Estimates, arrays over (time, ...).
        reference: Id of the node at the origin of the frame ``map``; default: the first.
        offset_ns: Offset added to every time [ns], `Header.wall_ns` for UTC.
        notes: Metadata to write as ``relpos``.

    Returns:
        Number of messages in the file.

    Raises:
        BridgeError: The file exists or cannot be written, the node is unknown, a time is outside of
            the range of ROS, or the MCAP libraries are not installed.
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError as error:
        raise BridgeError(
            "MCAP needs the libraries mcap and mcap-ros2-support: "
            "pip install -e '.[hardware]' in its source folder"
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
