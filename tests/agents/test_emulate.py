"""The emulated world equals the simulated one, with any byte streams to the host."""

import json
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils import seeding

from agents.hardware.emulate import EmulatedRig, EmulateOptions, emulate
from agents.hardware.emulate.interrupts import Interrupts
from agents.hardware.emulate.pace import Pace
from agents.hardware.emulate.rig import STEP_NS
from agents.hardware.emulate.world import AT_REST, STEPS, EmulatedWorld
from hardware_bridge.decoders import make_decoder
from hardware_bridge.drivers import make_driver
from hardware_bridge.emulator.fault_plan import FAULT_KINDS, Fault, FaultPlan, parse_faults
from hardware_bridge.emulator.faults import FaultParams
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    AckReading,
    ImuReading,
    MotionReading,
    OperatorReading,
    RangeReading,
)
from relpos_env.core.env_core import EnvCore
from relpos_env.errors import EnvError
from relpos_env.timing import STAND_STILL
from tracking.log import read_log

RELPOS = Path(sys.executable).with_name("relpos")
KEY = bytes(range(16))


def formation_of(options):
    formation = EnvCore(options.parts(), physics="pymunk")
    formation.seed(0, seeding.np_random(options.seed)[0])
    formation.begin([0])
    return formation


def commands(n_cars, cycles, seed=3):
    """Return speeds and steering angles rounded as on the wire, (step, car)."""
    rng = np.random.default_rng(seed)
    speed = rng.uniform(-0.5, 1.5, (cycles, n_cars)).round(3)
    return speed, rng.uniform(-0.4, 0.4, (cycles, n_cars)).round(4)


def same(world, formation):
    there, here = formation.state, world.swarm.state
    np.testing.assert_array_equal(here.pos_w, there.pos_w)
    np.testing.assert_array_equal(here.heading, there.heading)
    np.testing.assert_array_equal(here.present, there.present)
    trim = formation.operator.command - formation.task.plan
    np.testing.assert_array_equal(world.command, np.where(there.present[0][:, None], trim[0], 0.0))
    np.testing.assert_array_equal(world.motion()[0], formation.loop.swarm.odometer[0])
    error = formation.task.error[0, there.present[0]]
    assert world.error == error.mean()


@pytest.mark.parametrize(
    ("task", "scenario", "seconds"),
    [("ring", "ring-nlos", 4.0), ("hold", "random", 30.0), ("travel", "hall", 4.0)],
)
def test_the_world_goes_as_the_environment_goes(task, scenario, seconds):
    options = EmulateOptions(task=task, scenario=scenario, seed=11, seconds=seconds)
    world, formation = EmulatedWorld(options.parts(), options.seed), formation_of(options)
    n = world.parts.n_cars
    for _ in range(AT_REST):
        assert world.at_rest
        assert not world.command.any()
        world.step(np.zeros(n), np.zeros(n))
    same(world, formation)
    contacts = 0
    for speed, steering in zip(*commands(n, options.cycles), strict=True):
        formation.step(speed[None], steering[None])
        for _ in range(STEPS):
            world.step(speed, steering)
        contacts += int(formation.loop.swarm.contacts.sum())
        same(world, formation)
    assert world.collisions == contacts


class Host:
    """A host that drives the cars of a rig through bytes, and decodes its output."""

    def __init__(self, rig):
        self.rig, options, ids = rig, rig.options, rig.constellation.ids
        key = options.car_key
        self.drivers = [
            make_driver(options.driver, k, options.driver_options, key, 7, lambda: 0) for k in ids
        ]
        self.readings = {}
        self.decoders = {}
        for name in rig.ports:
            if not name.startswith("car"):
                known = rig.emulator.lines
                wire = next(
                    (
                        wire
                        for device in rig.emulator.nodes
                        for line, wire in zip(device.lines, device.node.formats, strict=True)
                        if line.name == name
                    ),
                    None,
                )
                form = "relpos" if wire is None else wire.name
                assert name in [line.name for line in known]
                self.decoders[name] = make_decoder(form, options.key if form == "relpos" else None)

    def step(self, speed, steering):
        for k, driver in enumerate(self.drivers):
            port = self.rig.ports[f"car{self.rig.constellation.ids[k]}"]
            port.send(driver.drive(float(speed[k]), float(steering[k])) + driver.ask())
        self.rig.step()
        for name, decoder in self.decoders.items():
            self.readings.setdefault(name, []).extend(decoder.feed(self.rig.ports[name].receive()))
        for k, driver in enumerate(self.drivers):
            name = f"car{self.rig.constellation.ids[k]}"
            got = driver.telemetry.feed(self.rig.ports[name].receive())
            self.readings.setdefault(name, []).extend(got)


