"""The hardware page is correct: its files are read, compiled and run."""

import ast
import os
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from agents.evaluation.calibrate import calibrate_ranges
from hardware_bridge.config import parse_config, read_config
from hardware_bridge.decoders.relpos import RelposDecoder
from hardware_bridge.drivers.relpos import RelposDriver, RelposOptions
from hardware_bridge.ingest.intake import Intake
from hardware_bridge.links.ports import Chunk
from hardware_bridge.live.start import StartParams, wriggle
from hardware_bridge.readings import (
    AckReading,
    ImuReading,
    MotionReading,
    RangeReading,
    StatusReading,
)
from hardware_bridge.safety.gate import REASONS
from hardware_bridge.safety.geometry.braking import stopping_way
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.rules import RULES
from tracking.log import Log, read_log, write_log
from tracking.measurements import Kind, MeasurementBlock

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "examples" / "firmware"
EXAMPLE = ROOT / "examples" / "three_cars.toml"
PAGE = (ROOT / "docs" / "how-to" / "hardware.md").read_text()
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion"]
CAREFUL = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
KEY = bytes(range(16))
DEADMAN = 200


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return the folder of both skeletons, compiled without and with a key."""
    compiler = next((c for c in ("cc", "gcc", "clang") if shutil.which(c)), None)
    if compiler is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("firmware")
    for part in ("node", "car"):
        for keyed in (False, True):
            define = ["-DMY_KEY={" + ",".join(map(str, KEY)) + "}"] if keyed else []
            sources = [FIRMWARE / f"{part}_skeleton.c", FIRMWARE / "computer.c"]
            out = folder / f"{part}{'_keyed' * keyed}"
            flags = [*STRICT, *CAREFUL, f"-D{part.upper()}", *define]
            include = ["-I", ROOT / "hardware_bridge" / "wire", "-I", FIRMWARE]
            subprocess.run([compiler, *flags, *include, "-o", out, *sources], check=True)
    return folder


def run(program, milliseconds, said=b""):
    # The leak detection of the sanitizer does not work where processes are traced.
    env = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}
    command = [program, str(milliseconds)]
    return subprocess.run(command, input=said, capture_output=True, check=True, env=env)


def drive(program, milliseconds, commands):
    """Run a car; return the commands of its motor and the bytes it sent.

    Args:
        program: Program of the car.
        milliseconds: Run time [ms].
        commands: Time [ms] and bytes.
    """
    lines = "".join(f"{t} {data.hex()}\n" for t, data in commands)
    done = run(program, milliseconds, lines.encode())
    motor = [line.split() for line in done.stderr.decode().splitlines()]
    return [(int(t), rest) for t, *rest in motor], done.stdout


class Host:
    """Commands of the host with their arrival times [ms]."""

    def __init__(self, boot=100, key=None, node=1):
        self._t = 0
        # The counter wraps within the test.
        now_us = lambda: (4_294_900_000 + 1000 * self._t) % (1 << 32)  # noqa: E731
        self._driver = RelposDriver(node, RelposOptions(), key, boot, now_us)

    def drive(self, t, speed, steering=0.0, late=0):
        self._t = t
        return t + late, self._driver.drive(speed, steering)

    def brake(self, t, late=0):
        self._t = t
        return t + late, self._driver.neutral()


class TestNode:
    """Output of the skeleton of a node."""

    @pytest.mark.parametrize("key", [None, KEY], ids=["open", "keyed"])
    def test_rates_and_values(self, built, key):
        data = run(built / ("node_keyed" if key else "node"), 3000).stdout
        decoder = RelposDecoder(key)
        readings = decoder.feed(data)
        assert decoder.counts.damaged == decoder.counts.strange == decoder.waiting == 0
        n = Counter(type(r) for r in readings)
        assert n == {ImuReading: 300, RangeReading: 300, StatusReading: 2}
        for r in readings:
            assert (r.source.device, r.source.boot) == ("1", 7)
            if isinstance(r, ImuReading):
                assert r.gyr == pytest.approx((0.01, -0.02, 0.03), abs=1e-5)
                assert r.acc == pytest.approx((0.0, 0.0, 9.81), abs=2.2e-3)
                assert r.mag == pytest.approx((20.0, 0.0, -43.0), abs=1e-3)
            elif isinstance(r, RangeReading):
                assert (r.to, r.distance) in (("2", 1.5), ("3", 2.25))
                assert r.rx_power == (-81.0 if r.to == "2" else None)
            else:
                assert r.voltage == pytest.approx(7.4, abs=1e-3)
        numbers = list(dict.fromkeys(r.source.sequence for r in readings))
        assert numbers == list(range(len(numbers)))
        # The documented rate fits into 115200 baud, with ten bits per byte.
        assert len(data) / 3.0 < 11520

    def test_a_swarm_takes_it(self, built):
        """Readings pass decoder, identity and clock, across a wrap of the counter."""
        swarm = parse_config(
            "[nodes.1]\n[nodes.2]\n[nodes.3]\n[links.a]\nport = '/dev/x'\nformat = 'relpos'\n",
            file="swarm.toml",
            folder=ROOT,
        )
        intake = Intake(swarm, 0)
        data = run(built / "node", 3000).stdout
        frames = [b"\0" + f + b"\0" for f in data.split(b"\0") if f]
        decoder = RelposDecoder()
        for frame in frames:
            source = decoder.feed(frame)[0].source
            since = (source.ticks - 4294000000) % (1 << 32)
            intake.take(Chunk("links.a", since * 1000 + 2_000_000, frame))
        assert not intake.refused
        assert not intake.notices
        block = MeasurementBlock.empty(1, 1024)
        intake.events.move_into(block)
        imu = block.t[0][block.valid[0] & (block.kind[0] == Kind.IMU)]
        assert len(imu) == 300
        assert np.diff(imu[30:]) == pytest.approx(0.01, abs=1e-3)


class TestCar:
    """Commands obeyed by the skeleton of a car."""

    @pytest.mark.parametrize("key", [None, KEY], ids=["open", "keyed"])
    def test_obeys_and_tells(self, built, key):
        host, program = Host(key=key), built / ("car_keyed" if key else "car")
        commands = [host.drive(t, 0.5, -0.1) for t in range(10, 500, 10)]
        motor, said = drive(program, 600, commands)
        assert motor[0] == (0, ["brake"])
        assert [rest for _, rest in motor[1:50]] == [["0.500", "-0.100"]] * 49
        decoder = RelposDecoder(key)
        readings = decoder.feed(said)
        assert decoder.counts.damaged == 0
        assert [r.command for r in readings if isinstance(r, AckReading)] == list(range(49))
        motion = [r for r in readings if isinstance(r, MotionReading)]
        assert len(motion) == 29
        assert (motion[10].speed, motion[10].steering) == pytest.approx((0.5, -0.1), abs=1e-3)

    def test_stops_without_commands(self, built):
        motor, _ = drive(built / "car", 1000, [Host().drive(100, 0.5)])
        assert motor[1:] == [(100, ["0.500", "0.000"]), (100 + DEADMAN, ["brake"])]

    def test_brakes_when_told(self, built):
        host = Host()
        motor, _ = drive(built / "car", 300, [host.drive(50, 0.5), host.brake(60)])
        assert motor[-1] == (60, ["brake"])

    def test_limits_are_its_own(self, built):
        motor, _ = drive(built / "car", 100, [Host().drive(50, 2.0, 0.42)])
        assert motor[-1] == (50, ["1.000", "0.420"])

    def test_takes_nothing_twice(self, built):
        host = Host()
        old, new = host.drive(50, 0.5), host.brake(60)
        motor, _ = drive(built / "car", 300, [old, new, (70, old[1]), (80, new[1])])
        assert motor[1:] == [(50, ["0.500", "0.000"]), (60, ["brake"])]

    def test_does_not_drive_on_old_commands(self, built):
        """After a network outage all commands are delivered at once."""
        host = Host()
        before = [host.drive(t, 0.5) for t in range(10, 100, 10)]
        held_up = [host.drive(t, 0.5, late=900 - t) for t in range(100, 400, 10)]
        after = [host.drive(t, 0.3) for t in range(910, 950, 10)]
        motor, _ = drive(built / "car", 950, [*before, *held_up, *after])
        stopped = motor.index((90 + DEADMAN, ["brake"]))
        assert motor[stopped + 1 :] == [(t, ["0.300", "0.000"]) for t in range(910, 950, 10)]

    def test_brakes_on_old_commands(self, built):
        host = Host()
        commands = [host.drive(50, 0.5), host.brake(60, late=150), host.drive(230, 0.5)]
        motor, _ = drive(built / "car", 240, commands)
        assert [t for t, _ in motor[1:]] == [50, 210, 230]

    def test_is_not_meant(self, built):
        motor, _ = drive(built / "car", 100, [Host(node=2).drive(50, 0.5)])
        assert motor == [(0, ["brake"])]

    def test_the_host_starts_anew(self, built):
        commands = [Host(boot=100).drive(50, 0.5), Host(boot=90).drive(60, 0.4)]
        motor, _ = drive(built / "car", 100, commands)
        assert motor[-1] == (60, ["0.400", "0.000"])

    def test_with_a_key_only_later_starts_count(self, built):
        recorded = Host(100, KEY).drive(50, 0.5)
        commands = [recorded, Host(101, KEY).brake(60), (70, recorded[1])]
        commands += [Host(200, bytes(16)).drive(80, 0.5), Host(200).drive(90, 0.5)]
        motor, _ = drive(built / "car_keyed", 150, commands)
        assert motor[1:] == [(50, ["0.500", "0.000"]), (60, ["brake"])]


class TestExample:
    """Tests of examples/three_cars.toml."""

    def test_it_is_read(self):
        swarm = read_config(EXAMPLE)
        assert swarm.n_slots == len(swarm.cars) == len(swarm.links) == 3
        assert swarm.calibration is None, "so that nothing can be armed before there is one"
        assert (swarm.safety.max_speed, swarm.safety.slow) == (0.5, 0.2)
        for car in swarm.cars:
            options = car.options
            assert options["min_erpm"] / options["speed_to_erpm"] < swarm.safety.slow

    def test_what_is_commented_out_is_read(self):
        text = EXAMPLE.read_text()
        for line in re.findall(r"^# ((?:\[|\w+ = ).*)$", text, flags=re.MULTILINE):
            text = text.replace(f"# {line}\n", f"{line}\n")
        text = text.replace('"2" = 3 }', '"2" = 3, "3" = 4 }')
        swarm = parse_config(text, file=EXAMPLE.name, folder=ROOT, with_files=False)
        assert swarm.safety.fence.node == 4
        assert len(swarm.links) == 4
        assert len(swarm.calibration) == 2

    @pytest.mark.parametrize("text", re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL))
    def test_pieces_on_the_page(self, text):
        """Each snippet replaces or extends tables of the example."""
        import tomllib

        piece, whole = tomllib.loads(text), tomllib.loads(EXAMPLE.read_text())
        assert piece.keys() <= {*whole, "calibration", "nodes"}


class TestPage:
    """Tests of docs/how-to/hardware.md."""

    def test_the_start_keeps_to_its_place(self):
        """The cars stay within half a metre if the wheels follow the commands."""
        params = StartParams()
        step = 0.01
        for n in (2, 3, 6):
            pos, yaw = np.zeros((n, 2)), np.zeros(n)
            furthest = 0.0
            for k in range(round(6.0 / step)):
                speed, steering = (x[0] for x in wriggle(params, n, k * step))
                pos += step * speed[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
                yaw += step * speed * np.tan(steering) / 0.3
                furthest = max(furthest, float(np.hypot(*pos.T).max()))
            assert furthest < 0.5, n

    def test_truth_of_boards_that_stand(self, tmp_path, monkeypatch):
        """The snippet makes a log from which the ranges can be calibrated."""
        snippet = next(
            s for s in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "truth" in s
        )
        places = re.findall(r"\((\d+\.0), (\d+\.0), (\{.*?\})\)", snippet)
        placed = [(float(a), float(b), ast.literal_eval(where)) for a, b, where in places]
        assert len(placed) == 2
        rng = np.random.default_rng(3)
        offset = np.array([0.1, 0.2, 0.3])
        pairs = np.array([[0, 1], [0, 2], [1, 2]])
        blocks = []
        for start, end, where in placed:
            pos = np.array([where[k] for k in (1, 2, 3)])
            for i, j in pairs:
                t = np.arange(start + 1.0, end - 1.0, 0.1)
                way = np.linalg.norm(pos[i] - pos[j]) + offset[i] + offset[j]
                d = way + 0.02 * rng.normal(size=(len(t), 1))
                ends = np.full(len(t), i), np.full(len(t), j)
                blocks.append(
                    MeasurementBlock.of_kind(Kind.RANGE, t, ends[0], d, j=ends[1], antennas=ends)
                )
        block = MeasurementBlock.concatenate(blocks).sorted()
        group = read_config(EXAMPLE).constellation
        (tmp_path / "ranged").mkdir()
        write_log(tmp_path / "ranged" / "log", Log(name="x", constellation=group, block=block))
        monkeypatch.chdir(tmp_path)
        exec(snippet, {})
        result = calibrate_ranges(read_log(tmp_path / "ranged" / "log"))
        found = result.calibration.ranges.offset
        assert [found[k] for k in (1, 2, 3)] == pytest.approx(offset.tolist(), abs=0.02)

    def test_every_reason_is_explained(self):
        for reason in (*(rule.meaning for rule in RULES), *filter(None, REASONS.values())):
            assert f"| {reason} |" in PAGE

    @pytest.mark.parametrize("speed", [0.5, 1.0, 1.5])
    def test_ways_to_a_stop(self, speed):
        p = SafetyParams()
        way = float(stopping_way(np.array(speed), p.reaction, p.braking))
        lost = way + speed * 1e-3 * DEADMAN
        assert f"| {speed} m/s | {way:.2f} m | {lost:.2f} m |" in PAGE
