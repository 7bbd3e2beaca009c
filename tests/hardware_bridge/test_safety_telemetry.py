"""Reaction of the gate to telemetry of cars, and to its absence."""

from dataclasses import replace

import numpy as np
import pytest
from safety_group import TICK, check, picture
from test_safety_supervisor import NEUTRAL, Drive

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.virtual import VirtualBridge
from hardware_bridge.config.swarm import CarConfig
from hardware_bridge.errors import BridgeError
from hardware_bridge.links.ports import PortSpec
from hardware_bridge.live.marks import KeptMarks
from hardware_bridge.live.silent_cars import GROWTH, SILENT, SilentCars
from hardware_bridge.readings import UNNAMED, AckReading, MotionReading, Source, StatusReading
from hardware_bridge.safety.message_filter import MessageFilter
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import blank_picture
from hardware_bridge.safety.supervisor import Supervisor
from hardware_bridge.safety.telemetry import no_telemetry
from relpos_env.interface.views import make_view
from tracking.estimate import Status

SHAPE = (1, 2)


def told(**fields):
    calm = no_telemetry(SHAPE, SafetyParams())
    return calm._replace(**{name: np.array([[value, 0.0]]) for name, value in fields.items()})


@pytest.mark.parametrize(
    ("rule", "fields", "cap", "hold"),
    [
        ("fault", {"fault": True}, 0.0, True),
        ("runaway", {"over_for": 0.29}, np.inf, False),
        ("runaway", {"over_for": 0.3}, 0.0, True),
        ("deaf", {"deaf_for": 0.49}, np.inf, False),
        ("deaf", {"deaf_for": 0.5}, 0.0, True),
        ("deaf", {"idle_for": 3.0}, 0.0, True),
        ("battery", {"cell": 3.41}, np.inf, False),
        ("battery", {"cell": 3.39}, 0.3, False),
        ("battery", {"cell": 3.19}, 0.0, True),
    ],
)
def test_rules_look_at_what_cars_say(rule, fields, cap, hold):
    state = told(**fields)
    state = state._replace(fault=state.fault.astype(bool))
    if rule == "battery":
        state = state._replace(cell=np.array([[fields["cell"], np.inf]]))
    verdict = check(rule, picture(), telemetry=state)
    assert verdict.forward[0].tolist() == [cap, np.inf]
    assert verdict.hold[0].tolist() == [hold, False]
    assert not check(rule, picture()).hold.any()


def test_a_battery_that_recovers_a_little_is_still_low():
    state = no_telemetry(SHAPE, SafetyParams())._replace(cell=np.full(SHAPE, 3.45))
    assert np.isinf(check("battery", picture(), telemetry=state).forward).all()
    assert (check("battery", picture(), telemetry=state, was_slow=True).forward == 0.3).all()


def test_a_slow_watchdog_counts_as_a_longer_reaction():
    linked = np.array([[True, False]])
    caps = []
    for watchdog in (0.2, 1.0):
        state = no_telemetry(SHAPE, SafetyParams())._replace(watchdog=np.full(SHAPE, watchdog))
        q = picture(spacing=2.0)
        q.speed[:] = 1.0
        caps.append(check("separation", q, telemetry=state, linked=linked).forward[0, 0])
    assert caps[1] < caps[0] or np.isinf(caps).all()


class Telling(Drive):
    """Two cars that report their speed."""

    def __init__(self, answers=False, cells=0, slowest=0.0):
        super().__init__()
        for driver in self.drivers.values():
            driver.answers, driver.slowest = answers, slowest
        self.supervisor = Supervisor(
            SafetyParams(), 2, self.drivers, {0: "cars.1", 1: "cars.2"}, cells={0: cells, 1: cells}
        )

    def say(self, *readings, n=1):
        for _ in range(n):
            self.drivers[0].readings = list(readings)
            self.supervisor.receive(0, b"", self.now)
            sent = self.tick()
        return sent

    def answer(self, n, late=0):
        """Let car 0 acknowledge the last command, or one that is `late` commands older."""
        for _ in range(n):
            self.say(AckReading(UNNAMED, self.drivers[0].sequence - 1 - late))

    def moves(self):
        return [data != NEUTRAL for data in self.tick().values()]


