"""Malicious files cause no leaks, no crashes and no limits that disable the gate."""

import gzip
import json
import os
from dataclasses import fields
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from agents.errors import UsageError
from agents.hardware.drive.keys import ALIVE, PATIENCE, PipedKeys, check_stop_source, orders_of
from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.rig import EmulatedRig
from agents.hardware.inspection.hearing import Hearing, known_formats, why_nothing_fits
from agents.hardware.inspection.sniff import sniff
from agents.hardware.inspection.watchdog import Watchdog, with_watchdogs
from agents.hardware.live.rates import Rates
from hardware_bridge.config import parse_config
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.replay import with_keys_of
from hardware_bridge.readings import MICROSECONDS_32, HeartbeatReading, Source
from hardware_bridge.recording import Header
from hardware_bridge.recording.format import LATEST, Kind, Record
from hardware_bridge.safe_file import write_safely
from hardware_bridge.safety.params import LIMITS, SafetyParams
from hardware_bridge.wire.encoder import RelposEncoder
from hardware_bridge.wire.key import REMOVED_KEY, read_key, without_keys
from relpos_env.errors import EnvError
from relpos_env.scenarios import load_scenario
from tracking.constellation import Constellation, NodeConfig
from tracking.errors import ConfigError, LogError
from tracking.log.table import MOST_BYTES, Table
from tracking.measurements import Kind as Measured
from tracking.measurements import MeasurementBlock

KEY = bytes(range(16))


def swarm_text(**options):
    return EmulatedRig(EmulateOptions(scenario="ring-los", cars=2, **options)).swarm_toml(
        Path("/x")
    )


def config_of(text):
    return parse_config(text, file="swarm.toml", folder=Path())


def test_a_recording_holds_no_keys_and_is_still_a_configuration():
    text = swarm_text(key=KEY)
    config = config_of(text)
    spelled = text.replace(KEY.hex(), " ".join(f"{byte:02X}" for byte in KEY))
    for each in (text, spelled):
        shared = without_keys(each, config.keys)
        for key in {key for key in config.keys if key}:
            assert key.hex() not in shared.lower().replace(" ", "")
        assert "removed" in shared
        known = config_of(shared)
        assert set(known.keys) <= {None, REMOVED_KEY}
        assert with_keys_of(known, config).keys == config.keys


@pytest.mark.parametrize("cut", ['"""{0}\\\n  {1}"""', '"\\u0030{0}{1}"'])
def test_a_key_that_cannot_be_found_is_not_recorded(cut):
    key = bytes(range(0x0F, 0x1F))
    text = swarm_text(key=key)
    digits = key.hex()
    whole = digits if cut.startswith('"""') else digits[1:]
    written = text.replace(f'"{digits}"', cut.format(whole[:9], whole[9:]))
    keys = config_of(written).keys
    assert key in keys
    with pytest.raises(BridgeError, match="key: cannot be kept out of the recording"):
        without_keys(written, keys)


