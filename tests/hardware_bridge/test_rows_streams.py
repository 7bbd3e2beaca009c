"""Faults of streams, through bytes, intake, trackers, policy, gate and cars at once."""

import ast
import datetime
import itertools
import time
from pathlib import Path

import numpy as np
import pytest
from virtual_drive import VirtualDrive

import hardware_bridge
from agents.hardware.emulate import EmulateOptions
from hardware_bridge.emulator.fault_plan import FaultPlan
from hardware_bridge.emulator.faults import FaultParams
from hardware_bridge.readings import MICROSECONDS_32, ImuReading, OperatorReading, Source
from hardware_bridge.wire.encoder import RelposEncoder

pytestmark = pytest.mark.slow
SILENT = "stopped: no message from its node, or no estimate"
KEY = bytes(range(16))
CAR_LENGTH = 0.42
"""[m] Length of a car."""


class Watched(VirtualDrive):
    """A drive that checks that disarmed cars do not move, and measures the smallest distance."""

    def __init__(self, options):
        self.nearest, self._stood = np.inf, {}
        super().__init__(options)

    def advance(self):
        t_ns = super().advance()
        places, speed = self.places, self.rig.world.swarm.state.speed[0]
        apart = np.linalg.norm(places[:, None] - places, axis=-1)
        self.nearest = min(self.nearest, apart[~np.eye(len(places), dtype=bool)].min())
        for car, armed in enumerate(self.armed):
            # A stopped car brakes from its top speed within a second, and stays there.
            place, n = self._stood.get(car, (places[car], 0))
            if armed or n < 10:
                place = places[car]
            assert np.linalg.norm(places[car] - place) < 0.02, f"car {car} moved"
            assert armed or n < 10 or abs(speed[car]) < 0.05, f"car {car} moves"
            self._stood[car] = place, 0 if armed else n + 1
        return t_ns

    def mean_error(self, since=0):
        return float(np.nanmean(self.errors[since:]))


@pytest.fixture
def drive():
    """Yield a function that begins a drive of three localised cars."""
    begun = []

    def begin(**options):
        chosen = EmulateOptions(**{"scenario": "cars-nlos", "seed": 3, "seconds": 600.0} | options)
        begun.append(Watched(chosen).start())
        return begun[-1]

    yield begin
    for each in begun:
        assert each.nearest > CAR_LENGTH
        each.close()


@pytest.fixture(scope="module")
def usual():
    """Return the mean error of a drive without faults [m]."""
    options = EmulateOptions(scenario="cars-nlos", seed=3, seconds=600.0)
    each = Watched(options).start()
    n = len(each.errors)
    each.drive(12.0)
    each.close()
    assert each.notices == []
    return each.mean_error(n)


@pytest.mark.parametrize("form", ["relpos", "linktrack", "uwb-core"])
def test_frames_lost_doubled_late_reordered_and_damaged(drive, usual, form):
    frames = FaultParams(
        loss=0.02, corruption=0.01, truncation=0.005, duplication=0.02, reordering=0.02,
        reordering_by=0.03, delay=0.005, delay_spread=0.002,
    )  # fmt: skip
    each = drive(format=form, faults=FaultPlan(frames=frames))
    each.drive(6.0)
    n = len(each.errors)
    each.drive(8.0)
    injectors = [line.injector for device in each.rig.emulator.nodes for line in device.lines]
    assert sum(i.lost for i in injectors) > 0
    intake = each.swarm.intake
    damaged = sum(i.damaged for i in injectors)
    told = sum(s.decoder.counts.damaged for s in intake.streams.values())
    assert told > 0.5 * damaged
    if form == "relpos":
        doubled = sum(i.doubled for i in injectors)
        # A copy of a damaged frame is damaged, too.
        assert 0.8 * doubled < intake.refused["duplicate"] <= doubled
    # Without a check sum a damaged digit may give an unknown name.
    assert [text for text in each.notices if "no node" not in text] == []
    assert each.mean_error(n) < 1.5 * usual + 0.05


@pytest.mark.parametrize("key", [None, KEY], ids=["open", "keyed"])
def test_reboot(drive, usual, key):
    each = drive(key=key)
    each.drive(2.0).befall("reboot", "nodes.1", 1.0)
    each.drive(3.0)
    assert each.notices == [f"cars.1 {SILENT}", "node 1 started again, on link links.n1"]
    assert each.armed == [False, True, True]
    assert each.report.well_for[0] > 0.5
    n = len(each.errors)
    each.order("arm")
    place = each.places[0]
    each.drive(5.0)
    assert each.armed == [True, True, True]
    assert np.linalg.norm(each.places[0] - place) > 0.1
    assert each.mean_error(n) < 1.5 * usual + 0.05


