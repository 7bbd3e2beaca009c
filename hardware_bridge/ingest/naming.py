"""Assignment of devices to nodes of the group, by the names in their format and configuration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from hardware_bridge.ingest.stream import Stream
from tracking.constellation import Constellation

MAX_UNKNOWN_DEVICES = 32
"""[-] Largest number of devices outside of the configuration that are reported."""


def node_of(
    device: str | None, sender: int | None, ids: Mapping[str, int], *, mixed: bool = False
) -> int | None:
    """Return the id of the node that a device is; None if the configuration assigns none.

    Args:
        device: Name of the device as its format writes it; None for the sender.
        sender: Node id of the sender, None if unknown.
        ids: Node ids by device name of the link. If any are given, other devices are unknown.
        mixed: True if other devices may also be named by node ids that `ids` does not contain.
    """
    if device is None:
        return sender
    if device in ids:
        return ids[device]
    if (ids and not mixed) or not (device.isascii() and device.isdigit()):
        return None
    return None if int(device) in ids.values() else int(device)


class Naming:
    """Mapping of device names to node indices; unknown devices are counted and reported once."""

    def __init__(
        self, group: Constellation, refused: Counter[str], notices: list[tuple[int, str]]
    ) -> None:
        """Create a mapping without received devices.

        Args:
            group: The nodes.
            refused: Counter of refused readings; unknown devices are counted here.
            notices: List of notices; each unknown device is reported here.
        """
        self._group, self._refused, self._notices = group, refused, notices
        self._unknown_devices: set[tuple[str, str]] = set()

    def index(
        self,
        stream: Stream,
        device: str | None,
        t_ns: int,
        *,
        named: bool = False,
        mixed: bool = False,
    ) -> int | None:
        """Return the index of the node that a device is; None for unknown devices.

        Args:
            stream: Stream that names the device.
            device: Name of the device as its format writes it; None for the sender on this stream.
            t_ns: Current host time [ns].
            named: True if another device names it.
            mixed: See `node_of`.
        """
        node = node_of(device, stream.node, stream.ids, mixed=mixed)
        if not named and not stream.ids and stream.node is not None:
            node = stream.node
        index = None if node is None else self._group.index_of.get(node)
        if index is None:
            self._tell(stream, device or "?", t_ns)
        return index

    def _tell(self, stream: Stream, device: str, t_ns: int) -> None:
        self._refused["unknown_device"] += 1
        who = (stream.name, device)
        if who in self._unknown_devices or len(self._unknown_devices) >= MAX_UNKNOWN_DEVICES:
            return
        self._unknown_devices.add(who)
        text = f"{stream.name}: device {device} is no node of the configuration; name it in its ids"
        if stream.is_car:
            text = f"{stream.name}: device {device} sends on its line, and is not that car"
        self._notices.append((t_ns, text))
