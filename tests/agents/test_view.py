"""View: positions of the drawn objects, and their presence in a file."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from agents.errors import UsageError
from agents.hardware.live.snapshot import NodeRow, PairRow, Snapshot
from agents.hardware.view import open_viewer, scene


def pair(i, j, pos, status="ok", nlos=0.0):
    return PairRow(
        node_i=i, node_j=j, status=status, pos_w=pos, cov_w=(0.04, 0.01, 0.0), forward=None,
        left=None, up=None, distance=float(np.linalg.norm(pos)), std=0.2, age=0.1, nlos_prob=nlos,
    )  # fmt: skip


def node(k, heard=0.1):
    return NodeRow(
        node=k, message_age=heard, imu_hz=100.0, range_hz=50.0, voltage=None, heading=0.5
    )


SNAPSHOT = Snapshot(
    t_ns=10**9,
    t=1.0,
    nodes=(node(1), node(2), node(3, heard=None)),
    pairs=(
        pair(1, 2, (1.0, 2.0, 0.0)),
        pair(1, 3, (4.0, 0.0, 0.0), nlos=1.0),
        pair(2, 3, (3.0, -2.0, 0.0), status="lost"),
    ),
)


def test_nodes_stand_round_one_of_them():
    places, ellipses = scene.place(SNAPSHOT)
    np.testing.assert_array_equal(places[1], [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(places[3], [4.0, 0.0, 0.0])
    assert ellipses.keys() == {2, 3}
    # Node 1 has no estimates: another one is the centre.
    unknown = replace(SNAPSHOT.pairs[0], status="starting", pos_w=None)
    others = (unknown, replace(unknown, node_j=3), SNAPSHOT.pairs[2])
    places, _ = scene.place(replace(SNAPSHOT, pairs=others))
    assert places.keys() == {2, 3}
    assert scene.place(replace(SNAPSHOT, pairs=(unknown,))) == ({}, {})


def test_an_ellipse_is_that_of_the_covariance():
    cov = np.array([[0.09, 0.03], [0.03, 0.04]])
    line = scene.ellipse((0.09, 0.04, 0.03))[:, :2]
    squared = np.einsum("ki,ij,kj->k", line, np.linalg.inv(cov), line)
    np.testing.assert_allclose(squared, scene.SIGMAS**2)
    np.testing.assert_allclose(line[0], line[-1], atol=1e-12)


def test_colours_of_links():
    clear, blocked, lost = (scene.link_colour(p) for p in SNAPSHOT.pairs)
    assert (clear, blocked, lost) == (scene.SIGHT, scene.BLOCKED, scene.LOST)
    vague = replace(SNAPSHOT.pairs[0], status="ambiguous")
    assert scene.link_colour(vague) == scene.VAGUE


def test_a_file_has_what_was_shown(tmp_path):
    pytest.importorskip("rerun")
    file = tmp_path / "a.rrd"
    with open_viewer("three cars", file) as viewer:
        assert viewer.url is None
        viewer.show(SNAPSHOT, [(0.5, "links.n1 up")])
        viewer.show(replace(SNAPSHOT, t=2.0, pairs=()))
    command = [sys.executable, "-m", "rerun", "rrd"]
    subprocess.run([*command, "verify", str(file)], check=True, capture_output=True)
    stats = subprocess.run(
        [*command, "stats", str(file)], check=True, capture_output=True, text=True
    ).stdout
    for entity in ("plan/nodes", "plan/links", "plan/sigma", "distance/1-2", "nlos/2-3",
                   "ranges/3", "notices"):  # fmt: skip
        assert f"/{entity}: " in stats
    with pytest.raises(UsageError, match="exists already"):
        open_viewer("again", file)


def test_what_cannot_be_opened(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UsageError, match=r"pip install -e '\.\[view\]'"):
        open_viewer("none", tmp_path / "a.rrd")
    monkeypatch.undo()
    pytest.importorskip("rerun")
    with pytest.raises(UsageError, match=r"\.rrd"):
        open_viewer("none", tmp_path / "a.mp4")
    # A failure before the first frame leaves no file behind.
    with pytest.raises(RuntimeError), open_viewer("none", tmp_path / "a.rrd"):
        raise RuntimeError
    assert not (tmp_path / "a.rrd").exists()