@pytest.mark.parametrize("key", [None, KEY])
def test_driven_through_bytes_it_goes_as_the_environment_with_the_same_commands(key):
    options = EmulateOptions(task="ring", seed=5, seconds=3.0, key=key)
    rig, formation = EmulatedRig(options), formation_of(options)
    host, n = Host(rig), rig.world.parts.n_cars
    for _ in range(AT_REST):
        # Cars are held regardless of commands.
        host.step(np.ones(n), np.zeros(n))
    same(rig.world, formation)
    for speed, steering in zip(*commands(n, options.cycles), strict=True):
        formation.step(speed[None], steering[None])
        for _ in range(STEPS):
            host.step(speed, steering)
        same(rig.world, formation)
    motion = [r for r in host.readings["car1"] if isinstance(r, MotionReading)]
    assert abs(len(motion) - 50 * 5.0) <= 1
    assert abs(motion[-1].speed - rig.world.motion()[0][0]) < 0.5
    acks = [r.command for r in host.readings["car1"] if isinstance(r, AckReading)]
    assert acks == list(range(acks[0], acks[0] + len(acks)))
    assert len(acks) >= 495
    wishes = [r for r in host.readings["operator"] if isinstance(r, OperatorReading)]
    assert len(wishes) == 31 * n
    expected = {r.to: r.velocity for r in wishes}
    np.testing.assert_allclose(
        [expected[str(k)] for k in rig.constellation.ids], rig.world.command, atol=6e-4
    )
    rig.close()


@pytest.mark.parametrize(
    ("form", "driver"), [("linktrack", "vesc"), ("uwb-core", "vesc"), ("dw1000", "pwm")]
)
def test_other_devices_measure_and_drive_too(form, driver):
    options = EmulateOptions(task="ring", seed=5, seconds=2.0, format=form, driver=driver)
    rig = EmulatedRig(options)
    host, n = Host(rig), rig.world.parts.n_cars
    start = rig.world.swarm.state.pos_w[0].copy()
    for _ in range(AT_REST + 200):
        host.step(np.full(n, 0.8), np.zeros(n))
    moved = np.linalg.norm(rig.world.swarm.state.pos_w[0] - start, axis=1)
    assert moved.max() > 0.5
    assert len([r for r in host.readings["n1"] if isinstance(r, RangeReading)]) > 50
    assert len([r for r in host.readings["n1-2"] if isinstance(r, ImuReading)]) > 390
    for decoder in host.decoders.values():
        assert decoder.counts.damaged == 0
    rig.close()


def test_a_car_that_hears_nothing_stops():
    rig = EmulatedRig(EmulateOptions(task="ring", seed=5, seconds=5.0))
    host, n = Host(rig), rig.world.parts.n_cars
    for _ in range(AT_REST + 100):
        host.step(np.ones(n), np.zeros(n))
    assert np.abs(rig.world.motion()[0]).max() > 0.3
    for _ in range(200):
        rig.step()
    assert np.abs(rig.world.swarm.state.vel_w).max() < 0.05
    rig.close()


