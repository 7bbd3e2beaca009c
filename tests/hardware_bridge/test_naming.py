"""Assignment of devices to nodes."""

import pytest

from hardware_bridge.config.keys import node_id
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.naming import node_of
from hardware_bridge.wire.definition import HOST
from tracking.params.tables import Where

IDS = {"0": 1, "1": 2, "989C": 3}


@pytest.mark.parametrize(("device", "ids", "mixed", "node"), [
    (None, {}, False, 9), ("4", {}, False, 4), ("0010", {}, False, 10), ("989C", {}, False, None),
    ("\u0664", {}, False, None), ("", {}, False, None),
    ("0", IDS, False, 1), ("989C", IDS, False, 3), ("4", IDS, False, None), ("3", IDS, False, None),
    ("4", IDS, True, 4), ("3", IDS, True, None), ("2", IDS, True, None), ("0", IDS, True, 1),
])  # fmt: skip
def test_ids_of_a_link_are_all_that_counts_where_there_are_some(device, ids, mixed, node):
    assert node_of(device, 9, ids, mixed=mixed) == node


def test_no_node_has_the_id_of_the_host():
    """A driver for that id would otherwise fail with a traceback."""
    where = Where("swarm.toml", raises=BridgeError)
    assert node_id(str(HOST - 1), where) == HOST - 1
    with pytest.raises(BridgeError, match="expected an id from 0 to 65534"):
        node_id(str(HOST), where)