def ready(**options):
    drive = Telling(**options)
    drive.tick(60)
    assert drive.arm() == []
    drive.tick(5)
    return drive


def test_a_car_that_runs_away_is_stopped_for_good():
    drive = ready()
    drive.say(MotionReading(UNNAMED, 1.0), n=60)
    assert drive.moves() == [True, True]
    drive.say(MotionReading(UNNAMED, 8.0), n=20)
    assert drive.moves() == [True, True]
    drive.say(MotionReading(UNNAMED, 8.0), n=20)
    assert drive.moves() == [False, True]
    assert "faster than it was asked" in drive.supervisor.stopped()[0].text
    drive.say(MotionReading(UNNAMED, 0.0), n=70)
    assert drive.arm() == []
    assert drive.moves() == [True, True]


def test_a_fault_and_an_empty_battery_stop_the_car_that_has_them():
    drive = ready(cells=2)
    drive.say(StatusReading(UNNAMED, 7.6, 0), n=10)
    assert drive.moves() == [True, True]
    drive.say(StatusReading(UNNAMED, 6.2, 0), n=10)  # a motor that starts
    assert drive.moves() == [True, True]
    drive.say(StatusReading(UNNAMED, 6.2, 0), n=900)
    assert drive.moves() == [False, True]
    drive = ready()
    drive.say(StatusReading(UNNAMED, 6.2, 3))
    assert drive.moves() == [False, True]


def test_a_car_that_answers_nothing_is_never_armed_and_one_that_stops_answering_stops():
    drive = Telling(answers=True)
    drive.tick(120)
    assert [n.text.split(";")[0] for n in drive.arm()] == [
        "cars.1 not armed: it does not execute commands",
        "cars.2 not armed: it does not execute commands",
    ]
    drive.answer(100)
    assert len(drive.arm()) == 1
    assert drive.moves() == [True, False]
    drive.say(AckReading(UNNAMED, drive.drivers[0].sequence - 1), n=60)  # a replayed one
    assert drive.moves() == [False, False]


def test_a_car_that_answers_late_was_told_late():
    """A serial server buffers commands during a network outage, and then delivers all."""
    drive = Telling(answers=True)
    drive.tick(60)
    drive.answer(120, late=40)
    assert len(drive.arm()) == 1
    drive = Telling(answers=True)
    drive.tick(60)
    drive.answer(120, late=52)
    assert len(drive.arm()) == 2


def test_a_car_whose_wheels_stand_although_it_is_asked_to_drive_is_stopped():
    drive = ready()
    drive.say(MotionReading(UNNAMED, 0.0), n=290)
    assert drive.moves() == [True, True]
    drive.say(MotionReading(UNNAMED, 0.0), n=60)
    assert drive.moves() == [False, True]


def test_a_car_that_cannot_go_as_slow_as_it_is_asked_may_stand():
    drive = Telling(slowest=1.5)
    drive.tick(60)
    drive.arm()
    drive.say(MotionReading(UNNAMED, 0.0), n=350)
    assert drive.moves() == [True, True]


def test_words_of_others_and_old_ones_are_not_listened_to():
    def status(number, fault, device="1", boot=5):
        return StatusReading(Source(device, boot, number), 7.6, fault)

    port = PortSpec(name="cars.1", port="/dev/null")
    car = CarConfig(node=1, port=port, driver="relpos", key=bytes(16))
    message_filter = MessageFilter(car, {1: (5, 2)})
    said = [
        status(2, 0),
        status(3, 1),
        status(3, 0),
        status(4, 0, device="7"),
        status(1, 0, boot=4),
    ]
    assert [reading.fault for reading in message_filter.sift(said, 0)] == [1]
    drive = ready()
    drive.supervisor = Supervisor(
        SafetyParams(),
        2,
        drive.drivers,
        {0: "cars.1", 1: "cars.2"},
        message_filters={0: message_filter},
    )
    drive.tick(60)
    drive.arm()
    drive.tick(5)
    assert drive.moves() == [True, True]
    drive.say(status(9, 3, device="7"))
    assert drive.moves() == [True, True]
    drive.say(status(10, 3))
    assert drive.moves() == [False, True]


