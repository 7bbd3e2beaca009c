"""Diagnoses of `relpos doctor` for ports, links and cars."""

import json
import os
import random
import re
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from line_formats import FORMATS, LineFormat, Talker, line

from agents.cli.main import cli
from agents.errors import UsageError
from agents.hardware.inspection.diagnosis import diagnose_link, share_a_device
from agents.hardware.inspection.doctor import doctor
from agents.hardware.inspection.hearing import Hearing, known_formats
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.port_list import SerialPortInfo
from hardware_bridge.links.port_users import port_users
from hardware_bridge.links.ports import Chunk, PortSpec
from hardware_bridge.readings import (
    MICROSECONDS_32,
    ImuReading,
    PoseReading,
    RangeReading,
    ScanReading,
    Source,
)
from tracking.constellation import NodeConfig


def link(port="p", format="alpha", name="left", baud=115200, node=None, ids=None, key=None):
    spec = PortSpec(name=f"links.{name}", port=port, baud=baud)
    return SimpleNamespace(name=name, port=spec, format=format, node=node, ids=ids or {}, key=key)


def car(port, node=1, driver="vesc"):
    return SimpleNamespace(node=node, port=PortSpec(name=f"cars.{node}", port=port), driver=driver)


def config(*links, cars=()):
    group = SimpleNamespace(nodes=[NodeConfig(id=4, vehicle="car")])
    return SimpleNamespace(links=links, cars=cars, constellation=group)


def heard(pieces, formats=FORMATS, key=None, every_ns=10_000_000):
    hearing = Hearing(formats, key)
    for k, piece in enumerate(pieces):
        hearing.take(Chunk("links.left", k * every_ns, piece))
    hearing.silent_until(len(pieces) * every_ns)
    return hearing


def diagnose(pieces, formats=FORMATS, down="", losses=0, seconds=None, imu_hz=100.0, **options):
    each = link(**options)
    return diagnose_link(
        each,
        heard(pieces, formats, each.key),
        formats,
        seconds=seconds or 0.01 * max(1, len(pieces)),
        down=down,
        losses=losses,
        nodes={k: NodeConfig(id=k, vehicle="car", imu_hz=imu_hz) for k in range(10)},
    )


GOOD = [line("alpha", 1, 2, 3.0) + line("alpha", 1, "imu", 9.8) for _ in range(100)]


@pytest.fixture
def talkers():
    made = []

    def make(*args, **options):
        made.append(Talker(*args, **options))
        return made[-1]

    yield make
    for each in made:
        each.close()


def test_formats_are_ready_before_anybody_listens():
    fed = []

    def build(_):
        return SimpleNamespace(feed=lambda data: fed.append(data) or [], waiting=0)

    formats = {"alpha": SimpleNamespace(build=build, baud=1, keyed=False)}
    Hearing.get_ready(formats)
    assert len(fed) == 1
    assert fed[0]


def test_a_good_link():
    report = diagnose(GOOD)
    assert report.ok
    assert report.detected_format == "alpha"
    assert report.frames_hz == 200.0
    (node,) = report.nodes
    assert (node.node, node.imu_hz, node.ranges_hz) == ("1", 100.0, {"2": 100.0})
    json.dumps(report.record, allow_nan=False)


def problem(*args, **options):
    (only,) = diagnose(*args, **options).problems
    return only


def test_another_format_is_recognised():
    said = problem(GOOD, format="beta")
    assert said.startswith('sends alpha, configured beta: set format = "alpha"')


def test_the_rate_seems_wrong():
    noise = [random.Random(k).randbytes(40) for k in range(50)]
    said = problem(noise)
    assert "2000 bytes and no frame of any format: the baud rate 115200 seems wrong" in said
    assert "usual are 921600 for beta" in said
    assert "too few" in problem(noise[:1])


def test_silence_and_what_is_not_there():
    assert problem([]).startswith("silent: ")
    assert problem([], down="no port /dev/x: plug it in") == "no port /dev/x: plug it in"
    assert not diagnose([], down="no port").up


def test_damage_gaps_and_losses():
    half = [GOOD[0].replace(b"9", b"8") if k % 4 == 0 else GOOD[0] for k in range(100)]
    assert problem(half).startswith("12 % of the frames are damaged")  # one of the two lines
    late = diagnose(GOOD[:3], seconds=4.0, imu_hz=0.75)
    assert late.ok  # a stream with a low rate
    hearing = heard(GOOD)
    hearing.silent_until(5_000_000_000)
    each = link()
    report = diagnose_link(
        each,
        hearing,
        FORMATS,
        seconds=5.0,
        down="",
        losses=2,
        nodes={4: NodeConfig(id=4, vehicle="car")},
    )
    assert report.problems[0].startswith("silent for 4.0 s")
    assert report.problems[1].startswith("lost 2 times while listening")


def test_samples_of_another_rate_than_configured():
    said = problem(GOOD, imu_hz=50.0)
    assert said.startswith("node 1: 100 inertial samples a second, configured 50")
    assert diagnose(GOOD, imu_hz=120.0).ok
    assert diagnose(GOOD[:50], imu_hz=50.0).ok  # half a second is not enough


