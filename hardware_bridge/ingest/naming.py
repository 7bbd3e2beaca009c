"""Which node of the group a device is, by what its format and the configuration call it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from hardware_bridge.ingest.stream import Stream
from tracking.constellation import Constellation

MOST_STRANGERS = 32
"""Devices that are not in the configuration are told of so many times."""


def node_of(
    device: str | None, speaker: int | None, ids: Mapping[str, int], *, mixed: bool = False
) -> int | None:
    """Id of the node that a device is; None where the configuration makes it none.

    Args:
        device: As its format writes it; None is the sender.
        speaker: Id of who does, None for unknown.
        ids: Of the link. Where it has some, a device that is not among them is unknown.
        mixed: Others go by the ids of nodes, too, but for those that `ids` gives to a device.
    """
    if device is None:
        return speaker
    if device in ids:
        return ids[device]
    if (ids and not mixed) or not (device.isascii() and device.isdigit()):
        return None
    return None if int(device) in ids.values() else int(device)


class Naming:
    """Names of devices to indices of nodes; strangers are counted, and told of once."""

    def __init__(
        self, group: Constellation, refused: Counter[str], notices: list[tuple[int, str]]
    ) -> None:
        """Begin with no device received.

        Args:
            group: Whose nodes they are.
            refused: Counts strangers.
            notices: Gets a line on each.
        """
        self._group, self._refused, self._notices = group, refused, notices
        self._strangers: set[tuple[str, str]] = set()

    def index(
        self,
        stream: Stream,
        device: str | None,
        t_ns: int,
        *,
        named: bool = False,
        mixed: bool = False,
    ) -> int | None:
        """Index of the node that a device is; None for strangers.

        Args:
            stream: That tells of it.
            device: As its format writes it; None is the sender on this stream.
            t_ns: Now, by the host's clock [ns].
            named: Another device names it.
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
        self._refused["stranger"] += 1
        who = (stream.name, device)
        if who in self._strangers or len(self._strangers) >= MOST_STRANGERS:
            return
        self._strangers.add(who)
        text = f"{stream.name}: device {device} is no node of the configuration; name it in its ids"
        if stream.is_car:
            text = f"{stream.name}: device {device} speaks on its line, and is not that car"
        self._notices.append((t_ns, text))
