"""User errors: one clear line, exit status 2, and no command to any car."""

import errno
import json
import os
import sys
import threading
import time

import pytest
from terminals import FakeDevice

from agents.cli.main import main
from agents.hardware.drive import drive
from agents.hardware.emulate import EmulatedRig, EmulateOptions
from agents.hardware.emulate.rig import STEP_NS
from hardware_bridge.errors import BridgeError

pytestmark = pytest.mark.slow


class RunningRig:
    """Devices at pseudo terminals that run in a thread."""

    def __init__(self, folder, **options):
        chosen = EmulateOptions(**{"scenario": "cars-nlos", "seed": 3, "seconds": 600.0} | options)
        self.rig = EmulatedRig(chosen, folder)
        self.config = folder / "swarm.toml"
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._ends.wait(STEP_NS * 1e-9):
            self.rig.step(time.monotonic_ns())

    @property
    def moved(self):
        """True if any car received a command other than stop."""
        return any(
            car._car._last is not None and not car._car._last.brake
            for car in self.rig.emulator.cars
        )

    @property
    def heard(self):
        """True if any car received a byte."""
        return any(car.received_any for car in self.rig.emulator.cars)

    def close(self):
        self._ends.set()
        self._thread.join()
        self.rig.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    rig = RunningRig(tmp_path_factory.mktemp("input") / "rig")
    yield rig
    assert not rig.heard, "a car heard something of drives that never began"
    rig.close()


@pytest.fixture
def relpos(monkeypatch, capfd):
    """Return a function that runs the command line and returns its one line of error."""
    monkeypatch.setattr(os, "setpriority", lambda *_: None)  # other tests share this process

    def run(*args):
        more = ["--stop-source", "stdin"] if "--arm" in args else []  # there is no terminal
        monkeypatch.setattr(sys, "argv", ["relpos", *map(str, args), *more])
        with pytest.raises(SystemExit) as end:
            main()
        said = capfd.readouterr()
        assert said.out == ""
        lines = said.err.strip().splitlines()
        assert end.value.code == 2
        assert len(lines) == 1, lines
        return lines[0]

    return run


def written(tmp_path, rig, change):
    """Write the rig's configuration with an error; return its path."""
    text = rig.config.read_text()
    changed = change(text)
    assert changed != text
    path = tmp_path / "swarm.toml"
    path.write_text(changed)
    (tmp_path / "magnetometers.toml").write_text(
        "format = 1\n[nodes.1]\nmag_offset_uT = [1.0, 2.0, 3.0]\n"
    )
    return path