@pytest.mark.parametrize(("table", "name"), [("tracker", "filter"), ("task", "name")])
def test_a_recording_imports_nothing(tmp_path, monkeypatch, table, name):
    (tmp_path / "foreign.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    text = swarm_text().split("[task]")[0]
    text += f'\n[{table}]\n{name} = "foreign:Thing"\n'
    with pytest.raises(BridgeError, match=f"{name}: expected one of"):
        parse_config(text, file="a", folder=Path(), with_files=False)


def test_a_key_may_stand_in_a_file(tmp_path):
    file = tmp_path / "key"
    file.write_text(KEY.hex() + "\n")
    assert read_key(f"@{file}") == read_key(KEY.hex()) == KEY
    with pytest.raises(ValueError, match="cannot be read"):
        read_key("@/nowhere/at/all")


def test_another_key_is_named_as_the_cause():
    hearing = Hearing(known_formats(), bytes(16))
    encoder = RelposEncoder(3, 1, KEY)
    source = Source(device="3", ticks=5, clock=MICROSECONDS_32)
    data = b"".join(encoder.encode([HeartbeatReading(source)]) for _ in range(20))
    hearing.take(Chunk("port", 0, data))
    assert "signed with another key" in why_nothing_fits(hearing, 115200, known_formats())


@pytest.mark.parametrize("payload", [b"", b"{", b"[" * 100_000, b"\xff"])
def test_an_event_that_is_none_is_a_value_error(payload):
    record = Record(kind=Kind.EVENT, link=0, sequence=0, t_ns=0, payload=payload)
    with pytest.raises(ValueError, match="Expecting|deep|decode"):
        record.event()


def test_a_header_of_no_time_is_refused():
    header = Header(software="x", config="", links=(), monotonic_ns=0, wall_ns=0)
    raw = json.loads(header.encode())
    raw["monotonic_ns"] = 10**40
    with pytest.raises(ValueError, match="monotonic_ns: expected nanoseconds"):
        Header.decode(json.dumps(raw).encode())
    assert LATEST > 1 << 61


@pytest.mark.parametrize("jitter", [-1e-3, 0.0, 1e-3])
def test_rates_are_what_is_sent(jitter):
    rates, ones = Rates(2), MeasurementBlock.of_kind
    for k in range(60):
        t = np.arange(10) * 0.01 + 0.1 * k
        zeros = np.zeros(10, dtype=np.int64)
        rates.take(ones(Measured.IMU, t, zeros, np.zeros((10, 6))))
        rates.close(0.1 * k + (jitter if k % 2 else 0.0))
    assert rates.hz[0, 0] == pytest.approx(100.0, rel=0.002)


@pytest.mark.parametrize("hz", [1e-300, 0.001, 1e7, 1e11])
def test_rates_that_no_imu_has_are_refused(hz):
    nodes = (NodeConfig(id=1, imu_hz=hz), NodeConfig(id=2))
    with pytest.raises(ConfigError, match=r"nodes.1.imu_hz: expected 1 to 10000"):
        Constellation(nodes=nodes)


def test_a_group_of_thousands_is_refused():
    with pytest.raises(ConfigError, match="nodes: expected 2 to 256, got 3000"):
        Constellation(nodes=tuple(NodeConfig(id=k) for k in range(3000)))


@pytest.mark.parametrize("port", ["", "/dev/tty\\u0000USB0"])
def test_a_port_of_no_name_is_refused(port):
    text = swarm_text().replace('port = "/x/car1"', f'port = "{port}"')
    with pytest.raises(BridgeError, match=r"cars.1.port: expected the name of a port"):
        config_of(text)


def test_every_limit_has_bounds_and_none_switches_a_rule_off():
    names = {f.name for f in fields(SafetyParams)} - {"fence", "others_drive"}
    assert names == set(LIMITS)
    for name, (low, high) in LIMITS.items():
        for value in (0.0, -1.0, low / 2.0, high * 2.0, 1e9, float("nan")):
            with pytest.raises(BridgeError, match=f"^{name}: expected"):
                SafetyParams(**{name: value})


def test_a_room_and_an_antenna_of_kilometres_are_refused():
    text = swarm_text()
    with pytest.raises(BridgeError, match=r"task.room: expected above 0 and at most 1000 m"):
        config_of(text.replace("room = [", "room = [1e12, 1.0] #"))
    with pytest.raises(BridgeError, match=r"antennas.1.offset_m: expected metres within 10"):
        config_of(text.replace("offset_m = [", "offset_m = [1e9, 0.0, 0.0] #", 1))


def test_an_emulation_replaces_nobodys_file(tmp_path):
    mine = tmp_path / "swarm.toml"
    mine.write_text("# mine\n")
    with pytest.raises(BridgeError, match="not written by an emulation"):
        EmulatedRig(EmulateOptions(scenario="ring-los", cars=2), folder=tmp_path)
    assert mine.read_text() == "# mine\n"


def test_what_unpacks_to_more_than_fits_is_refused(tmp_path):
    file = tmp_path / "ranges.csv.gz"
    with gzip.open(file, "wb", compresslevel=1) as stream:
        for _ in range((MOST_BYTES >> 20) + 1):
            stream.write(bytes(1 << 20))
    with pytest.raises(LogError, match=r"ranges.csv.gz: expected at most 256 MiB"):
        Table.read(file, ("t",))


def test_a_pipe_is_no_scenario(tmp_path):
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    with pytest.raises(EnvError, match="scenario: expected a file"):
        load_scenario(pipe)


def test_a_file_is_whole_and_of_its_mode(tmp_path):
    path = tmp_path / "a.json"
    write_safely(path, "one", mode=0o600)
    write_safely(path, "two", mode=0o600)
    assert path.read_text() == "two"
    assert path.stat().st_mode & 0o777 == 0o600
    assert os.listdir(tmp_path) == ["a.json"]


def test_of_two_writers_each_writes_a_whole_file(tmp_path):
    path, failed = tmp_path / "a.json", []

    def write(letter):
        try:
            for _ in range(50):
                write_safely(path, letter * 1000)
        except OSError as error:
            failed.append(error)

    writers = [Thread(target=write, args=(letter,)) for letter in "ab"]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert not failed
    assert path.read_text() in ("a" * 1000, "b" * 1000)
    assert os.listdir(tmp_path) == ["a.json"]


def test_a_drive_needs_somebody_who_can_stop_it(monkeypatch):
    reading, writing = os.pipe()
    with os.fdopen(reading) as stream:
        monkeypatch.setattr("sys.stdin", stream)
        with pytest.raises(UsageError, match="--arm: expected a terminal"):
            check_stop_source("terminal")
        check_stop_source("stdin")
        now = [0.0]
        keys = PipedKeys(lambda: now[0])
        assert keys.read_orders() == []
        os.write(writing, b"a")
        assert keys.read_orders() == ["arm"]
        now[0] = 0.9 * PATIENCE
        os.write(writing, ALIVE.encode())
        assert keys.read_orders() == []
        now[0] = 1.8 * PATIENCE
        assert keys.read_orders() == []
        now[0] = 2.0 * PATIENCE
        assert keys.read_orders() == ["stop"]
        os.close(writing)
        assert keys.read_orders() == ["stop", "quit"]
        assert keys.read_orders() == []
    assert orders_of("g") == ["gone"]


def test_watchdogs_are_written_into_the_tables_of_the_cars(tmp_path):
    path = tmp_path / "swarm.toml"
    path.write_text(swarm_text().replace("watchdog = 0.2\n", "", 1))
    found = [Watchdog(1, 0.25, ""), Watchdog(2, 0.4, "")]
    with_watchdogs(path, found)
    config = config_of(path.read_text())
    assert [car.watchdog for car in config.cars] == [0.25, 0.4]
    with pytest.raises(BridgeError, match=r"cars.9: expected a table \[cars.9\]"):
        with_watchdogs(path, [Watchdog(9, 0.3, "")])
    with pytest.raises(BridgeError, match=r"cars.1.watchdog: expected above 0 and at most 2 s"):
        config_of(path.read_text().replace("watchdog = 0.25", "watchdog = 10.0"))


@pytest.mark.parametrize(
    ("port", "message"),
    [
        ("", "PORT: expected the name of a port, got ''"),
        ("tcp:here", "port: expected tcp:host:port, got 'tcp:here'"),
        ("tcp:" + "x" * 70 + ":80", "is no name of a host"),
    ],
)
def test_what_is_no_port_is_said_once(port, message):
    with pytest.raises((BridgeError, UsageError)) as error:
        sniff(port, seconds=0.1)
    assert message in str(error.value)
    assert str(error.value).count("port: port:") == 0
