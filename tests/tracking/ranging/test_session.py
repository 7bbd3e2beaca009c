"""One session under arbitrary input from the air, its clock and its caller."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracking.errors import ConfigError
from tracking.ranging.events import (
    DuplicateId,
    MembersChanged,
    Reception,
    Role,
    RoleChanged,
    Transmission,
)
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.airtime import FAST_PHY, PAPER_PHY, airtime
from tracking.ranging.frames.timestamps import GRID, MODULUS, difference, ticks
from tracking.ranging.frames.wire import MAX_ID, MAX_PARTS, Entry, Frame, Type, decode, encode
from tracking.ranging.params import SessionParams
from tracking.ranging.session import Session

BYTE = st.integers(0, 255)
STAMP = st.integers(0, MODULUS - 1)
WAIT = st.sampled_from([0.0, 1e-6, 60e-6, 1e-3, 4e-3, 12e-3, 0.05, 0.3, 0.7, 2.0])
quick = settings(max_examples=150, derandomize=True)


class Alone:
    """A session, its clock and its caller; every output is checked."""

    def __init__(self, id=3, start=0, params=None, boot=99):
        self.params = params or SessionParams()
        self.now, self.id, self.prompt = start, id, True
        self.session = Session(id, self.params, boot=boot)
        self.sent, self.told = [], []
        self.take(self.session.start(self.now % MODULUS))

    def take(self, outputs):
        for out in outputs:
            if isinstance(out, Transmission):
                assert 0 <= out.at < MODULUS
                assert out.at % GRID == 0
                start = out.at - ticks(self.params.phy.header_time)
                assert not self.prompt or difference(start, self.now % MODULUS) >= 0
                frame = decode(out.data)
                assert len(out.data) <= self.params.phy.max_frame
                assert (frame.src, frame.pan) == (self.id, self.params.pan)
                self.sent.append(out)
            else:
                assert isinstance(out, RangeEvent | RoleChanged | MembersChanged | DuplicateId)
                self.told.append(out)
        assert 0 <= self.session.deadline < MODULUS
        assert self.left < ticks(5.0)

    @property
    def left(self):
        return difference(self.session.deadline, self.now % MODULUS)

    def wait(self, seconds):
        """Advance time with a caller that keeps deadlines."""
        end, calls = self.now + ticks(seconds), 0
        while self.now + max(self.left, 0) <= end:
            self.timeout()
            calls += 1
            assert calls < 20_000
        self.now = end

    def timeout(self):
        self.now += max(self.left, 0)
        self.take(self.session.timeout(self.now % MODULUS))

    def hear(self, data, delay=0.0, stamp=None, carrier=None, powers=(-80.0, -83.0)):
        """Deliver a whole frame with a delay."""
        self.take(self.session.preamble(self.now % MODULUS))
        moment = self.now + ticks(self.params.phy.header_time)
        on_air = airtime(self.params.phy, min(len(data), self.params.phy.max_frame))
        self.now += ticks(on_air + delay)
        reception = Reception((moment if stamp is None else stamp) % MODULUS, *powers, carrier)
        self.take(self.session.frame(data, reception, self.now % MODULUS))

    def settle(self, seconds=5.0):
        """Run without input: the session leads within this time, and ranges continue."""
        end = self.now + ticks(seconds)
        while self.session.role is not Role.INITIATOR:
            self.timeout()
            assert self.now <= end, (self.session.role, self.session.members)
        sent, end = len(self.sent), self.now + ticks(seconds)
        while len(self.sent) == sent:
            self.timeout()
            assert self.now <= end, self.session.members


@st.composite
def foreign(draw, most=14):
    """Draw a valid frame of any node with any fields."""
    src = draw(st.integers(0, 8) | st.integers(0, MAX_ID))
    ids = draw(st.lists(st.integers(0, 8) | st.integers(0, MAX_ID), unique=True, max_size=most))
    rows = [
        Entry(k, draw(STAMP), -78.0, -81.0) if draw(st.booleans()) else Entry(k, None)
        for k in ids
        if k != src
    ]
    n = draw(st.sampled_from([1, len(rows) or 1, len(rows) + 1, 255]) | st.integers(1, 255))
    parts = draw(st.sampled_from([1, 1, 2, MAX_PARTS]))
    return Frame(
        draw(st.sampled_from(Type)), src, draw(st.just(src) | st.integers(0, src)), draw(BYTE),
        draw(st.just(n) | st.integers(0, n)), n, draw(st.sampled_from([1, 99]) | BYTE),
        draw(STAMP), tuple(rows), draw(st.sampled_from([0, 0, 0, 7])), draw(BYTE),
        draw(st.integers(0, parts - 1)), parts,
    )  # fmt: skip


ACTIONS = st.one_of(
    st.tuples(st.just("wait"), WAIT),
    st.tuples(st.just("skip"), WAIT),
    st.tuples(st.just("preamble"), st.none()),
    st.tuples(st.just("broken"), st.none()),
    st.tuples(st.just("frame"), foreign()),
    st.tuples(st.just("plausible"), foreign()),
    st.tuples(st.just("junk"), st.binary(max_size=130)),
    st.tuples(st.just("echo"), st.booleans()),
    st.tuples(st.just("again"), st.integers(0, 5)),
    st.tuples(st.just("any stamp"), st.tuples(foreign(), STAMP)),
    st.tuples(st.just("late"), st.tuples(foreign(), WAIT)),
    st.tuples(st.just("step"), st.integers(-(2**39), 2**39) | st.integers(-(2**28), 2**28)),
    st.tuples(st.just("timeout"), st.just(0)),
)


def act(alone, action, past, clock):
    kind, what = action
    if kind == "wait":
        alone.wait(what)
    elif kind == "skip":  # a caller that misses its deadlines
        alone.now += ticks(what)
    elif kind == "preamble":
        alone.take(alone.session.preamble(alone.now % MODULUS))
    elif kind == "broken":
        alone.take(alone.session.broken(alone.now % MODULUS))
    elif kind in ("frame", "plausible"):
        if kind == "plausible":  # a continuous clock, recent rows
            stamp = alone.now + clock.setdefault(what.src, what.stamp) & MODULUS - 1
            ago = [stamp - (e.stamp or 0) % ticks(0.05) for e in what.entries]
            rows = [
                replace(e, stamp=e.stamp if e.stamp is None else a % MODULUS)
                for e, a in zip(what.entries, ago, strict=True)
            ]
            what = replace(what, stamp=stamp, entries=tuple(rows), pan=0)
        past.append(encode(what))
        alone.hear(past[-1], carrier=1e-6)
    elif kind == "junk":
        alone.hear(what)
    elif kind == "echo" and alone.sent:
        frame = decode(alone.sent[-1].data)
        alone.hear(encode(frame if what else replace(frame, boot=(frame.boot + 1) % 256)))
    elif kind == "again" and past:
        alone.hear(past[-1 - what % len(past)])
    elif kind in ("any stamp", "late"):
        alone.prompt = False
        late = {"stamp": what[1]} if kind == "any stamp" else {"delay": what[1]}
        alone.hear(encode(what[0]), **late)
        alone.prompt = True
    elif kind in ("step", "timeout"):
        alone.now += what
        alone.take(alone.session.timeout(alone.now % MODULUS))


@pytest.mark.parametrize("phy", [PAPER_PHY, FAST_PHY], ids=lambda phy: phy.name)
@pytest.mark.parametrize("succession", [True, False])
def test_survives_anything_and_leads_in_the_end(phy, succession):
    @quick
    @given(
        st.lists(ACTIONS, max_size=30),
        STAMP | st.integers(MODULUS - 2**28, MODULUS - 1),
        st.sampled_from([0, 3, MAX_ID]),
    )
    def check(actions, start, id):
        alone = Alone(id, start, SessionParams(phy=phy, succession=succession))
        past, clock = [], {}
        for action in actions:
            act(alone, action, past, clock)
        alone.settle()

    check()


def request(*others, src=0, stamp=5_000_000_000, boot=1, n=None, slot=0, type=Type.REQUEST):
    rows = tuple(Entry(k, None) for k in others)
    count = len(rows) + 1 if n is None else n
    return encode(Frame(type, src, 0, 1, slot, count, boot, stamp % MODULUS, rows))


def of_kind(alone, kind):
    return [event for event in alone.told if isinstance(event, kind)]


def test_alone_it_leads_and_asks_again_and_again():
    alone = Alone(start=MODULUS - ticks(1.0))
    alone.settle(0.1)
    alone.wait(40.0)  # over two wraps
    assert len(alone.sent) > 40.0 / 0.03
    assert alone.session.role is Role.INITIATOR
    assert alone.session.members == (3,)


@pytest.mark.parametrize("id", [-1, 255, 1000])
def test_ids_out_of_range(id):
    with pytest.raises(ConfigError, match="node id"):
        Session(id, SessionParams(), boot=1)


@pytest.mark.parametrize("name", ["listen", "idle", "mute", "takeover", "watchdog"])
def test_no_wait_is_longer_than_stamps_tell_apart(name):
    with pytest.raises(ConfigError, match=name):
        SessionParams(**{name: 10.0 if name in ("takeover", "watchdog") else (10.0, 10.0)})


def test_muted_by_its_own_id_it_comes_back():
    alone = Alone(id=3)
    alone.wait(0.5)
    alone.hear(request(src=3, boot=7))
    assert alone.session.role is Role.MUTED
    assert of_kind(alone, DuplicateId) == [DuplicateId(3, 7)]
    assert decode(alone.sent[-1].data).type is Type.ALERT
    sent = len(alone.sent)
    alone.wait(0.5)
    assert len(alone.sent) == sent
    alone.settle(1.2)


def test_an_echo_is_no_duplicate():
    alone = Alone(id=3)
    alone.wait(0.5)
    for _ in range(10):
        alone.hear(alone.sent[-1].data)
    assert not of_kind(alone, DuplicateId)


def test_frames_of_another_pan_are_ignored():
    alone = Alone(id=3, params=SessionParams(pan=5))
    alone.wait(0.5)
    alone.hear(request(3))
    assert alone.session.role is Role.INITIATOR
    assert alone.session.members == (3,)


def test_a_member_answers_in_its_slot():
    """It leaves its first slot out to listen for another node with its ID."""
    alone = Alone(id=3)
    alone.hear(request(3, stamp=alone.now))
    alone.wait(3e-4)
    assert not alone.sent
    alone.hear(request(3, stamp=alone.now))
    alone.wait(1e-4)
    assert alone.session.role is Role.RESPONDER
    assert decode(alone.sent[-1].data).type is Type.REPLY
    assert decode(alone.sent[-1].data).slot == 1


@pytest.mark.parametrize("delay", [20e-6, 1e-3, 4e-3, 9e-3])
def test_a_newcomer_that_is_told_late_orders_nothing_in_the_past(delay):
    alone = Alone(id=3)
    alone.hear(request(5), delay=delay)
    alone.settle()


@pytest.mark.parametrize("delay", [20e-6, 1e-3, 4e-3, 9e-3])
def test_a_member_that_is_told_late_orders_nothing_in_the_past(delay):
    alone = Alone(id=3)
    for _ in range(3):
        alone.hear(request(3, stamp=alone.now), delay=delay)
        alone.wait(0.02)
    assert alone.sent
    alone.settle()


def test_an_alert_after_a_late_frame_is_not_in_the_past():
    alone = Alone(id=3)
    alone.hear(request(src=3, boot=7), delay=4e-3)
    alone.settle()


@pytest.mark.parametrize("type", [Type.REQUEST, Type.REPLY, Type.JOIN, Type.ALERT])
def test_the_last_slot_of_all(type):
    """Slot 255 of 255 is a valid field; it must not overflow."""
    alone = Alone(id=3)
    for _ in range(4):
        alone.hear(request(1, stamp=alone.now))
        alone.hear(request(src=0, n=255, slot=255, type=type, stamp=alone.now))
    alone.settle()


@pytest.mark.parametrize("rows", [60, 230, 254])
def test_more_nodes_than_a_message_has_room_for(rows):
    """A node of ID 0 receives many others, one after the other."""
    alone = Alone(id=0)
    alone.wait(0.3)
    for first in range(1, rows, 12):
        stamp = (alone.now + ticks(1.0)) % MODULUS
        others = range(first + 1, min(first + 13, rows))
        table = tuple(Entry(k, (stamp - 1000) % MODULUS, -80.0, -83.0) for k in others)
        alone.hear(encode(Frame(Type.JOIN, first, 0, 0, 0, 1, 1, stamp, table)))
    alone.wait(1.0)
    alone.settle()


@pytest.mark.parametrize("power", [-1e9, 1e9])
def test_powers_out_of_reach(power):
    alone = Alone(id=3)
    alone.hear(request(5), powers=(power, -power))
    alone.wait(0.01)
    alone.settle()


@pytest.mark.parametrize("power", [float("nan"), float("inf"), float("-inf")])
def test_powers_that_are_no_numbers(power):
    alone = Alone(id=3)
    alone.hear(request(5), powers=(power, power))
    alone.wait(0.01)
    alone.settle()


@pytest.mark.parametrize("step", [-5.0, -2e-3, -1e-4, 1e-3, 5.0])
@pytest.mark.parametrize("role", [Role.LISTENING, Role.INITIATOR, Role.RESPONDER, Role.MUTED])
def test_a_clock_step_in_every_role(step, role):
    alone = Alone(id=3)
    alone.wait(0.01 if role is Role.LISTENING else 0.5)
    if role is Role.RESPONDER:
        alone.hear(request(3))
    if role is Role.MUTED:
        alone.hear(request(src=3, boot=7))
    assert alone.session.role is role
    alone.now += ticks(step)
    alone.take(alone.session.timeout(alone.now % MODULUS))
    alone.settle()


@pytest.mark.parametrize(
    "step",
    [
        0.0,
        pytest.param(
            -6.0,
        ),
    ],
)
def test_a_silent_member_is_dropped_also_after_a_step_back_through_zero(step):
    alone = Alone(id=0, start=ticks(0.1))
    alone.wait(0.5)
    alone.now += ticks(step)
    alone.take(alone.session.timeout(alone.now % MODULUS))
    alone.wait(0.5)
    alone.hear(request(0, src=1, n=1, slot=1, type=Type.JOIN))
    alone.wait(5e-3)
    assert alone.session.members == (0, 1)
    alone.wait(1.0)
    assert alone.session.members == (0,)