def test_a_ring_closes_again_when_cars_are_armed_again(drive):
    each = drive(scenario="ring-nlos", cars=6)
    each.drive(12.0)
    error = each.env.group.task.error
    assert error.mean() < 0.25
    # The other cars do not know the position of one: all stop while the plan continues.
    each.befall("silence", "nodes.1", 2.0)
    each.drive(8.0)
    assert not any(each.armed)
    assert error.mean() > 1.0
    each.order("arm")
    each.drive(8.0)
    assert all(each.armed)
    assert error.mean() < 0.25


@pytest.mark.parametrize("jump", [-3600.0, -0.08, 0.08, 3600.0])
def test_clock_of_a_node_jumps(drive, usual, jump):
    each = drive()
    each.drive(1.0).befall("clock-step", "nodes.1", jump)
    n = len(each.errors)
    each.drive(6.0)
    assert each.notices == []
    assert each.armed == [True, True, True]
    assert each.mean_error(n) < 1.5 * usual + 0.05


def test_stuck_sensor(drive, usual):
    each = drive()
    each.drive(2.0).befall("stuck-sensor", "nodes.1", 3.0)
    each.drive(1.0)
    stuck = "node 1 repeats its last sample: its sensor is stuck"
    assert each.notices == [stuck, f"cars.1 {SILENT}"]
    assert each.armed == [False, True, True]
    each.drive(4.0)
    assert 250 < each.swarm.intake.refused["stuck"] < 300
    assert each.notices == [stuck, f"cars.1 {SILENT}"]
    n = len(each.errors)
    each.order("arm")
    each.drive(4.0)
    assert each.armed == [True, True, True]
    assert each.mean_error(n) < 1.5 * usual + 0.05


def test_two_nodes_with_one_id(drive):
    each = drive()
    each.drive(2.0).befall("duplicate-id", "nodes.1", 1.5)
    each.drive(1.0)
    assert each.notices[:2] == [
        "node 1 started again, on link links.n1",
        "node 1 is two devices, both on link links.n1: refused until it is released",
    ]
    assert not each.armed[0]
    assert each.swarm.intake.refused["duplicate_id"] > 100
    each.drive(2.0)
    each.order("arm")
    assert not each.supervisor.report().armed[0], "quarantined, though one of them is gone"
    each.swarm.intake.release(1, each.t_ns)
    each.drive(3.0)
    each.order("arm")
    each.drive(1.0)
    assert each.armed[0]


def test_silence(drive):
    each = drive()
    each.drive(2.0).befall("silence", "nodes.1", 1.0)
    since = each.t_ns
    each.drive(0.5)
    gate = [((t - since) / 1e6, out) for t, out in each.gate if t > since]
    slow = next(t for t, out in gate if out.cap[0, 0] <= 0.3)
    stopped = next(t for t, out in gate if not out.moving[0, 0])
    # The last sample and the tick are up to one step old.
    assert 140.0 < slow <= 170.0
    assert 290.0 < stopped <= 320.0
    assert max(abs(out.speed[0, 0]) for t, out in gate if t >= slow) <= 0.3
    assert all(out.moving[0, 1:].all() for _, out in gate)
    each.drive(0.9)
    assert 0.1 < each.report.well_for[0] < 0.5
    each.order("arm")
    assert not each.supervisor.report().armed[0]
    assert any("cars.1 not armed" in text for text in each.notices)
    each.drive(1.5)
    assert not each.armed[0]
    each.order("arm")
    each.drive(0.5)
    assert each.armed[0]


class Attacker:
    """Attacker that records all lines, replays messages and injects forged ones."""

    def __init__(self, each):
        self.each, self.heard, self.n = each, {}, 0
        self.commands = []
        boot = 0xFFFFFFF0
        self.forgers = [RelposEncoder(1, boot, None), RelposEncoder(1, boot, bytes(16))]
        self.operators = [RelposEncoder(0xFFFE, boot, None), RelposEncoder(0xFFFE, boot, bytes(16))]

    def tamper(self, name, data):
        self.n += 1
        before = self.heard.setdefault(name, [])
        before.append(data)
        said = data + b"".join(before[-100:-97])
        source = Source("1", 0xFFFFFFF0, self.n, self.n * 1000, MICROSECONDS_32)
        # Replay messages of the other lines, from nodes, cars and the operator.
        said += b"".join(b"".join(h[-50:-49]) for h in self.heard.values())
        if name.startswith("n"):
            said += b"".join(
                f.encode([ImuReading(source, (9.0, 0.0, 9.0), (50.0, 0.0, 0.0))])
                for f in self.forgers
            )
        if name == "operator":
            source = source._replace(device="65534")
            said += b"".join(f.encode([OperatorReading(source, "1", (2.0, 2.0))])
                             for f in self.operators)  # fmt: skip
        self.commands.append(self.each.sent())
        for car, old in (self.commands[-400] if len(self.commands) > 400 else {}).items():
            self.each.rig.ports[car].slip_in(old)
        return said


