"""Which node a device is."""

import pytest

from hardware_bridge.live.naming import node_of

IDS = {"0": 1, "1": 2, "989C": 3}


@pytest.mark.parametrize(("device", "ids", "mixed", "node"), [
    (None, {}, False, 9), ("4", {}, False, 4), ("0010", {}, False, 10), ("989C", {}, False, None),
    ("\u0664", {}, False, None), ("", {}, False, None),
    ("0", IDS, False, 1), ("989C", IDS, False, 3), ("4", IDS, False, None), ("3", IDS, False, None),
    ("4", IDS, True, 4), ("3", IDS, True, None), ("2", IDS, True, None), ("0", IDS, True, 1),
])  # fmt: skip
def test_ids_of_a_link_are_all_that_counts_where_there_are_some(device, ids, mixed, node):
    assert node_of(device, 9, ids, mixed=mixed) == node