def test_faults_happen_to_what_they_are_aimed_at():
    faults = [
        Fault(t=0.5, kind="unplug", target="nodes.1", seconds=0.5),
        Fault(t=0.5, kind="reboot", target="nodes.2", seconds=0.3),
        Fault(t=0.5, kind="duplicate-id", target="nodes.3", seconds=0.5),
        Fault(t=0.5, kind="silence", target="cars.1", seconds=0.5),
        Fault(t=0.5, kind="reboot", target="cars.2", seconds=0.4),
        Fault(t=2.2, kind="unplug", target="links.operator", seconds=0.2),
        Fault(t=1.5, kind="clock-step", target="nodes.1", seconds=5.0),
        Fault(t=1.5, kind="stuck-sensor", target="nodes.2", seconds=0.5),
    ]
    options = EmulateOptions(seed=5, seconds=1.0, faults=FaultPlan(faults=tuple(faults)))
    rig = EmulatedRig(options)
    host, n = Host(rig), rig.world.parts.n_cars
    plugged = []
    for _ in range(250):
        host.step(np.zeros(n), np.zeros(n))
        plugged.append(rig.ports["n1"].plugged)
    assert plugged.count(False) == pytest.approx(50, abs=2)
    assert rig.ports["n1"].counts.unread > 1000
    boots = {k: {r.source.boot for r in host.readings[f"n{k}"]} for k in (1, 2, 3)}
    assert [len(boots[k]) for k in (1, 2, 3)] == [1, 2, 2]
    assert {r.source.device for r in host.readings["n3"]} == {"3"}
    starts = [r.source.boot for r in host.readings["car2"] if isinstance(r, MotionReading)]
    assert starts == sorted(starts)
    assert len(set(starts)) == 2
    ticks = [r.source.ticks for r in host.readings["n1"]]
    assert max(np.diff(ticks)) > 4_900_000
    gyros = [r.gyr for r in host.readings["n2"] if isinstance(r, ImuReading)]
    assert len(gyros) - len(set(gyros)) >= 45
    quiet = {k: len([r for r in host.readings[f"car{k}"] if isinstance(r, MotionReading)])
             for k in (1, 2, 3)}  # fmt: skip
    assert quiet[1] == pytest.approx(quiet[3] - 25, abs=2)
    assert quiet[2] == pytest.approx(quiet[3] - 20, abs=2)
    wishes = [r for r in host.readings["operator"] if isinstance(r, OperatorReading)]
    assert len(wishes) == pytest.approx(4 * n, abs=n)
    assert len(rig.emulator.happened) == len(faults)
    rig.close()


def test_faults_of_frames_are_counted_and_survived():
    frames = FaultParams(loss=0.1, corruption=0.05, truncation=0.02, delay=0.01)
    options = EmulateOptions(seed=5, seconds=1.0, faults=FaultPlan(frames=frames))
    rig = EmulatedRig(options)
    host, n = Host(rig), rig.world.parts.n_cars
    for _ in range(300):
        host.step(np.zeros(n), np.zeros(n))
    for device in rig.emulator.nodes:
        (line,) = device.lines
        counts = host.decoders[line.name].counts
        assert 0.05 * line.frames < line.injector.lost < 0.15 * line.frames
        assert counts.damaged > 0
        assert counts.frames <= line.frames - line.injector.lost
        assert counts.frames >= line.frames - line.injector.lost - 2 * line.injector.damaged - 2
    rig.close()


def test_same_options_same_bytes():
    def run(seed):
        rig = EmulatedRig(EmulateOptions(seed=seed, seconds=0.5))
        for _ in range(60):
            rig.step()
        data = {name: port.receive() for name, port in rig.ports.items()}
        rig.close()
        return data

    assert run(1) == run(1)
    assert run(1)["n1"] != run(2)["n1"]


class Clock:
    """A clock that advances in sleep, and slightly at every reading."""

    def __init__(self):
        self.now = 10**12

    def __call__(self):
        self.now += 1000
        return self.now

    def sleep(self, seconds):
        self.now += round(1e9 * seconds)