def test_sequence_numbers_tell_what_is_missing_and_who_started_anew():
    numbers = [k for k in range(100) if k % 10]
    said = [line("alpha", 4, 5, 1.0, k) for k in numbers]
    assert problem(said).startswith("node 4: 9 % of its messages did not arrive")
    wrapped = [line("alpha", 4, 5, 1.0, (2**32 - 50 + k) % 2**32) for k in range(100)]
    assert diagnose(wrapped).ok
    assert diagnose([w + w for w in wrapped]).ok  # several readings of a message
    old = [*wrapped[:50], wrapped[3], *wrapped[50:]]
    assert diagnose(old).nodes[0].missing_share < 0.5
    twice = [line("alpha", 4, 5, 1.0, k, boot) for boot in (1, 2) for k in range(50)]
    assert problem(twice) == "node 4 started 2 times: see its power"


def test_devices_become_nodes_by_ids():
    said = [line("alpha", "A1B2", "7", 1.0) for _ in range(10)]
    assert problem(said) == 'device A1B2 is no node: add `ids = { "A1B2" = NODE }`'
    report = diagnose(said, ids={"A1B2": 3, "7": 4})
    assert report.ok
    assert report.nodes[0].node == "3"
    assert list(report.nodes[0].ranges_hz) == ["4"]
    nameless = [line("alpha", "-", "7", 1.0) for _ in range(10)]
    assert problem(nameless).endswith("set `node`")
    assert diagnose(nameless, node=9).nodes[0].node == "9"


def test_nodes_that_another_tracker_tells_of():
    """They do not transmit, and several links may report them."""
    said = b'{"i": 1, "j": 2, "pos": [1, 2]}\n{"node": 2, "yaw": 0}\n{"node": "b", "yaw": 0}\n'
    reports = [
        diagnose([said] * 100, known_formats(), format="positions", ids={"B": 9}) for _ in "ab"
    ]
    told = {(n.node, n.positions_hz) for n in reports[0].nodes}
    assert told == {("1", 100.0), ("2", 200.0), ("9", 100.0)}
    share_a_device(reports)
    assert reports[0].ok
    assert reports[1].ok
    stranger = problem([said] * 100, known_formats(), format="positions")
    assert stranger == 'device B is no node: add `ids = { "B" = NODE }`'


def test_a_wrong_key():
    formats = {"alpha": LineFormat("alpha", 115200, keyed=True)}
    refused = [GOOD[0].replace(b"#", b"#1") for _ in range(10)]
    assert problem(refused, formats, key=bytes(16)).startswith(
        "every message is refused: set `key`"
    )
    assert "key" not in problem(refused, formats)


def test_a_format_that_needs_its_key_is_left_out_without_one():
    def refuse(key):
        raise BridgeError("a key is needed")

    formats = {**FORMATS, "locked": SimpleNamespace(build=refuse, baud=1, keyed=True)}
    assert diagnose(GOOD, formats).ok


def test_listens_to_links_and_cars_and_writes_nothing(talkers):
    left = talkers(lambda k: line("alpha", 1, 2, 3.0, k))
    right = talkers(lambda k: line("beta", 1, 3, 3.0))
    motor = talkers()
    wrong = talkers(lambda k: line("beta", 8, 9, 3.0))
    swarm = config(
        link(left.path),
        link(right.path, "beta", "right", 921600),
        link("/dev/none", "alpha", "third"),
        cars=(car(motor.path), car(wrong.path, 2)),
    )
    found = doctor(swarm, seconds=0.6, formats=FORMATS, listing=list)
    by_name = {report.name: report for report in found.links}
    assert by_name["links.left"].ok
    assert by_name["links.left"].frames_hz > 5.0
    assert by_name["links.right"].problems == [
        "node 1 sends on links.left too: give the devices ids of their own, or correct `ids` and "
        "`node` of the two links"
    ]
    assert by_name["links.third"].problems[0].startswith("no port /dev/none: plug it in")
    assert by_name["cars.1"].ok
    assert by_name["cars.2"].problems[0].startswith("sends beta, which is no car")
    assert not found.ok
    for talker in (left, right, motor, wrong):
        assert talker.heard() == b""
    text = json.dumps(found.records, allow_nan=False)
    assert not re.search(r"\.\d{4}", text)
    assert json.loads(text)[-1] == {"kind": "verdict", "ok": False}


def test_all_well(talkers):
    left = talkers(lambda k: line("alpha", 1, 2, 3.0))
    found = doctor(config(link(left.path)), seconds=0.3, formats=FORMATS, listing=list)
    assert found.ok


def test_ports_without_a_configuration(monkeypatch, tmp_path):
    good, bad = tmp_path / "ttyUSB0", tmp_path / "ttyUSB1"
    for path in (good, bad):
        path.touch()
    ports = [
        SerialPortInfo(path=str(good), serial_number="FT1", maker="FTDI", by_id="/dev/serial/x"),
        SerialPortInfo(path=str(bad)),
    ]
    assert doctor(listing=lambda: ports).ok
    assert not doctor(listing=list).ok  # no ports
    monkeypatch.setattr(os, "access", lambda path, mode: path != str(bad))
    found = doctor(listing=lambda: ports)
    assert not found.ok
    assert [p.may_open for p in found.ports] == [True, False]
    assert found.ports[1].remedy
    assert found.records[0]["serial_number"] == "FT1"


