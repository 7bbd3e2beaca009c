"""Mounting of a node and its sensors: ``[nodes.N.mount]``, ``imu_axes``, ``mag_axes``."""

import tomllib
from pathlib import Path

import pytest

from hardware_bridge.config.nodes import read_constellation
from tracking.axes import Axes
from tracking.errors import ConfigError
from tracking.mount import Mount
from tracking.params.tables import Where

FILE = """
[nodes.1]
imu_hz = 100.0
[nodes.1.mount]
ahead_m = 0.21
slip_s2_per_m = 0.0
[nodes.2]
imu_hz = 100.0
"""


def read(text):
    where = Where("swarm.toml", ConfigError)
    return read_constellation(tomllib.loads(text), 2, "magnetic", where)


def test_it_is_what_the_file_says_and_unknown_otherwise():
    mounts = [node.mount for node in read(FILE).nodes]
    assert mounts == [Mount(ahead=0.21, slip=0.0), Mount()]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("ahead_m = 210.0", r"nodes\.1.*mount\.ahead: expected -10 to 10, got 210"),
        ("ahead = 0.2", r"nodes\.1\.mount.*ahead"),
        ('ahead_m = "far"', r"nodes\.1\.mount\.ahead_m: expected a number"),
    ],
)
def test_what_cannot_be_is_refused_by_name(line, message):
    with pytest.raises(ConfigError, match=message):
        read(FILE.replace("ahead_m = 0.21", line))


def test_axes_of_sensors_are_those_of_the_file():
    node = read(FILE.replace("[nodes.1]", '[nodes.1]\nimu_axes = ["-y", "x", "z"]')).nodes[0]
    assert node.imu_axes.turn_one((1.0, 2.0, 3.0)) == (-2.0, 1.0, 3.0)
    assert node.mag_axes == Axes()
    with pytest.raises(ConfigError, match=r"nodes\.1.*imu_axes: expected right-handed"):
        read(FILE.replace("[nodes.1]", '[nodes.1]\nimu_axes = ["y", "x", "z"]'))


def test_the_example_is_read():
    text = Path("examples/three_cars.toml").read_text(encoding="utf-8")
    assert all(node.mount == Mount() for node in read(text).nodes if node.kind == "moving")
