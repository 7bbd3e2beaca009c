"""Readings of one port as they arrive, and detection of their format."""

import json
import time

import pytest
from click.testing import CliRunner
from line_formats import FORMATS, Talker, line

from agents.cli.main import cli, main
from agents.errors import UsageError
from agents.hardware.inspection.hearing import ENOUGH_FRAMES
from agents.hardware.inspection.sniff import as_line, as_record, sniff
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import DriveReading, RangeReading, Source


@pytest.fixture
def talker():
    each = Talker(lambda k: line("beta", 1, 2, k / 8))
    yield each
    each.close()


@pytest.fixture
def mute():
    each = Talker()
    yield each
    each.close()


def test_shows_every_reading_once_the_format_is_known(talker):
    shown = []
    counts = sniff(
        talker.path, seconds=0.5, formats=FORMATS, show=lambda t, r: shown.append((t, r))
    )
    assert counts.format == "beta"
    assert counts.readings == len(shown) >= ENOUGH_FRAMES
    assert [r.distance for _, r in shown[1:]] == [r.distance + 0.125 for _, r in shown[:-1]]
    assert [t for t, _ in shown] == sorted(t for t, _ in shown)
    assert talker.heard() == b""
    asked = sniff(talker.path, format="beta", seconds=0.3, formats=FORMATS)
    assert asked.format == "beta"
    assert asked.readings > 0


class SlowAtFirst:
    """A format whose first decoding takes longer than the listening time."""

    def __init__(self, each, seconds):
        self._each, self._wait = each, [seconds]

    def __getattr__(self, name):
        return getattr(self._each, name)

    def build(self, key):
        decoder = self._each.build(key)
        feed = decoder.feed

        def slow(data):
            time.sleep(self._wait.pop() if self._wait else 0.0)
            return feed(data)

        decoder.feed = slow
        return decoder


def test_what_is_compiled_first_does_not_count_as_listening(talker):
    formats = {name: SlowAtFirst(each, 0.7) for name, each in FORMATS.items()}
    assert sniff(talker.path, seconds=0.5, formats=formats).readings >= ENOUGH_FRAMES


def test_another_format_than_asked_for(talker):
    with pytest.raises(BridgeError, match="sends beta, not alpha: use --format beta"):
        sniff(talker.path, format="alpha", seconds=0.5, formats=FORMATS)


def test_silence_and_noise_are_told(mute):
    with pytest.raises(BridgeError, match="silent: see that the device has power"):
        sniff(mute.path, seconds=0.1, formats=FORMATS)
    noise = Talker(lambda k: bytes([200, k % 256, 7, 255]) * 10)
    try:
        with pytest.raises(BridgeError, match="the baud rate 115200 seems wrong"):
            sniff(noise.path, seconds=0.3, formats=FORMATS)
        chunks = []
        raw = sniff(
            noise.path, seconds=0.3, formats=FORMATS, show_chunk=lambda t, c: chunks.append(c.data)
        )
        assert raw.format is None
        assert len(b"".join(chunks)) == raw.n_bytes > 0
    finally:
        noise.close()


def test_what_cannot_be_asked_for(mute):
    with pytest.raises(UsageError, match="--format: expected one of alpha, beta, got 'gamma'"):
        sniff(mute.path, format="gamma", formats=FORMATS)
    with pytest.raises(UsageError, match="--seconds"):
        sniff(mute.path, seconds=-1.0, formats=FORMATS)
    with pytest.raises(BridgeError, match="no port"):
        sniff("/dev/none", seconds=0.1, formats=FORMATS)


def test_ctrl_c_ends_it_with_counts(talker):
    def stop(t, reading):
        raise KeyboardInterrupt

    assert sniff(talker.path, formats=FORMATS, show=stop).format == "beta"


def test_readings_as_records_and_lines():
    reading = RangeReading(Source("1", boot=9, sequence=4), "2", 3.25, rx_power=float("nan"))
    record = as_record(1.5, reading)
    assert record == {
        "kind": "range", "t_s": 1.5, "device": "1", "boot": 9, "sequence": 4, "to": "2",
        "distance": 3.25, "rx_power": None,
    }  # fmt: skip
    json.dumps(record, allow_nan=False)
    assert "distance 3.250" in as_line(1.5, reading)
    drive = DriveReading(Source(), "3", 0.5, -0.1, brake=False)
    assert as_record(0.0, drive)["kind"] == "drive"
    assert "brake False" in as_line(0.0, drive)


@pytest.fixture
def formats(monkeypatch):
    monkeypatch.setattr("agents.hardware.inspection.sniff.known_formats", lambda: FORMATS)


def test_command_json(talker, formats):
    done = CliRunner().invoke(cli, ["sniff", talker.path, "--seconds", "0.4", "--json"])
    assert done.exit_code == 0, done.output
    records = [json.loads(each) for each in done.stdout.splitlines()]
    assert {r["kind"] for r in records} == {"range", "counts"}
    assert records[-1]["format"] == "beta"
    assert records[-1]["readings"] == len(records) - 1


def test_command_table_and_raw(talker, formats):
    done = CliRunner().invoke(cli, ["sniff", talker.path, "--seconds", "0.4"])
    assert "sends beta" in done.stdout.splitlines()[-1]
    assert "range" in done.stdout
    done = CliRunner().invoke(cli, ["sniff", talker.path, "--seconds", "0.4", "--raw"])
    assert b"beta".hex(" ") in done.stdout
    assert "  range" not in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["sniff", "/dev/none"], "no port /dev/none: plug it in"),
        (["sniff", "tcp:host"], "expected tcp:host:port"),
        (["sniff", "serial:UNNAMED"], "no adapter with serial number UNNAMED"),
        (["sniff", "/dev/null", "--key", "zz"], "--key: expected 16 bytes as 32 hex digits"),
        (["doctor", "--seconds", "0"], "--seconds: expected 0.1 to 3600"),
    ],
)
def test_bad_input_ends_in_one_line_and_status_2(arguments, said, formats, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["relpos", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