KEY = "00112233445566778899aabbccddeeff"
N1 = 'format = "relpos"'
WRONG = {
    "port that is not there": (
        lambda t: t.replace('/n1"', '/nowhere"'), "links.n1: no port", "plug it in",
    ),
    "port of a car that is not there": (
        lambda t: t.replace('/car2"', '/nowhere"'), "cars.2: no port", "plug it in",
    ),
    "port that is a file": (
        lambda t: t.replace('/n1"', '/swarm.toml"'), "links.n1: ", "is not a serial port",
    ),
    "unknown section": (
        lambda t: "[link]\n" + t, "link: unknown, expected one of",
    ),
    "unknown key": (
        lambda t: t.replace("[safety]\n", "[safety]\nmax_sped = 1.0\n"), "safety.max_sped",
    ),
    "unknown key of a link": (
        lambda t: t.replace(N1, N1 + "\nbaudrate = 9600", 1), "links.n1.baudrate: unknown", "ids",
    ),
    "one port twice": (
        lambda t: t.replace('/n2"', '/n1"'), "links.n2.port", "is that of links.n1 already",
    ),
    "duplicate ids": (
        lambda t: t.replace(N1, N1 + '\nids = { "7" = 1, "8" = 1 }', 1), "links.n1.ids",
        "two devices are the same node",
    ),
    "one node twice": (lambda t: t + "\n[nodes.1]\n", "expected TOML"),
    "node that nobody knows": (
        lambda t: t.replace("[cars.3]", "[cars.9]"), "cars.9", "expected a node of this file",
    ),
    "missing calibration": (
        lambda t: t.replace("[calibration]\nuncalibrated = true\n", ""), "calibration: missing",
        "relpos calibrate",
    ),
    "calibration file that is not there": (
        lambda t: t.replace("uncalibrated = true", 'files = ["gone.toml"]'), "calibration.files",
        "no file",
    ),
    "calibration without ranges": (
        lambda t: t.replace("uncalibrated = true", 'files = ["magnetometers.toml"]'),
        "calibration: nothing about ranges", "uncalibrated_ranges = true",
    ),
    "nothing that tells headings": (
        lambda t: t.replace('heading = "magnetic"', 'heading = "initial"'),
        "nodes.1.initial_heading_rad: missing",
    ),
    "dimensions that are none": (
        lambda t: t.replace("dimensions = 2", "dimensions = 4"), "expected 2 or 3, got 4",
    ),
    "a magnetometer that never measures": (
        lambda t: t.replace("[nodes.1]", "[nodes.1]\nmag_hz = 0.0"), "nodes.1.mag_hz",
    ),
    "baud rate that is none": (lambda t: t.replace(N1, N1 + "\nbaud = 0", 1), "links.n1.baud"),
    "unknown format": (lambda t: t.replace(N1, 'format = "nmea"', 1), "links.n1.format"),
    "unknown driver": (lambda t: t.replace('driver = "relpos"', 'driver = "rc"'), "driver"),
    "car that cannot drive slowly": (
        lambda t: t.replace('driver = "relpos"', 'driver = "pwm"', 1), "cars.1.options",
        "slower than 0.4 m/s it stops", "teach it to drive slower",
    ),
    "slow that is too slow for a VESC": (
        lambda t: t.replace('driver = "relpos"', 'driver = "vesc"', 1).replace(
            "[safety]\n", "[safety]\nslow = 0.1\n"
        ), "cars.1.options", "slower than 0.2 m/s it stops", "raise slow",
    ),
    "limit that is none": (
        lambda t: t.replace("[safety]\n", "[safety]\nstale_stop = 0.1\n"), "stale_slow",
    ),
    "key that is none": (lambda t: t.replace(N1, N1 + '\nkey = "abc"', 1), "links.n1.key"),
    "one key for a node and its car": (
        lambda t: t.replace(N1, N1 + f'\nkey = "{KEY}"', 1).replace(
            'driver = "relpos"', f'driver = "relpos"\nkey = "{KEY}"', 1
        ), "cars.1.key: is that of links.n1", "only cars have",
    ),
    "a node for messages that are signed": (
        lambda t: t.replace(N1, N1 + f'\nkey = "{KEY}"\nnode = 1', 1), "links.n1.node",
        "name their sender",
    ),
    "VESC that is never fast enough": (
        lambda t: t.replace(
            'driver = "relpos"', 'driver = "vesc"\noptions = { max_speed = 0.1 }', 1
        ), "cars.1.options", "max_speed", "at least 0.195",
    ),
    "car that cannot drive slowly backwards": (
        lambda t: t.replace(
            'driver = "relpos"',
            'driver = "pwm"\noptions = { forward = [[0.2, 1560], [3.0, 1750]], '
            "reverse = [[0.6, 1440], [3.0, 1250]] }", 1
        ), "cars.1.options", "slower than 0.6 m/s it stops",
    ),
    "no TOML": (lambda t: t + "]", "expected TOML"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_configuration(name, rig, relpos, tmp_path):
    change, *parts = WRONG[name]
    path = written(tmp_path, rig, change)
    line = relpos("drive", "--config", path, "--arm", "--seconds", 1)
    for part in parts:
        assert part in line


def test_arguments(rig, relpos, tmp_path):
    arm = ("drive", "--config", rig.config, "--arm")
    assert "gone.toml" in relpos("drive", "--config", tmp_path / "gone.toml", "--arm")
    assert "expected one of" in relpos(*arm, "--controller", "nobody")
    assert "--seconds" in relpos(*arm, "--seconds", 0)
    assert "real cars know no truth" in relpos(*arm, "--observation", "truth")
    taken = tmp_path / "taken.relpos"
    taken.write_text("mine")
    assert "taken.relpos" in relpos(*arm, "--seconds", 1, "--record", taken)
    assert taken.read_text() == "mine"


def test_no_permission(rig, relpos, monkeypatch):
    import serial

    class Refused(serial.Serial):
        def __init__(self, port, *args, **options):
            raise serial.SerialException(errno.EACCES, f"could not open port {port}")

    monkeypatch.setattr(serial, "Serial", Refused)
    line = relpos("drive", "--config", rig.config, "--arm", "--seconds", 1)
    assert "links.n1: no permission to open" in line


def test_port_in_use(rig, relpos, tmp_path):
    device = FakeDevice(tmp_path / "port")
    path = written(tmp_path, rig, lambda t: t.replace(str(rig.config.parent / "n1"),
                                                       str(device.path)))  # fmt: skip
    import serial

    with serial.Serial(str(device.path), exclusive=True):
        line = relpos("drive", "--config", path, "--arm", "--seconds", 1)
    device.unplug()
    assert "links.n1" in line
    assert "in use" in line


@pytest.mark.parametrize(
    ("change", "advice"),
    [
        (lambda t: t.replace(N1, 'format = "linktrack"\nnode = 1', 1), 'set format = "relpos"'),
        (lambda t: t.replace(N1, N1 + "\nkey = " + json.dumps("ab" * 16), 1), "set `key`"),
    ],
    ids=["format", "key"],
)
def test_stream_that_says_nothing_that_can_be_read(change, advice, tmp_path, monkeypatch, capfd):
    own = RunningRig(tmp_path / "rig")
    try:
        path = written(tmp_path, own, change)
        with pytest.raises(
            BridgeError, match=r"node 1: not well within 3 s: no message was received"
        ):
            drive(config=path, arm=True, seconds=2.0, wait=3.0)
        # The ports of cars were opened, and the cars received stop commands.
        assert not own.moved
        monkeypatch.setattr(sys, "argv", ["relpos", "doctor", "--config", str(path), "--seconds",
                                          "2", "--json"])  # fmt: skip
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 2
        records = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
        link = next(r for r in records if r.get("name") == "links.n1")
        assert any(advice in problem for problem in link["problems"])
    finally:
        own.close()


def test_wrong_baud_rate(tmp_path):
    """Any rate works on a pseudo terminal; noise represents the wrong one."""
    import random

    own = RunningRig(tmp_path / "rig")
    noise = FakeDevice(tmp_path / "noise")
    ends = threading.Event()

    def hum():
        rng = random.Random(1)
        while not ends.wait(0.01):
            noise.say(rng.randbytes(40))

    thread = threading.Thread(target=hum)
    thread.start()
    try:
        path = written(
            tmp_path, own, lambda t: t.replace(str(tmp_path / "rig" / "n1"), str(noise.path))
        )
        with pytest.raises(
            BridgeError, match=r"node 1: not well within 3 s: no message was received"
        ):
            drive(config=path, arm=True, seconds=2.0, wait=3.0)
        assert not own.moved
    finally:
        ends.set()
        thread.join()
        noise.unplug()
        own.close()
