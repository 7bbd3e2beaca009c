"""Distances from stamps: right for any clocks, motion and order, or absent."""

from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tracking.ranging.compiled.exchange import take_carrier
from tracking.ranging.events import Reception
from tracking.ranging.exchange import ExchangeParams, Exchanges, Passage
from tracking.ranging.frames.airtime import PAPER_PHY, message_time
from tracking.ranging.frames.timestamps import (
    GRID,
    METRES_PER_TICK,
    MODULUS,
    SPEED_OF_LIGHT,
    TICK_HZ,
    difference,
    on_grid,
    ticks,
)
from tracking.ranging.frames.wire import Frame, Type, decode, encode
from tracking.ranging.listening import Listener

quick = settings(max_examples=40, derandomize=True)
SKEW = st.floats(-20e-6, 20e-6)
BASE = st.integers(GRID, MODULUS - 1) | st.integers(MODULUS - 2**31, MODULUS - 1)


class Node:
    """A clock and a receiver on a line; noiseless stamps, rounded to ticks."""

    def __init__(self, id, place, speed=0.0, skew=0.0, base=GRID, boot=1, listens=()):
        self.id, self.place, self.speed, self.boot = id, place, speed, boot
        self.rate, self.base = TICK_HZ * (1.0 + skew), base
        self.listener = Listener(id, ExchangeParams())
        self.events = []

    def at(self, t):
        return self.place + self.speed * t

    def local(self, t):
        return self.base + round(self.rate * t)

    def true(self, stamp):
        return (stamp - self.base) / self.rate


class Line:
    """Nodes that transmit in turn; all receive everything, silent nodes included."""

    def __init__(self, nodes, carriers=False):
        self.nodes, self.carriers, self.t, self.frame = nodes, carriers, 0.01, None
        self.step = message_time(PAPER_PHY, len(nodes))
        self.edit = lambda frame: frame
        self.wrong, self.count = [], 0

    def speak(self, node):
        stamp = on_grid(node.local(self.t))
        t = node.true(stamp)
        others = tuple(sorted({k.id for k in self.nodes if k.id != node.id}))
        rows = tuple(node.listener.peers.table(others, 14))
        n = len(others) + 1
        frame = Frame(Type.REPLY, node.id, 0, 0, 0, n, node.boot, stamp % MODULUS, rows)
        self.frame = decode(encode(self.edit(frame)))
        node.listener.note_sent(stamp)
        for other in self.nodes:
            if other.id != node.id:
                self.hear(other, node, t)
        self.t += self.step

    def hear(self, other, node, t):
        flight = abs(other.at(t) - node.at(t)) / SPEED_OF_LIGHT
        arrived = other.local(t + flight)
        moving = (other.speed - node.speed) * (1 if other.at(t) > node.at(t) else -1)
        carrier = (other.rate - node.rate) / node.rate + moving / SPEED_OF_LIGHT
        reading = Reception(arrived % MODULUS, -80.0, -83.0, carrier if self.carriers else None)
        found = other.listener.take(self.frame, reading, arrived)
        for event in found or []:
            when = other.true(arrived - (arrived - event.time) % MODULUS)
            other.events.append((event.i, event.j))
            self.count += 1
            error = min(
                abs(event.distance - abs(a.at(when) - b.at(when)))
                for a in self.nodes
                for b in self.nodes
                if (a.id, b.id) == (event.i, event.j)
            )
            self.wrong.append(error)

    def rounds(self, n, order=None):
        for _ in range(n):
            for k in order or range(len(self.nodes)):
                self.speak(self.nodes[k])


@st.composite
def lines(draw, n, speed=10.0, extra=0):
    """Draw n nodes 15 m apart, and `extra` nodes that only listen."""
    places = draw(st.permutations(range(n + extra)))
    nodes = [
        Node(
            k, 15.0 * places[k], draw(st.floats(-speed, speed)), draw(SKEW), draw(BASE),
            draw(st.integers(0, 255)),
        )
        for k in range(n + extra)
    ]  # fmt: skip
    line = Line(nodes)
    line.step = message_time(PAPER_PHY, n)
    return line, draw(st.permutations(range(n)))