def test_a_car_that_tells_its_speed_no_more_is_stopped():
    """Its commands may be buffered in a serial server, and be delivered all at once."""
    drive = ready()
    drive.say(MotionReading(UNNAMED, 1.0), n=20)
    drive.tick(40)
    assert drive.moves() == [True, True]
    drive.tick(20)
    assert drive.moves() == [False, True]


def test_a_silent_car_stays_where_it_was_until_it_is_dismissed():
    silent, view = SilentCars(3), make_view(1, 3)
    view.present[:] = True
    view.ok[:] = ~np.eye(3, dtype=bool)
    view.pos[0, :, 2] = [[2.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    view.speed[0] = [0.5, 0.0, 0.0]  # car 0 drives along x
    silent.move(view, 0.0)
    silent.note(view, np.full((3, 3), 0.1), np.ones(3, dtype=bool))
    view.ok[0, :, 2] = False  # its estimates are not worth storing then
    silent.note(view, np.full((3, 3), 9.0), np.array([True, True, False]))
    silent.keep(2)
    view.present[0, 2] = False
    for k in range(1, 11):
        silent.move(view, 0.1 * k)
    q = blank_picture(1, 3)
    silent.write(q, view)
    assert q.present[0].tolist() == [0.0, 0.0, SILENT]
    np.testing.assert_allclose(q.pos[0, :2, 2], [[1.5, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(q.pos[0, 2, :2], [[-1.5, 0.0], [0.0, -1.0]])
    np.testing.assert_allclose(q.sigma[0, :2, 2], 0.1 + GROWTH)
    assert (q.status[0, :2, 2] == Status.OK).all()
    silent.dismiss()
    q = blank_picture(1, 3)
    silent.write(q, view)
    assert not q.present.any()


def test_the_gate_knows_where_a_car_is_that_has_fallen_silent():
    """The trackers lose a car long before it counts as gone."""
    bridge = VirtualBridge(EmulateOptions(scenario="ring-los", task="hold", cars=3, seconds=60.0))
    env, swarm = bridge.env(max_cycles=400), bridge.swarm
    env.reset()
    agents = list(env.agents)
    stand = {agent: np.zeros(2, np.float32) for agent in agents}
    for _ in range(20):
        env.step(stand)
    assert swarm.view.ok[0, :2, 2].all()
    before = swarm.view.pos[0, :2, 2].copy()
    heard = swarm.intake.received_ns

    class Silenced(dict):
        """Reception times without those of node 2."""

        def __setitem__(self, node, t_ns):
            if node != 2:
                super().__setitem__(node, t_ns)

    swarm.intake.received_ns = Silenced(heard)
    take = swarm.intake.events.add_range
    swarm.intake.events.add_range = lambda t, pair, *rest: 2 in pair or take(t, pair, *rest)
    for _ in range(60):
        env.step({agent: action for agent, action in stand.items() if agent in env.agents})
    assert swarm.silent.here.tolist() == [False, False, True]
    picture = blank_picture(1, 3)
    swarm.silent.write(picture, swarm.view)
    assert (picture.sigma[0, :2, 2] < 0.6).all()
    assert (np.linalg.norm(picture.pos[0, :2, 2] - before, axis=-1) < 0.4).all()
    bridge.feed.order("gone")
    assert not swarm.silent.here.any()
    bridge.close()


class Intake:
    """Intake without marks."""

    def restore(self, marks):
        pass

    def marks(self, ahead=0):
        return {}


def test_starts_of_ours_rise_even_where_the_calendar_goes_back(tmp_path):
    path = tmp_path / "swarm.marks.json"
    boots = [KeptMarks(path, Intake(), wall_s).boot for wall_s in (1000, 2000, 500, 500, 3000)]
    assert boots == [1000, 2000, 2001, 2002, 3000]


def test_cars_of_which_nobody_knows_when_they_stop_are_refused():
    from hardware_bridge.live.start import check_watchdogs

    config = VirtualBridge(EmulateOptions(scenario="ring-los", cars=2)).config
    check_watchdogs(config)
    unknown = replace(config, cars=(replace(config.cars[0], watchdog=None), config.cars[1]))
    with pytest.raises(BridgeError, match=r"cars.1.watchdog: missing, .* doctor --watchdog"):
        check_watchdogs(unknown)
    assert TICK == 0.01
