"""The simulator reports joins and leaves as the radio protocol detects them."""

import numpy as np
import pytest

from agents.evaluation.suites import SUITES
from tracking.log import read_log, write_log
from tracking.measurements import Kind


@pytest.fixture(scope="module")
def log():
    case = next(c for c in SUITES["robustness"].cases if c.name == "come-and-go")
    return case.log(3, 60.0)


def events(log, kind, node):
    block = log.block
    return block.t[0][(block.kind[0] == kind) & (block.i[0] == node)]


def test_every_car_joins_and_who_is_taken_out_leaves_until_it_is_back(log):
    t = log.truth.times()
    _, present = log.truth.positions(log.constellation, t)
    gone = 0
    for node in range(log.constellation.n_nodes):
        joins, leaves = (events(log, kind, node) for kind in (Kind.JOIN, Kind.LEAVE))
        assert len(joins)
        assert joins[0] < 1.0
        assert 0 <= len(joins) - len(leaves) <= 1
        changes = np.nonzero(np.diff(present[:, node].astype(int)))[0]
        for k in changes:
            if present[k, node]:
                ends = t[changes[changes > k]][:1]
                back = float(ends[0]) if len(ends) else t[-1]
                if back - t[k] > 3.0:
                    gone += 1
                    assert ((leaves > t[k] + 0.5) & (leaves < t[k] + 3.0)).any()
            elif t[-1] - t[k] > 3.0:
                assert ((joins > t[k]) & (joins < t[k] + 3.0)).any()
    assert gone > 0


def test_a_log_folder_keeps_them(log, tmp_path):
    write_log(tmp_path / "log", log)
    again = read_log(tmp_path / "log")
    for kind in (Kind.JOIN, Kind.LEAVE):
        for node in range(log.constellation.n_nodes):
            np.testing.assert_array_equal(events(again, kind, node), events(log, kind, node))