@pytest.mark.parametrize("n", [3, 6])
def test_noiseless_stamps_give_the_distance(n):
    @quick
    @given(lines(n, extra=1))
    def check(drawn):
        line, order = drawn
        line.rounds(5, order)
        assert max(line.wrong) < 5e-3
        pairs = {(i, j) for i in range(n) for j in range(i + 1, n)}
        for node in line.nodes:  # the last of them has never transmitted
            counts = {pair: node.events.count(pair) for pair in pairs}
            assert min(counts.values()) >= 2, (node.id, counts)
            assert set(node.events) == pairs

    check()


@quick
@given(lines(4, extra=1), st.lists(st.permutations(range(4)), min_size=6, max_size=6))
def test_order_changes_from_round_to_round(drawn, orders):
    line, _ = drawn
    for order in orders:
        line.rounds(1, order)
    assert max(line.wrong, default=0.0) < 0.05


@quick
@given(lines(3), st.permutations(range(3)), st.data())
def test_lost_messages_make_no_wrong_ranges(drawn, order, data):
    line, _ = drawn
    hear = line.hear
    line.hear = lambda *message: data.draw(st.booleans()) and hear(*message)
    line.rounds(8, order)
    assert max(line.wrong, default=0.0) < 0.05


JUMP = (
    st.integers(-(2**39), 2**39)
    | st.integers(-(2**26), 2**26)
    | st.integers(-(2**19), 2**19)
    | st.integers(-2000, 2000)
)


@settings(quick, max_examples=120)
@given(lines(3), st.booleans(), st.integers(0, 2), st.integers(0, 5), JUMP)
def test_a_clock_that_jumps_gives_no_wrong_range(drawn, carriers, who, slots, jump):
    line, order = drawn
    line.carriers = carriers
    line.rounds(6, order)
    for k in range(24):
        if k == slots:
            line.nodes[who].base += max(jump, -line.nodes[who].local(line.t) + GRID)
        line.speak(line.nodes[order[k % 3]])
    assert max(line.wrong) < 2.0
    line.count, line.wrong = 0, []
    line.rounds(3, order)
    assert line.count >= 15
    assert max(line.wrong) < 5e-3


@quick
@given(lines(3), st.integers(0, 2), st.integers(0, 5), BASE, st.integers(1, 255))
def test_a_node_that_is_switched_on_again_gives_no_wrong_range(drawn, who, slots, base, boot):
    line, order = drawn
    line.rounds(4, order)
    for k in range(24):
        if k == slots:
            old = line.nodes[who]
            skew = old.rate / TICK_HZ - 1.0
            boot = (old.boot + boot) % 256
            line.nodes[who] = Node(who, old.place, old.speed, skew, base, boot)
        line.speak(line.nodes[order[k % 3]])
    assert max(line.wrong) < 2.0
    line.count, line.wrong = 0, []
    line.rounds(3, order)
    assert line.count >= 15
    assert max(line.wrong) < 5e-3


@pytest.mark.parametrize("same_boot", [False, True])
def test_two_nodes_of_one_id_give_ranges_of_one_of_them_or_none(same_boot):
    @quick
    @given(lines(3), st.integers(0, 2), SKEW, BASE, st.booleans(), st.permutations(range(4)))
    def check(drawn, who, skew, base, carriers, order):
        line, _ = drawn
        assume(abs(difference(base, line.nodes[who].base)) > ticks(1e-3))
        boot = line.nodes[who].boot if same_boot else (line.nodes[who].boot + 1) % 256
        line.nodes.append(Node(who, 60.0, 0.0, skew, base, boot))
        line.carriers = carriers
        line.rounds(10, order)
        assert max(line.wrong, default=0.0) < 2.0
        assert line.count >= 10  # of the two others

    check()