def test_a_run_writes_what_is_needed_to_drive_it(tmp_path):
    clock, seen, seconds = Clock(), [], []

    def ready(rig):
        seen.append(tomllib.loads((tmp_path / "e" / "swarm.toml").read_text()))
        for table in [*seen[0]["links"].values(), *seen[0]["cars"].values()]:
            assert Path(table["port"]).is_absolute()
            assert Path(table["port"]).exists()

    result = emulate(
        folder=tmp_path / "e", log=tmp_path / "log", wait=0.1, ready=ready, report=seconds.append,
        clock=clock, sleep=clock.sleep, seconds=3.0, seed=2, format="dw1000", driver="vesc",
        driver_options={"min_erpm": 500.0},
    )  # fmt: skip
    (swarm,) = seen
    assert swarm["links"]["n2"]["ids"] == {"0001": 1, "0002": 2, "0003": 3}
    assert swarm["links"]["n2"]["node"] == swarm["links"]["n2-2"]["node"] == 2
    assert swarm["cars"]["1"]["options"] == {"min_erpm": 500.0}
    assert swarm["task"]["command"] == "link"
    assert not list((tmp_path / "e").glob("n*"))
    assert len(result.t) == len(result.error) == 31
    assert result.t[0] == pytest.approx(0.0, abs=1e-9)
    assert result.lateness.late == 0
    assert result.lateness.steps == 500
    assert len(seconds) == 5
    assert {json.dumps(record, allow_nan=False) for record in [*seconds, result.summary]}
    log = read_log(tmp_path / "log")
    assert log.duration == pytest.approx(STAND_STILL + 3.0, abs=0.05)
    assert log.truth is not None
    assert np.isfinite(result.formation_error)


def test_ctrl_c_ends_a_run_with_what_there_is(tmp_path):
    clock = Clock()

    def sleep(seconds):
        clock.sleep(seconds)
        if clock.now > 10**12 + 4 * 10**9:
            raise KeyboardInterrupt

    result = emulate(folder=tmp_path, clock=clock, sleep=sleep, seconds=60.0)
    assert 1.0 < result.seconds < 2.5
    assert not list(tmp_path.glob("car*"))


def test_the_world_waits_for_a_host(tmp_path):
    import os

    clock = Clock()
    hosts = []

    def ready(rig):
        hosts.append(os.open(tmp_path / "car1", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK))
        os.write(hosts[0], b"\0")

    result = emulate(
        folder=tmp_path, clock=clock, sleep=clock.sleep, ready=ready, wait=3600.0, seconds=0.2
    )
    os.close(hosts[0])
    assert clock.now < 10**12 + 100 * 10**9
    assert next(line for line in result.lines if line["line"] == "car1")["read"] == 1


def test_late_steps_are_told_and_made_up_for():
    clock = Clock()
    pace = Pace(STEP_NS, clock, clock.sleep)
    start = clock.now
    pace.wait()
    clock.now += 35_000_000
    for _ in range(9):
        pace.wait()
    assert pace.lateness.late == 2
    assert 2.4e7 < pace.lateness.worst_ns < 2.6e7
    assert clock.now - start < 1e8
    clock.now += 10**10
    for _ in range(11):
        pace.wait()
    assert clock.now - start > 1.01e10
    assert pace.lateness.late == 3


def test_what_makes_no_sense_is_refused(tmp_path):
    with pytest.raises(EnvError, match="seconds"):
        EmulateOptions(seconds=0.0)
    with pytest.raises(EnvError, match="seed"):
        EmulateOptions(seed=-1)
    with pytest.raises(BridgeError, match="key"):
        EmulateOptions(key=b"short")
    with pytest.raises(EnvError, match="task"):
        EmulatedRig(EmulateOptions(task="fly"), tmp_path)
    with pytest.raises(BridgeError, match=r"cars\.1\.driver"):
        EmulatedRig(EmulateOptions(driver="horse"), tmp_path)
    plan = FaultPlan(faults=(Fault(t=1.0, kind="reboot", target="nodes.9"),))
    with pytest.raises(BridgeError, match=r"faults\[0\]\.target"):
        EmulatedRig(EmulateOptions(faults=plan), tmp_path)
    assert not list(tmp_path.iterdir())
    with pytest.raises(EnvError, match="wait"):
        emulate(folder=tmp_path, wait=-1.0)