def test_seconds_in_range():
    for seconds in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(UsageError, match="--seconds: expected"):
            doctor(seconds=seconds, listing=list)


def test_who_has_a_port_open(tmp_path):
    device = tmp_path / "tty"
    device.touch()
    process = tmp_path / "proc" / "77"
    (process / "fd").mkdir(parents=True)
    (process / "fd" / "3").symlink_to(device)
    (process / "comm").write_text("modem\n")
    (tmp_path / "proc" / "78").mkdir()
    assert port_users(str(device), tmp_path / "proc") == ["modem (77)"]
    assert port_users(str(tmp_path / "else"), tmp_path / "proc") == []


@pytest.fixture
def adapters(monkeypatch):
    """Set the adapters that the system lists."""
    from serial.tools import list_ports, list_ports_common

    def adapter(path, number):
        info = list_ports_common.ListPortInfo(path)
        info.serial_number, info.manufacturer, info.product = number, "FTDI", "TTL232R"
        return info

    found = []
    monkeypatch.setattr(list_ports, "comports", lambda: [adapter(*each) for each in found])
    return found


def run(*arguments):
    return CliRunner().invoke(cli, ["doctor", *map(str, arguments)])


def test_command_without_a_configuration(adapters, tmp_path):
    done = run()
    assert done.exit_code == 2
    assert "none: plug an adapter in" in done.stdout
    port = tmp_path / "ttyUSB0"
    port.touch()
    adapters.append((str(port), "FT4QXYZ"))
    done = run()
    assert done.exit_code == 0
    assert f'ok      {port}  FTDI TTL232R  port = "serial:FT4QXYZ"' in done.stdout
    records = [json.loads(each) for each in run("--json").stdout.splitlines()]
    assert records[0]["serial_number"] == "FT4QXYZ"
    assert records[-1] == {"kind": "verdict", "ok": True}


def test_ports_that_cannot_be_listed_are_told(monkeypatch):
    from serial.tools import list_ports

    def pulled_out():
        raise TypeError("int() argument must be a string")

    monkeypatch.setattr(list_ports, "comports", pulled_out)
    with pytest.raises(BridgeError, match="cannot be listed"):
        doctor()


SWARM = """
[nodes.1]
[nodes.2]
[links.left]
port = "{left}"
format = "linktrack"
[links.right]
port = "{right}"
format = "linktrack"
node = 2
"""


def test_command_with_a_configuration(adapters, talkers, tmp_path):
    pytest.importorskip("hardware_bridge.config")
    encoders = pytest.importorskip("hardware_bridge.emulator.encoders")
    left, right = encoders.make_encoder("linktrack", "1"), encoders.make_encoder("dw1000", "2")
    ranging = RangeReading(Source(), "2", 3.0, rx_power=-80.0, fp_power=-82.0)
    ports = {
        "left": talkers(lambda k: left.encode([ranging])).path,
        "right": talkers(lambda k: right.encode([ranging])).path,
    }
    path = tmp_path / "swarm.toml"
    path.write_text(SWARM.format(**ports))
    done = run("--config", path, "--seconds", 0.5)
    assert done.exit_code == 2, done.output
    assert "node 1: range to 2" in done.stdout
    assert "sends dw1000, configured linktrack" in done.stdout
    assert done.stdout.rstrip().endswith("1 to mend")
    path.write_text(SWARM.format(**ports).replace('linktrack"\nnode', 'dw1000"\nnode'))
    done = run("--config", path, "--seconds", 0.5, "--json")
    assert done.exit_code == 0, done.output
    assert [json.loads(each)["ok"] for each in done.stdout.splitlines()] == [True, True, True]


def said_by(encoder, device, to):
    said = []
    for k in range(50):
        source = Source(device, ticks=1000 + k, clock=MICROSECONDS_32)
        imu = ImuReading(source, (0.01 * k, 0.0, 0.0), (0.0, 0.0, 9.8))
        ranging = RangeReading(source, to, 3.0 + k / 100, rx_power=-80.0, fp_power=-82.0)
        pose = PoseReading(source, device, (3.0, 0.0, 0.0))
        scan = ScanReading(source, -0.05 * k, 2.0)
        said.append(encoder.encode([imu, ranging, pose, scan]))
    return said


def test_each_format_is_recognised_among_all():
    encoders = pytest.importorskip("hardware_bridge.emulator.encoders")
    for name in encoders.ENCODERS:
        said = said_by(encoders.make_encoder(name, "1"), "1", "2")
        if not any(said):  # its ids are hex digits
            said = said_by(encoders.make_encoder(name, "1A2B"), "1A2B", "3C4D")
        assert heard(said, known_formats()).best() == name