@settings(quick, max_examples=120)
@given(lines(4, speed=5.0), st.booleans(), st.data())
def test_mixed_up_stamps_give_no_wrong_range(drawn, carriers, data):
    """Tables of earlier messages, stamps in the wrong rows, time stamps of earlier frames."""
    line, order = drawn
    line.carriers = carriers
    past = {k: [] for k in range(4)}

    def edit(frame):
        how = data.draw(st.sampled_from(["no", "no", "rows", "stamp", "old", "later"]))
        old = past[frame.src]
        old.append(frame)
        if how == "rows":
            ids = data.draw(st.permutations([e.id for e in frame.entries]))
            rows = [replace(e, id=k) for e, k in zip(frame.entries, ids, strict=True)]
            return replace(frame, entries=tuple(rows))
        if how == "stamp":
            return replace(frame, stamp=data.draw(st.sampled_from(old)).stamp)
        if how == "old":
            return replace(frame, entries=data.draw(st.sampled_from(old)).entries)
        if how == "later":
            late = data.draw(st.integers(1, 2**30)) * GRID + ticks(20e-6)
            return replace(frame, stamp=(frame.stamp + late) % MODULUS)
        return frame

    line.rounds(3, order)
    line.edit = edit
    line.rounds(6, order)
    assert max(line.wrong) < 2.0
    line.edit = lambda frame: frame
    line.rounds(4, order)
    line.count, line.wrong = 0, []
    line.rounds(3, order)
    assert line.count >= 40
    assert max(line.wrong) < 5e-3


def exchange(exchanges, start, reply, distance, skew):
    """Exchange a question of node 0 and an answer of node 1, whose clock is slower by `skew`."""
    flight = distance / METRES_PER_TICK
    sent, heard = start, round((start + flight) * (1.0 - skew))
    answered = heard + round(reply * (1.0 - skew))
    back = start + round(2.0 * flight) + reply
    exchanges.add(0, 1, Passage(sent, heard, sent))
    return exchanges.add(1, 0, Passage(answered, back, back))


@quick
@given(SKEW, st.integers(1, 20), st.floats(1.0, 150.0))
def test_the_carrier_stands_in_for_a_fresh_interval(skew, readings, distance):
    exchanges = Exchanges(ExchangeParams())
    for k in range(readings):
        exchanges.carrier(0, 1, GRID + k * ticks(5e-3), skew)
    found = exchange(exchanges, GRID + readings * ticks(5e-3), ticks(2e-3), distance, skew)
    assert found is not None
    assert found[0] == pytest.approx(distance, abs=0.02)


def test_without_carrier_and_interval_there_is_no_range():
    exchanges = Exchanges(ExchangeParams())
    assert exchange(exchanges, GRID, ticks(2e-3), 10.0, 0.0) is None
    assert exchange(exchanges, GRID + ticks(20e-3), ticks(2e-3), 10.0, 0.0) is not None


@quick
@given(SKEW, st.floats(0.1e-3, 1.6), st.integers(0, 40), st.floats(-1.0, 1.0))
def test_the_carrier_is_trusted_as_far_as_it_goes(skew, reply, readings, noise):
    """With all readings wrong by one standard deviation the range is within 3 `max_error`."""
    params = ExchangeParams()
    exchanges = Exchanges(params)
    wrong = skew + noise * params.clocks.carrier_std / max(readings, 1) ** 0.5
    for k in range(readings):
        exchanges.carrier(0, 1, GRID + k * ticks(5e-3), wrong)
    start = GRID + readings * ticks(5e-3)
    found = exchange(exchanges, start, ticks(reply), 20.0, skew)
    if found is not None:
        assert found[0] == pytest.approx(20.0, abs=3.0 * params.max_error)
    if readings == 0 or reply > params.max_reply:
        assert found is None


def test_a_carrier_that_is_no_number_is_not_taken():
    numbers = ExchangeParams().numbers()
    for offset in (float("nan"), float("inf"), 1.0):
        assert take_carrier(numbers, 1e-6, 1e-12, offset) == (1e-6, 1e-12)


def test_the_longest_round_has_ranges():
    params = ExchangeParams()
    longest = 62 * message_time(PAPER_PHY, 62)
    assert params.max_reply > longest
    assert params.clocks.max_interval > longest