def test_the_command_line(tmp_path):
    def relpos(*args):
        command = [str(RELPOS), "emulate", "--out", str(tmp_path / "e"), *args]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    done = relpos("--seconds", "0.5", "--json", "--key", KEY.hex())
    assert done.returncode == 0, done.stderr
    records = [json.loads(line) for line in done.stdout.splitlines()]
    assert [r["result"] for r in records] == [
        "ready", "second", "second", *["line"] * 7, "emulation",
    ]  # fmt: skip
    done = relpos("--format", "smoke")
    assert done.returncode == 2
    assert done.stderr.startswith("Error: format: expected one of relpos")
    assert len(done.stderr.splitlines()) == 1


def test_whoever_ends_it_from_outside_gets_its_figures(tmp_path):
    command = [str(RELPOS), "emulate", "--out", str(tmp_path), "--json", "--wait", "600"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with process:
        ready = json.loads(process.stdout.readline())
        assert ready["result"] == "ready"
        assert (tmp_path / "swarm.toml").exists()
        assert (tmp_path / "n1").exists()
        process.terminate()
        rest = process.stdout.read().splitlines()
    assert process.returncode == 0
    assert json.loads(rest[-1])["result"] == "emulation"
    assert not (tmp_path / "n1").is_symlink()


def test_whoever_ends_it_from_outside_gets_its_log(tmp_path):
    command = [str(RELPOS), "emulate", "--out", str(tmp_path / "e"), "--json"]
    command += ["--log", str(tmp_path / "log")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with process:
        told = [json.loads(process.stdout.readline())["result"] for _ in range(3)]
        assert told == ["ready", "second", "second"]
        process.terminate()
        rest = process.stdout.read().splitlines()
    assert process.returncode == 0
    assert json.loads(rest[-1])["result"] == "emulation"
    assert 1.9 < read_log(tmp_path / "log").duration < 30.0


INTERRUPTED = """
import gzip, os, signal, sys
from agents.cli.main import main

compress = gzip.compress

def interrupted(*args, **options):
    # Before every file of the log.
    for which in (signal.SIGTERM, signal.SIGINT):
        os.kill(os.getpid(), which)
    print("interrupted", file=sys.stderr)
    return compress(*args, **options)

gzip.compress = interrupted
main()
"""


def test_a_log_that_is_being_written_is_written_whole(tmp_path):
    command = [sys.executable, "-c", INTERRUPTED, "emulate", "--out", str(tmp_path / "e")]
    command += ["--json", "--seconds", "0.5", "--log", str(tmp_path / "log")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert set(done.stderr.splitlines()) == {"interrupted"}
    assert json.loads(done.stdout.splitlines()[-1])["result"] == "emulation"
    assert read_log(tmp_path / "log").duration == pytest.approx(STAND_STILL + 0.5, abs=0.05)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["e", "log"]


def test_interrupts_come_where_they_are_allowed_and_only_once():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with Interrupts() as interrupts:
            with interrupts.allowed():
                pass
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(KeyboardInterrupt), interrupts.allowed():
                pytest.fail("it came before")
            with interrupts.allowed():
                pass
            with pytest.raises(KeyboardInterrupt), interrupts.allowed():
                signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_signals_that_mean_something_else_are_left_alone():
    heard = []
    own = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        with Interrupts() as interrupts, interrupts.allowed():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, own)
    assert heard == [signal.SIGTERM]


def test_the_page_holds():
    page = (Path(__file__).resolve().parents[2] / "docs" / "how-to" / "emulator.md").read_text()
    example = page.split("```toml\n")[1].split("```")[0]
    plan = parse_faults(tomllib.loads(example))
    assert plan.frames.reordering_by == 0.03
    assert plan.faults[0].kind == "unplug"
    for kind in FAULT_KINDS:
        assert f"| `{kind}` |" in page
    program = page.split("```python\n")[1].split("```")[0]
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split()[1]) > 0.0
