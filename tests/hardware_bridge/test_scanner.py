"""A scanner with a port of its own: requested on opening, and seen from its car's body."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st
from terminals import FakeDevice, until

from hardware_bridge.config import parse_config
from hardware_bridge.decoders.rplidar import REQUEST
from hardware_bridge.emulator.encoders import make_encoder
from hardware_bridge.errors import BridgeError
from hardware_bridge.ingest.rangefinder import LASTS, Near
from hardware_bridge.ingest.scanner import ScannerMount
from hardware_bridge.links.links import Links
from hardware_bridge.links.ports import Chunk, PortSpec
from hardware_bridge.links.serial_port import SerialPort
from hardware_bridge.live.swarm import LiveSwarm
from hardware_bridge.readings import UNNAMED, ScanReading
from relpos_env.interface.rangefinders import FARTHEST, rangefinder_directions, rangefinder_origins

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
    return parse_config(text, file="swarm.toml", folder=Path())


def in_a_corridor(mount, bearing):
    """Return the distance to the walls y = 1 and y = -2 of the car's frame, step by step."""
    step = 1e-3 * np.array([math.cos(mount.yaw + bearing), math.sin(mount.yaw + bearing)])
    far = np.array([mount.x, mount.y]) + np.arange(1, 20_000)[:, None] * step
    hit = np.flatnonzero((far[:, 1] > 1.0) | (far[:, 1] < -2.0))
    return None if not len(hit) else 1e-3 * (hit[0] + 1)


def turn(mount, n=800):
    """Return the samples of a full revolution of the scanner, clockwise."""
    bearings = [-2.0 * math.pi * k / n for k in range(n)]
    return [ScanReading(UNNAMED, b, in_a_corridor(mount, b)) for b in bearings]


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
    from_middle = seen[1] + rangefinder_origins(direction, 0.21, 0.1)[0]
    assert from_middle * complex(*direction[0]) == pytest.approx(point, abs=1e-9)


def test_beams_are_those_of_sensors_on_the_body():
    keys = "".join(f"scanner.{key} = {getattr(MOUNT, key)}\n" for key in ("x", "y", "yaw"))
    swarm = LiveSwarm(parsed(TEXT + keys), 0)
    encoder = make_encoder("rplidar", "")
    for k in range(2):
        swarm.take(Chunk("links.scanner", k * 1000, encoder.encode(turn(MOUNT))))
    directions = rangefinder_directions(720)
    walls = np.where(directions[:, 1] > 0.0, 1.0, 2.0) / np.maximum(np.abs(directions[:, 1]), 1e-9)
    from_body = np.minimum(walls - rangefinder_origins(directions, 0.21, 0.1), FARTHEST)
    sectors = 90 * np.arange(8)[:, None] + np.arange(-45, 46)
    expected = from_body[sectors % 720].min(axis=1)
    distances = swarm.intake.near.distances(1000)
    assert distances[1] == pytest.approx(expected, abs=0.03)
    assert not distances[0].any()  # the scanner is on the other car
    assert not swarm.intake.near.distances(1001 + round(LASTS * 1e9)).any()
    assert not swarm.intake.received_ns  # a scanner does not report the position of its car


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
        # A scanner that was still starting is asked again; one that sends is not.
        until(links, lambda _: links.is_up("links.scanner"))
        asked = until_heard(scanner, links) + until_heard(scanner, links)
        assert asked == 2 * REQUEST
        scanner.say(b"\xbe")
        until(links, bool)
        assert scanner.heard() == b""
    scanner.unplug()
    other.unplug()


def until_heard(device, links):
    """Return the next bytes that a device receives, while the host reads its ports."""
    for _ in range(3000):
        links.wait(0.001)
        if said := device.heard():
            return said
    return b""


def test_its_motor_is_let_run(monkeypatch, tmp_path):
    lines = []
    monkeypatch.setattr(serial.Serial, "dtr", property(None, lambda _, level: lines.append(level)))
    device = FakeDevice(tmp_path / "scanner")
    for dtr in (True, False):
        SerialPort(PortSpec(name="links.a", port=str(device.path), dtr=dtr)).close()
    assert lines == [False]
    device.unplug()


def test_beams_have_no_gaps_while_the_scanner_turns_slowly():
    """Box in front at 1 m, with noise and a wall far behind it, measured once per revolution."""
    near, rng, n = Near(1, 8), np.random.default_rng(1), 40
    for k in range(60 * n):
        t_ns = round(0.18e9 * k / n)
        bearing = -2.0 * math.pi * (k % n) / n
        ahead = abs(math.remainder(bearing, 2.0 * math.pi)) < 0.1
        distance = (1.0 if ahead else 2.9) + rng.normal(scale=0.005)
        near.take(0, bearing, distance, t_ns)
        if t_ns > 0.2e9:
            assert near.distances(t_ns)[0, 0] == pytest.approx(1.0, abs=0.03)
            assert near.distances(t_ns)[0, 4] == pytest.approx(2.9, abs=0.03)


HERE = "node = 2\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (HERE, "", "links.scanner.node: missing: rplidar does not name the sender"),
        (HERE, HERE + "scanner.hight = 1.0\n", "links.scanner.scanner.hight: unknown"),
        (HERE, HERE + "scanner.width = 0.0\n", "scanner.width: expected 0.01 to 5 m, got 0"),
        (HERE, HERE + "scanner.x = 50.0\n", "scanner.x: expected -0.42 to 0.42 m, got 50"),
        (HERE, HERE + "scanner.yaw = 90.0\n", "scanner.yaw: expected -6.28.* rad, got 90"),
        (HERE, HERE + 'ids = { "7" = 1 }\n', "links.scanner.ids: a scanner names nothing"),
        (
            'nodes.2.vehicle = "car"',
            'nodes.2.kind = "static"\nnodes.3.vehicle = "car"',
            "links.scanner.node: node 2 is static",
        ),
        ("task.proximity = 8\n", "", "task.proximity: expected the number of distance sensors"),
        ('"1" = 2 }\n', '"1" = 2 }\nscanner.x = 0.1\n', "linktrack is no scanner, leave it out"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_key(old, new, message):
    with pytest.raises(BridgeError, match=message):
        parsed(TEXT.replace(old, new))
