"""Messages are accepted once, restarts at once, two devices with one id not for long."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from hardware_bridge.identity import Identities, IdentityParams, Verdict
from hardware_bridge.identity.window import MODULUS, WIDTH, Place, SequenceWindow
from hardware_bridge.readings import Source

MS = 1_000_000
S = 1_000_000_000
ANY = st.integers(0, 1 << 30)


def numbered(boot, sequence):
    return Source(device="3", boot=boot, sequence=sequence)


def texts(identities):
    return [text for _, text in identities.notices]


class OneDevice(RuleBasedStateMachine):
    """A device that restarts, over links that lose, repeat and reorder messages."""

    authenticated = False

    def __init__(self):
        super().__init__()
        self.identities = Identities(self.authenticated)
        self.t, self.boot, self.next, self.highest = 0, 1, MODULUS - 5, None
        if self.authenticated:
            self.next = 0
        self.in_flight, self.sent, self.accepted = [], [], set()

    def check(self, boot, sequence, link="a"):
        self.t += 10 * MS
        verdict = self.identities.check(link, numbered(boot, sequence), self.t, 3)
        if verdict.accepted:
            assert (boot, sequence) not in self.accepted
            self.accepted.add((boot, sequence))
        return verdict

    def arrive(self, sequence):
        """Deliver a message of the current boot."""
        new = (self.boot, sequence) not in self.accepted
        back = 0 if self.highest is None else (self.highest - sequence) % MODULUS
        verdict = self.check(self.boot, sequence)
        if new and (back < WIDTH or back > MODULUS // 2):
            assert verdict.accepted
            assert (verdict is Verdict.LATE) == (0 < back < WIDTH)
        if self.highest is None or back > MODULUS // 2:
            self.highest = sequence

    @rule(n=st.integers(1, 40))
    def send(self, n):
        for _ in range(n):
            self.in_flight.append(self.next % MODULUS)
            self.sent.append((self.boot, self.next % MODULUS))
            self.next += 1

    @precondition(lambda self: self.in_flight)
    @rule(which=ANY, lost=st.booleans())
    def one_arrives_or_is_lost(self, which, lost):
        sequence = self.in_flight.pop(which % len(self.in_flight))
        if not lost:
            self.arrive(sequence)

    @rule(order=st.randoms(use_true_random=False))
    def all_arrive(self, order):
        order.shuffle(self.in_flight)
        for sequence in self.in_flight:
            self.arrive(sequence)
        self.in_flight.clear()

    @precondition(lambda self: self.accepted)
    @rule(which=ANY)
    def one_comes_again(self, which):
        boot, sequence = sorted(self.accepted)[which % len(self.accepted)]
        assert not self.check(boot, sequence, link="b").accepted

    @precondition(lambda self: self.highest is not None)
    @rule(stragglers=st.integers(0, 3), seconds=st.integers(2, 100))
    def restart(self, stragglers, seconds):
        """Deliver up to three messages of the old boot after the first of the new one."""
        self.t += seconds * S
        over, self.boot = self.boot, self.boot + 1
        self.next = 1
        self.sent.append((self.boot, 0))
        assert self.check(self.boot, 0) is Verdict.REBOOT
        self.highest = 0
        for sequence in self.in_flight[:stragglers]:
            assert not self.check(over, sequence).accepted
        self.in_flight.clear()

    @invariant()
    def nobody_is_quarantined(self):
        assert self.identities.quarantined == ()


class OneAuthenticatedDevice(OneDevice):
    """The same with MAC, an attacker with a recording of all messages, and restarts of the host."""

    authenticated = True

    @precondition(lambda self: self.sent)
    @rule(which=ANY, n=st.integers(1, 60))
    def replay(self, which, n):
        start = which % len(self.sent)
        for boot, sequence in self.sent[start : start + n]:
            if (boot, sequence) in self.accepted or boot < self.boot:
                assert not self.check(boot, sequence, link="b").accepted

    @rule()
    def host_restarts(self):
        marks = self.identities.high_water()
        self.identities = Identities(True)
        self.identities.restore(marks)
        # Messages in flight are lost.
        self.in_flight.clear()


TestOneDevice = OneDevice.TestCase
TestOneDevice.settings = settings(max_examples=60, stateful_step_count=30)
TestOneAuthenticatedDevice = OneAuthenticatedDevice.TestCase
TestOneAuthenticatedDevice.settings = TestOneDevice.settings


@settings(max_examples=200)
@given(st.lists(st.booleans(), max_size=60), st.integers(1, 1000))
def test_twins_are_found_within_four_messages(turns, period_ms):
    """Two devices alternate in any order: four messages of the first after one of the other."""
    identities = Identities()
    sequences, after_the_other, heard = {7: 900, 8: 20}, 0, []
    for k, first in enumerate([True, *turns, False, *[True] * 5]):
        boot = 7 if first else 8
        heard.append(boot)
        after_the_other += first and 8 in heard
        link, t = ("left" if first else "right"), k * period_ms * MS
        verdict = identities.check(link, numbered(boot, sequences[boot]), t, 3)
        sequences[boot] += 1
        if verdict is Verdict.DUPLICATE_ID:
            break
    assert after_the_other <= 4
    assert identities.quarantined == (3,)
    assert texts(identities)[-1] == (
        "node 3 is two devices, on links left and right: refused until it is released"
    )
    for boot in (7, 8, 9):
        assert identities.check("left", numbered(boot, 5000), t, 3) is Verdict.DUPLICATE_ID
    identities.release(3, t)
    assert identities.check("left", numbered(7, 5001), t, 3) is Verdict.FRESH
    assert texts(identities)[-1] == "node 3 is released"


def test_a_restart_is_seen_with_its_first_message():
    identities = Identities()
    for k in range(100):
        assert identities.check("left", numbered(11, k), k * 10 * MS, 3) is Verdict.FRESH
    assert identities.check("left", numbered(12, 0), 2 * S, 3) is Verdict.REBOOT
    assert identities.check("left", numbered(12, 1), 2 * S, 3) is Verdict.FRESH
    assert identities.notices == [(2 * S, "node 3 started again, on link left")]


def test_a_device_that_comes_back_after_its_twin_is_found_by_one_message():
    identities = Identities()
    for k, boot in enumerate([1, 2]):
        identities.check("a", numbered(boot, k), k * S, 3)
    assert identities.check("a", numbered(1, 5), 3600 * S, 3) is Verdict.DUPLICATE_ID
    assert "both on link a" in texts(identities)[-1]


def test_messages_of_the_old_start_are_stale():
    identities = Identities()
    for source in (numbered(1, 5), numbered(1, 8), numbered(2, 0)):
        identities.check("a", source, 0, 3)
    check = identities.check
    assert check("a", numbered(1, 7), 0, 3) is Verdict.STALE
    assert check("a", numbered(1, 7), 0, 3) is Verdict.DUPLICATE
    assert check("a", numbered(1, 9), 0, 3) is Verdict.STALE
    assert identities.quarantined == ()


def test_nodes_are_independent():
    identities = Identities()
    for node in (1, 2):
        for k in range(10):
            assert identities.check("a", numbered(node, k), 0, node) is Verdict.FRESH


def test_spoofed_boots_fill_no_memory_and_are_quarantined():
    identities = Identities()
    rng = random.Random(0)
    verdicts = [
        identities.check("a", numbered(rng.getrandbits(32), 0), k * MS, 3) for k in range(1000)
    ]
    assert verdicts.index(Verdict.DUPLICATE_ID) == 9
    assert set(verdicts[9:]) == {Verdict.DUPLICATE_ID}
    assert len(identities.notices) < 5
    slowly = Identities()
    for k in range(1000):
        slowly.check("a", numbered(rng.getrandbits(32), 0), k * 2 * S, 3)
    assert len(slowly._nodes[3].boots._boots) <= 64
    assert len(slowly.notices) <= 256


def test_authenticated_boots_rise():
    identities = Identities(authenticated=True)
    check = identities.check
    assert check("a", numbered(5, 100), 0, 3) is Verdict.FRESH
    assert check("a", numbered(4, 200), 0, 3) is Verdict.REPLAY
    assert check("a", numbered(5, 99), 0, 3) is Verdict.LATE
    assert check("a", numbered(5, 99), 0, 3) is Verdict.DUPLICATE
    assert check("a", numbered(9, 0), 0, 3) is Verdict.REBOOT
    assert check("a", numbered(5, 101), 0, 3) is Verdict.REPLAY
    assert check("a", Source(device="3"), 0, 3) is Verdict.REPLAY
    assert identities.quarantined == ()
    assert texts(identities)[0].startswith("node 3 is sent old messages on link a")


def test_authenticated_numbers_do_not_go_round():
    """Otherwise a message recorded 2^31 messages ago would count as new."""
    identities = Identities(authenticated=True)
    identities.check("a", numbered(1, MODULUS - 1), 0, 3)
    assert identities.check("a", numbered(1, 0), 0, 3) is Verdict.REPLAY


def test_marks_survive_a_restart_of_the_host():
    before = Identities(authenticated=True)
    for k in range(50):
        before.check("a", numbered(7, k), 0, 3)
    marks = before.high_water()
    assert marks == {3: (7, 49)}
    after = Identities(authenticated=True)
    after.restore(marks)
    after.restore({3: (6, 1000)})
    for boot in range(8):
        assert not any(after.check("a", numbered(boot, k), 0, 3).accepted for k in range(50))
    assert after.check("a", numbered(7, 50), 0, 3) is Verdict.FRESH
    assert before.high_water(ahead=1000) == {3: (7, 1049)}
    assert Identities().high_water() == {}


def test_formats_without_numbers_are_accepted():
    identities = Identities()
    for k in range(10):
        # The IMU and the radio of a node, on two ports whose configuration names the node.
        for link in ("imu", "uwb"):
            assert identities.check(link, Source(), k * 10 * MS, 3) is Verdict.UNNUMBERED
    assert identities.quarantined == ()


def test_one_id_on_two_links_is_two_devices():
    identities = Identities()
    source = Source(device="3")
    verdicts = [identities.check("ab"[k % 2], source, k * 10 * MS, 3) for k in range(10)]
    assert verdicts.index(Verdict.DUPLICATE_ID) == 3
    assert texts(identities)[0].startswith("node 3 is two devices, on links a and b")


def test_a_device_that_is_plugged_elsewhere_is_one_device():
    identities = Identities()
    for k in range(1000):
        link = "ab"[k // 100 % 2]
        t = (k + 300 * (k // 100)) * 10 * MS
        assert identities.check(link, Source(device="3"), t, 3).accepted


def test_numbers_without_boots_begin_anew_after_a_silence():
    identities = Identities()
    source = lambda k: Source(device="3", sequence=k)  # noqa: E731
    for k in range(500):
        assert identities.check("a", source(k), k * 10 * MS, 3) is Verdict.FRESH
    verdicts = [identities.check("a", source(k), 8 * S + k * 10 * MS, 3) for k in range(20)]
    assert verdicts[7] is Verdict.REBOOT
    assert set(verdicts[8:]) == {Verdict.FRESH}


def test_the_operator_is_told_of_a_node_that_sends_only_old_messages():
    identities = Identities()
    identities.check("a", numbered(1, 1 << 30), 0, 3)
    for k in range(1000):
        assert not identities.check("a", numbered(1, k), k * 10 * MS, 3).accepted
    assert len(identities.notices) == 1
    assert "sends only old messages" in texts(identities)[0]


sources = st.builds(
    Source,
    device=st.none() | st.sampled_from("abcdefgh"),
    boot=st.none() | st.integers(0, 3) | st.integers(0, 1 << 64),
    sequence=st.none() | st.integers(0, 5) | st.integers(-(1 << 40), 1 << 40),
)


@settings(max_examples=100)
@given(st.booleans(), st.lists(st.tuples(sources, st.sampled_from("abc"), st.integers(-S, 5 * S))))
def test_anything_is_survived(authenticated, messages):
    identities = Identities(authenticated)
    t, seen = 0, set()
    for source, link, gap in messages:
        t += gap
        verdict = identities.check(link, source, t, 3)
        key = source.boot, None if source.sequence is None else source.sequence % MODULUS
        if authenticated and verdict.accepted:
            assert key not in seen
            seen.add(key)


@settings(max_examples=200)
@given(st.integers(0, MODULUS - 1), st.lists(st.integers(-1200, 1200), max_size=60))
def test_the_window_knows_what_it_saw(first, steps):
    window = SequenceWindow(first, endless=True)
    highest, seen, at = first, {first}, first
    for step in steps:
        at += step
        expected = (
            Place.AHEAD
            if at > highest
            else Place.OLD
            if at <= highest - WIDTH
            else Place.SEEN
            if at in seen
            else Place.NEW
        )
        assert window.place(at % MODULUS) is expected
        window.take(at)
        seen.add(at)
        highest = max(highest, at)
        assert window.highest == highest % MODULUS


@pytest.mark.parametrize("wrong", [{"stragglers": 0}, {"again": -1.0}])
def test_parameters_are_checked(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        IdentityParams(**wrong)
