"""The supervisor without processes: commands to the cars under any failure."""

import numpy as np
import pytest
from safety_group import TICK, picture

from hardware_bridge.safety.gate import NOT_ARMED, reason_text
from hardware_bridge.safety.messages import Decision, Notice, Order, Word
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.supervisor import Supervisor

NEUTRAL = b"stand"


class Driver:
    """Driver that returns the command as text; may fail."""

    gap = 0.0
    answers = False
    slowest = 0.0

    def __init__(self):
        self.sequence = 0
        self.fails, self.fails_neutral = False, False
        self.telemetry = self
        self.readings = []

    def feed(self, data):
        return self.readings

    def drive(self, speed, steering):
        if self.fails:
            raise RuntimeError("out of ideas")
        self.sequence += 1
        return b"%.3f %.3f" % (speed, steering)

    def neutral(self):
        if self.fails_neutral:
            raise OSError("out of everything")
        self.sequence += 1
        return NEUTRAL


class Drive:
    """A supervisor of two cars with a clock, healthy by default."""

    def __init__(self):
        self.drivers = {0: Driver(), 1: Driver()}
        self.supervisor = Supervisor(SafetyParams(), 2, self.drivers, {0: "cars.1", 1: "cars.2"})
        self.q, self.now, self.linked, self.takes = picture(), 0.0, [0, 1], [0, 1]

    def tick(self, n=1, *, talk=True):
        for _ in range(n):
            self.now += TICK
            if talk:
                self.q.t[:] = self.q.ranged[:] = self.now
                self.supervisor.take(Word(self.now, np.full(2, self.now)))
                self.supervisor.take(Decision(self.q._replace(t=self.q.t.copy())))
            sent = self.supervisor.tick(self.now, 0.0, self.linked)
            self.supervisor.written(self.now, self.takes)
        return sent

    def arm(self):
        return self.supervisor.take(Order("arm"))


@pytest.fixture
def drive():
    made = Drive()
    made.tick(60)
    assert made.arm() == []
    made.tick(20)
    assert made.supervisor.stopped() == []
    return made


def stands(sent):
    return [data == NEUTRAL for _, data in sorted(sent.items())]


def test_before_arming_all_are_told_to_stand_and_why_is_told():
    made = Drive()
    assert stands(made.tick(10)) == [True, True]
    notices = made.arm()
    assert [n.text[:15] for n in notices] == ["cars.1 not arme", "cars.2 not arme"]
    assert stands(made.tick(10)) == [True, True]


def test_an_order_before_the_first_tick_is_refused():
    made = Drive()
    assert len(made.arm()) == 2


def test_armed_cars_drive(drive):
    assert stands(drive.tick()) == [False, False]
    report = drive.supervisor.report()
    assert report.armed.tolist() == [1.0, 1.0]
    assert (report.speed > 0.0).all()


@pytest.mark.parametrize("bad", [0, 1])
def test_a_driver_that_fails_keeps_no_other_from_being_told(drive, bad):
    drive.drivers[bad].fails = True
    sent = drive.tick()
    assert sent[bad] == NEUTRAL
    assert sent[1 - bad] != NEUTRAL
    sent = drive.tick()
    assert sent[bad] == NEUTRAL
    assert sent[1 - bad] != NEUTRAL
    (notice,) = drive.supervisor.stopped()
    assert notice.text == f"cars.{bad + 1} stopped: its driver failed: out of ideas"


@pytest.mark.parametrize("bad", [0, 1])
def test_emergency_reaches_all_though_one_cannot_even_stand(drive, bad):
    drive.drivers[bad].fails = drive.drivers[bad].fails_neutral = True
    assert drive.supervisor.take(Order("stop")) == [Notice("emergency stop")]
    sent = drive.tick()
    assert sent[bad] == b""
    assert sent[1 - bad] == NEUTRAL


def test_a_driver_that_works_again_moves_only_after_arming(drive):
    drive.drivers[0].fails = True
    drive.tick(3)
    drive.drivers[0].fails = False
    assert drive.tick(100)[0] == NEUTRAL
    assert len(drive.arm()) == 1
    assert drive.tick(40)[0] == NEUTRAL
    drive.tick(20)
    assert drive.arm() == []
    assert stands(drive.tick(5)) == [False, False]


def test_a_port_that_comes_back_moves_nothing(drive):
    drive.linked = [1]
    assert stands(drive.tick()) == [True, False]
    assert "port is lost" in drive.supervisor.stopped()[0].text
    drive.linked = [0, 1]
    assert stands(drive.tick(200)) == [True, False]
    assert drive.arm() == []
    assert stands(drive.tick(5)) == [False, False]


def test_silence_stops_all(drive):
    assert stands(drive.tick(5, talk=False)) == [False, False]
    assert stands(drive.tick(2, talk=False)) == [True, True]
    assert stands(drive.tick(200)) == [True, True]


