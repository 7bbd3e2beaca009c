"""A scanner of its own port: asked when it is plugged in, and seen from the body of its car."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from terminals import FakeDevice, until

from hardware_bridge.config import parse_config
from hardware_bridge.decoders.rplidar import REQUEST
from hardware_bridge.emulator.encoders import make_encoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.near import LASTS
from hardware_bridge.live.scanner import ScannerMount
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import NOBODY, ScanReading
from relpos_env.interface.beams import FARTHEST, beam_directions, beam_starts

TEXT = """
calibration.uncalibrated = true
task.proximity = 8
nodes.1.vehicle = "car"
nodes.2.vehicle = "car"

[links.one]
port = "/dev/one"
format = "linktrack"
ids = { "0" = 1, "1" = 2 }

[links.scanner]
port = "/dev/scanner"
format = "rplidar"
node = 2
"""
MOUNT = ScannerMount(x=0.1, y=-0.03, yaw=0.4)


def parsed(text):
    return parse_config(text, file="swarm.toml", beside=Path())


def in_a_corridor(mount, bearing):
    """From the scanner to the walls y = 1 and y = -2 of the car's frame, step by step."""
    step = 1e-3 * np.array([math.cos(mount.yaw + bearing), math.sin(mount.yaw + bearing)])
    far = np.array([mount.x, mount.y]) + np.arange(1, 20_000)[:, None] * step
    hit = np.flatnonzero((far[:, 1] > 1.0) | (far[:, 1] < -2.0))
    return None if not len(hit) else 1e-3 * (hit[0] + 1)


def turn(mount, n=800):
    """A whole turn of the scanner, clockwise."""
    bearings = [-2.0 * math.pi * k / n for k in range(n)]
    return [ScanReading(NOBODY, b, in_a_corridor(mount, b)) for b in bearings]


@given(
    bearing=st.floats(-math.pi, math.pi),
    distance=st.floats(0.0, 16.0),
    x=st.floats(-0.2, 0.2),
    y=st.floats(-0.1, 0.1),
    yaw=st.floats(-math.pi, math.pi),
)
def test_the_distance_is_from_the_edge_of_the_body(bearing, distance, x, y, yaw):
    mount = ScannerMount(x=x, y=y, yaw=yaw)
    point = complex(x, y) + distance * complex(math.cos(yaw + bearing), math.sin(yaw + bearing))
    seen = mount.seen(bearing, distance)
    inside = abs(point.real) < 0.21 and abs(point.imag) < 0.1
    if seen is None:
        assert max(abs(point.real) / 0.21, abs(point.imag) / 0.1) <= 1.0 + 1e-9
        return
    assert not inside
    direction = np.array([[math.cos(seen[0]), math.sin(seen[0])]])
    from_middle = seen[1] + beam_starts(direction, 0.21, 0.1)[0]
    assert from_middle * complex(*direction[0]) == pytest.approx(point, abs=1e-9)


def test_beams_are_those_of_sensors_on_the_body():
    keys = "".join(f"scanner.{key} = {getattr(MOUNT, key)}\n" for key in ("x", "y", "yaw"))
    swarm = LiveSwarm(parsed(TEXT + keys), 0)
    encoder = make_encoder("rplidar", "")
    for k in range(2):
        swarm.take(Chunk("links.scanner", k * 1000, encoder.encode(turn(MOUNT))))
    directions = beam_directions(720)
    walls = np.where(directions[:, 1] > 0.0, 1.0, 2.0) / np.maximum(np.abs(directions[:, 1]), 1e-9)
    from_body = np.minimum(walls - beam_starts(directions, 0.21, 0.1), FARTHEST)
    sectors = 90 * np.arange(8)[:, None] + np.arange(-45, 46)
    expected = from_body[sectors % 720].min(axis=1)
    beams = swarm.intake.near.beams(1000)
    assert beams[1] == pytest.approx(expected, abs=0.03)
    assert not beams[0].any()  # the scanner is on the other car
    assert not swarm.intake.near.beams(1001 + round(LASTS * 1e9)).any()
    assert not swarm.intake.heard_ns  # a scanner says nothing of where its car is


def test_it_is_asked_whenever_its_port_comes_up(tmp_path):
    (tmp_path / "other").mkdir()
    scanner, other = FakeDevice(tmp_path / "scanner"), FakeDevice(tmp_path / "other" / "one")
    text = TEXT.replace("/dev/scanner", str(scanner.path)).replace("/dev/one", str(other.path))
    config = parsed(text)
    with Links([link.port for link in config.links], time.monotonic_ns) as links:
        heard = b""
        for _ in range(2):
            until(links, lambda _: links.is_up("links.scanner"))
            for _ in range(100):
                heard = scanner.heard() or heard
                links.wait(0.001)
            assert heard == REQUEST
            heard = b""
            scanner.unplug()
            until(links, lambda _: not links.is_up("links.scanner"))
            scanner.plug()
        assert other.heard() == b""
    scanner.unplug()
    other.unplug()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("node = 2\n", "", "links.scanner.node: missing: rplidar does not say who speaks"),
        ("node = 2\n", "node = 2\nscanner.hight = 1.0\n", "links.scanner.scanner.hight: unknown"),
        ("node = 2\n", "node = 2\nscanner.width = 0.0\n", "scanner: expected a length and a width"),
        ('"1" = 2 }\n', '"1" = 2 }\nscanner.x = 0.1\n', "linktrack is no scanner, leave it out"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_key(old, new, message):
    with pytest.raises(BridgeError, match=message):
        parsed(TEXT.replace(old, new))