def test_spoofed_and_replayed_messages_change_nothing(drive):
    quiet, attacked = drive(key=KEY), drive(key=KEY)
    attacker = Attacker(attacked)
    attacked.tamper = attacker.tamper
    for _ in range(8):
        quiet.drive(0.5)
        attacked.drive(0.5)
        np.testing.assert_array_equal(attacked.places, quiet.places)
        np.testing.assert_array_equal(attacked.swarm.view.pos, quiet.swarm.view.pos)
    intake = attacked.swarm.intake
    assert intake.refused["duplicate"] > 1000
    assert intake.streams["links.n1"].decoder.counts.damaged >= 2 * 400
    assert quiet.swarm.intake.refused == {}
    assert attacked.armed == [True, True, True]


def test_the_clock_on_the_wall_changes_nothing(drive, monkeypatch):
    quiet = drive()
    quiet.drive(3.0)
    hours = itertools.count()

    def jumping():
        return 1e9 + 3600.0 * (-1) ** next(hours)

    class Jumping(datetime.datetime):
        @classmethod
        def now(cls, tz=None):
            return cls.fromtimestamp(jumping(), tz)

    monkeypatch.setattr(time, "time", jumping)
    monkeypatch.setattr(time, "time_ns", lambda: round(jumping() * 1e9))
    monkeypatch.setattr(datetime, "datetime", Jumping)
    jumped = drive()
    jumped.drive(3.0)
    np.testing.assert_array_equal(jumped.places, quiet.places)
    np.testing.assert_array_equal(jumped.errors, quiet.errors)
    assert jumped.notices == quiet.notices


ALLOWED = {
    "live/bridge.py": 1,  # time of a recording, and the boot number, which rises
}
"""Number of reads of the wall clock, by file."""
WALL = {"time", "time_ns", "localtime", "gmtime", "ctime", "asctime"}


def test_nobody_else_reads_the_clock_on_the_wall():
    found = {}
    root = Path(hardware_bridge.__file__).parent
    for path in sorted(root.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module in ("time", "datetime"):
                reads = any(name.name in WALL | {"datetime", "date"} for name in node.names)
            elif isinstance(node, ast.Import):
                reads = any(name.name == "datetime" for name in node.names)
            else:
                reads = (
                    isinstance(node, ast.Attribute)
                    and isinstance(node.value, ast.Name)
                    and node.value.id == "time"
                    and node.attr in WALL
                )
            if reads:
                key = path.relative_to(root).as_posix()
                found[key] = found.get(key, 0) + 1
    assert {k: n for k, n in found.items() if not k.startswith("exports/")} == ALLOWED


def test_everything_at_once(drive, usual):
    """All faults within a minute; stopped cars are armed again when healthy."""
    frames = FaultParams(loss=0.01, corruption=0.005, duplication=0.01, reordering=0.01)
    each = drive(faults=FaultPlan(frames=frames))
    n = len(each.errors)
    kinds = ["reboot", "clock-step", "stuck-sensor", "silence", "unplug", "duplicate-id"]
    things = [(kind, f"nodes.{1 + k % 3}") for k, kind in enumerate(kinds)]
    things += [("unplug", "cars.1"), ("reboot", "cars.2"), ("silence", "cars.3"),
               ("unplug", "links.operator")]  # fmt: skip
    for kind, target in things:
        each.befall(kind, target, 1.5)
        each.drive(2.5)
        for node in each.rig.constellation.ids:
            each.swarm.intake.release(node, each.t_ns)
        each.drive(1.0)
        for _ in range(3):
            each.order("arm")
            each.drive(0.5)
    assert np.nanmax(each.errors[n:]) < 1.5
    assert each.mean_error(n) < 2.0 * usual + 0.1
    assert each.armed == [True, True, True]