def test_pictures_that_were_overtaken_or_are_of_no_time_are_not_looked_at(drive):
    old = drive.q._replace(t=drive.q.t - 0.05, requested_speed=np.zeros((1, 2)))
    drive.supervisor.take(Decision(old))
    drive.supervisor.take(Decision(old._replace(t=np.full(1, np.nan))))
    assert stands(drive.tick(1, talk=False)) == [False, False]
    assert (drive.supervisor.report().speed > 0.0).all()


@pytest.mark.parametrize(("order", "again"), [("stop", False), ("disarm", True)])
def test_orders(drive, order, again):
    drive.supervisor.take(Order(order))
    assert stands(drive.tick(100)) == [True, True]
    assert not drive.supervisor.quit
    assert (drive.arm() == []) == again
    if not again:
        drive.supervisor.take(Order("clear"))
        assert stands(drive.tick(100)) == [True, True]
        assert drive.arm() == []
    assert stands(drive.tick(5)) == [False, False]


def test_after_quit_nothing_is_armed_again(drive):
    drive.supervisor.take(Order("quit"))
    assert drive.supervisor.quit
    assert stands(drive.tick(100)) == [True, True]
    drive.arm()
    assert stands(drive.tick(100)) == [True, True]


def test_unknown_orders_move_nothing_and_are_told(drive):
    (notice,) = drive.supervisor.take(Order("dance"))
    assert "dance" in notice.text


def test_left_alone_nothing_moves_again(drive):
    drive.supervisor.abandon("the supervisor was ended")
    assert stands(drive.tick(100)) == [True, True]
    drive.arm()
    assert stands(drive.tick(5)) == [True, True]
    assert drive.supervisor.quit


def test_that_it_was_ended_is_told_of_every_car(drive):
    drive.arm()
    drive.tick(5)
    drive.supervisor.abandon("the supervisor was ended")
    drive.tick(1)
    told = [notice.text for notice in drive.supervisor.stopped()]
    assert len(told) == 2
    assert all(text.endswith("stopped: the supervisor was ended") for text in told)


def test_a_controller_that_is_slow_to_take_commands_is_not_swamped():
    driver = Driver()
    driver.gap = 0.03
    supervisor = Supervisor(SafetyParams(), 1, {0: driver}, {0: "cars.1"})
    sent = []
    for k in range(1, 31):
        sent.append(bool(supervisor.tick(0.01 * k, 0.0, [0])[0]))
        supervisor.written(0.01 * k, [0])
    assert sent.count(True) == 10
    assert sent[0]


def test_a_port_that_is_open_and_takes_nothing_is_a_lost_one(drive):
    """During a network outage the car stops by itself, and must not continue afterwards."""
    drive.takes = [1]
    assert stands(drive.tick(19)) == [False, False]
    assert stands(drive.tick(3)) == [True, False]
    assert "port is lost" in drive.supervisor.stopped()[0].text
    drive.takes = [0, 1]
    assert stands(drive.tick(200)) == [True, False]
    assert drive.arm() == []
    assert stands(drive.tick(5)) == [False, False]


def test_what_a_port_did_not_take_is_said_again_at_once():
    driver = Driver()
    driver.gap = 0.05
    supervisor = Supervisor(SafetyParams(), 1, {0: driver}, {0: "cars.1"})
    for k, (takes, told) in enumerate([([], True), ([], True), ([0], True), ([0], False)]):
        assert bool(supervisor.tick(0.01 * k, 0.0, [0])[0]) == told
        supervisor.written(0.01 * k, takes)


@pytest.mark.parametrize("suspended", [False, True])
def test_after_a_pause_in_which_cars_stopped_nobody_drives_on(drive, suspended):
    """The process stalled, or was suspended: then its monotonic clock has not advanced."""
    if suspended:
        drive.supervisor.interrupt()
    else:
        drive.now += 0.3
    assert stands(drive.tick()) == [True, True]
    assert all("held up" in n.text for n in drive.supervisor.stopped())
    assert stands(drive.tick(30)) == [True, True]
    assert len(drive.arm()) == 2
    drive.tick(30)
    assert drive.arm() == []
    assert stands(drive.tick(5)) == [False, False]


def test_a_dry_run_tells_what_the_gate_would_say():
    supervisor = Supervisor(SafetyParams(), 2, {}, {})
    q = picture(spacing=0.6)
    for k in range(100):
        t = 0.01 * k
        q.t[:] = q.ranged[:] = t
        supervisor.take(Word(t, np.full(2, t)))
        supervisor.take(Decision(q._replace(t=q.t.copy())))
        assert supervisor.tick(t, 0.0, [0, 1]) == {}
    report = supervisor.report()
    assert report.linked.all()
    assert report.reason.tolist() == [NOT_ARMED, NOT_ARMED]
    assert (report.cap < 1.0).all()
    q.sigma[:] = 2.0
    supervisor.tick(1.0, 0.0, [0, 1])
    assert reason_text(int(supervisor.report().reason[0])).startswith("where another car is")
