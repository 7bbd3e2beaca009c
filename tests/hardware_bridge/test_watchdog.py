"""Time that emulated cars move without commands, measured over their ports in real time."""

import json
import threading
import time

import pytest
from click.testing import CliRunner

from agents.cli.main import cli
from agents.errors import UsageError
from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.rig import STEP_NS, EmulatedRig
from agents.hardware.inspection.watchdog import measure_watchdogs
from hardware_bridge.config import read_config
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.errors import BridgeError

pytestmark = pytest.mark.realtime


class Emulation:
    """Emulation that runs in a thread within the context."""

    def __init__(self, folder, **options):
        self.rig = EmulatedRig(EmulateOptions(scenario="open", cars=2, **options), folder=folder)
        self._go_on, self._thread = True, threading.Thread(target=self._run, daemon=True)

    def _run(self):
        while self._go_on:
            self.rig.step(time.monotonic_ns())
            time.sleep(STEP_NS * 0.5e-9)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._go_on = False
        self._thread.join()
        self.rig.close()


@pytest.mark.parametrize("driver", ["relpos", "vesc"])
@pytest.mark.parametrize("deadman", [0.2, 1.0])
def test_what_is_measured_is_what_the_cars_do(tmp_path, driver, deadman):
    with Emulation(tmp_path, driver=driver, deadman=deadman):
        found = measure_watchdogs(read_config(tmp_path / "swarm.toml"))
    assert [each.problem for each in found] == ["", ""]
    for each in found:
        assert deadman <= each.seconds <= deadman + 0.5


def test_a_car_that_never_stops_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("agents.hardware.inspection.watchdog.LONGEST", 1.0)
    with Emulation(tmp_path, deadman=10.0):
        config = read_config(tmp_path / "swarm.toml")
        assert [car.watchdog for car in config.cars] == [None, None]
        first, _ = measure_watchdogs(config)
    assert first.seconds is None
    assert "it went on for 1 s" in first.problem


def test_the_command_writes_into_the_file(tmp_path):
    command = ["doctor", "--config", str(tmp_path / "swarm.toml"), "--watchdog"]
    with Emulation(tmp_path, deadman=0.5):
        refused = CliRunner().invoke(cli, command)
        assert isinstance(refused.exception, UsageError)
        done = CliRunner().invoke(cli, [*command, "--wheels-up", "--write", "--json"])
    assert done.exit_code == 0, done.output
    records = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    written = [car.watchdog for car in read_config(tmp_path / "swarm.toml").cars]
    assert written == [record["seconds"] for record in records]
    assert all(0.5 <= seconds < 1.1 for seconds in written)
    with pytest.raises(BridgeError, match="cars: none"):
        measure_watchdogs(type("None", (), {"cars": (), "keys": []})())


class Interrupted:
    """Links that raise KeyboardInterrupt once the car was driven."""

    def __init__(self, ports, now_ns):
        self.sent = []
        Interrupted.last = self

    def is_up(self, name):
        return True

    def send(self, name, data):
        self.sent.append(data)

    def wait(self, seconds):
        if len(self.sent) > 20:
            raise KeyboardInterrupt
        return []

    def close(self):
        self.sent.append("closed")


def test_whatever_ends_it_the_car_is_told_to_stand(tmp_path, monkeypatch):
    with Emulation(tmp_path):
        config = read_config(tmp_path / "swarm.toml")
    monkeypatch.setattr("agents.hardware.inspection.watchdog.Links", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        measure_watchdogs(config)
    decoder = DriveDecoder(config.cars[0])
    *sent, last, closed = Interrupted.last.sent
    assert closed == "closed"
    assert any(decoder.speed(data) for data in sent)
    assert decoder.speed(last) == 0.0


class DriveDecoder:
    """Decoder of commands as in the car."""

    def __init__(self, car):
        self._decoder = RelposDecoder(car.key)

    def speed(self, data):
        return next((r.speed for r in self._decoder.feed(data)), None)
