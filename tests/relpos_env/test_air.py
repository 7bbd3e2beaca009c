"""Groups in the reference air: losses, hidden nodes, restarts, duplicate IDs, clock jumps."""

import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from relpos_env.sensors.radio.air import Air
from relpos_env.sensors.radio.channel import EXACT
from relpos_env.sensors.radio.params import RadioSimParams
from tracking.ranging.events import DuplicateId, Role
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.timestamps import MODULUS, TICK_HZ
from tracking.ranging.params import SessionParams

DT = 0.01
CORNERS = np.array([[0.0, 0, 0], [4, 0, 0], [0, 3, 0], [6, 5, 0], [-3, 4, 0], [2, -6, 0]])


class Group:
    """Nodes at rest, unless `pos` is changed."""

    def __init__(self, pos, seed=1, ids=None, session=None, delays=None, **channel):
        self.pos = np.array(pos, dtype=np.float64)
        n = len(self.pos)
        self.ids = list(range(n)) if ids is None else ids
        params = RadioSimParams(
            channel=replace(EXACT, **channel), session=session or SessionParams()
        )
        self.air = Air(params, n, seed, DT)
        for k in range(n):
            if delays is None or delays[k] is not None:
                self.on(k, at=0.002 * k if delays is None else delays[k])

    def on(self, node, boot=None, at=0.0):
        boot = 7 * node + 1 if boot is None else boot
        self.air.switch_on(node, boot=boot, at=at, id=self.ids[node])

    def run(self, seconds):
        """Run for some seconds; return the ranges as (time, reporting node, event)."""
        self.air.events.clear()
        self.air.sent.clear()
        for _ in range(round(seconds / DT)):
            self.air.step(self.pos, self.pos)
        return [t for t in self.air.events if isinstance(t.event, RangeEvent)]

    def error(self, told):
        """Return the error of a range to the nearest distance of all nodes with these IDs [m]."""
        ends = [
            [k for k, name in enumerate(self.ids) if name == end]
            for end in (told.event.i, told.event.j)
        ]
        true = [np.linalg.norm(self.pos[a] - self.pos[b]) for a, b in itertools.product(*ends)]
        return min(abs(told.event.distance - d) for d in true)

    def right(self, ranges, limit=0.3):
        assert max(map(self.error, ranges), default=0.0) < limit

    def pairs(self, ranges):
        """Return the number of ranges of each pair, the larger count of its two ends."""
        ends = [t for t in ranges if self.ids[t.node] in (t.event.i, t.event.j)]
        counts = Counter((t.node, t.event.i, t.event.j) for t in ends)
        best = Counter()
        for (_, i, j), count in counts.items():
            best[i, j] = max(best[i, j], count)
        return best

    def roots(self):
        return {s.root for s in self.air.sessions if s is not None}

    def together(self):
        """Return whether all follow one initiator and know each other."""
        sessions = [s for s in self.air.sessions if s is not None]
        everyone = tuple(sorted(s.id for s in sessions))
        leads = [s for s in sessions if s.role is Role.INITIATOR]
        return len(leads) == 1 and all(s.members == everyone for s in sessions)


def all_pairs(ids):
    return set(itertools.combinations(sorted(ids), 2))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("n", [3, 6])
def test_third_of_all_messages_lost(n, seed):
    group = Group(CORNERS[:n], seed, loss=0.3)
    group.right(group.run(1.0))
    for _ in range(5):
        ranges = group.run(1.0)
        group.right(ranges)
        assert set(group.pairs(ranges)) == all_pairs(range(n))


@pytest.mark.parametrize("what", ["twice", "late"])
def test_repeated_and_late_frames(what):
    group = Group(CORNERS[:4], 4)
    group.run(0.5)
    rng = np.random.default_rng(5)

    def spoil(session):
        frame, kept = session.frame, []

        def deliver(data, reception, now):
            out = frame(data, reception, now)
            if what == "twice" and rng.random() < 0.2:
                out += frame(data, reception, now)
            elif what == "late":
                if kept and rng.random() < 0.5:
                    out += frame(*kept.pop(), now)
                if rng.random() < 0.2:
                    kept.append((data, reception))
            return out

        session.frame = deliver

    for session in group.air.sessions:
        spoil(session)
    for _ in range(4):
        ranges = group.run(1.0)
        group.right(ranges)
        assert set(group.pairs(ranges)) == all_pairs(range(4))


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_two_groups_that_meet(seed):
    pos = CORNERS.copy()
    pos[[1, 3, 5]] += 1000.0
    group = Group(pos, seed)
    group.run(2.0)
    assert group.roots() == {0, 1}
    group.pos = CORNERS
    for _ in range(20):
        group.run(1.0)
        if group.together():
            break
    assert group.together()
    ranges = group.run(1.0)
    group.right(ranges)
    assert min(group.pairs(ranges)[pair] for pair in all_pairs(range(6))) > 20


def line(order):
    """Return places of nodes 0, 1, 2 on a line in the order `order`."""
    pos = np.empty((3, 3))
    pos[list(order)] = [[0.0, 0, 0], [8, 0, 0], [16, 0, 0]]
    return pos


def rates_of_neighbours(group, order, seconds=4.0):
    ranges = group.run(seconds)
    group.right(ranges)
    counts = group.pairs(ranges)
    return [counts[tuple(sorted(pair))] / seconds for pair in itertools.pairwise(order)]


ORDERS = list(itertools.permutations(range(3)))


@pytest.mark.parametrize("order", ORDERS)
def test_the_ends_of_a_line_find_the_middle(order):
    group = Group(line(order), 3, max_distance=10.0)
    for _ in range(10):
        if min(rates_of_neighbours(group, order, 1.0)) > 0.0:
            break
    assert min(rates_of_neighbours(group, order)) >= 5.0


@pytest.mark.parametrize("order", ORDERS)
def test_a_group_that_becomes_a_line(order):
    group = Group(0.5 * line(order), 3, max_distance=10.0)
    group.run(1.0)
    assert group.together()
    group.pos = line(order)
    group.run(1.0)
    for _ in range(3):
        assert min(rates_of_neighbours(group, order)) >= 5.0


@pytest.mark.parametrize("who", [0, 1, 3])
@pytest.mark.parametrize("pause", [0.01, 0.3, 2.0])
def test_a_node_that_is_switched_on_again(who, pause):
    group = Group(CORNERS[:4], 6)
    group.right(group.run(1.0))
    group.air.switch_off(who)
    group.right(group.run(pause))
    group.air._nodes[who]["base"] = 2**38 + 12345  # its clock restarts, too
    group.on(who, boot=200)
    group.right(group.run(1.0))
    assert group.together()
    ranges = group.run(0.5)
    group.right(ranges)
    assert set(group.pairs(ranges)) == all_pairs(range(4))


@pytest.mark.parametrize("double", [0, 1, 3])
@pytest.mark.parametrize("both_at_once", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_two_nodes_with_one_id(double, both_at_once, seed):
    ids = [0, 1, 2, 3, double]
    group = Group(CORNERS[:5], seed, ids=ids, delays=[0.0, 0.0, 0.001, 0.002, None])
    if both_at_once:
        group.on(4, boot=150)
    else:
        group.run(1.0)
        group.on(4, boot=150)
    noticed, rest = set(), set(range(4)) - {double}
    for second in range(25):
        ranges = group.run(1.0)
        noticed |= {t.node for t in group.air.events if isinstance(t.event, DuplicateId)}
        clean = [t for t in ranges if double not in (t.event.i, t.event.j)]
        group.right(clean)
        if second:  # the others go on all the time
            assert all_pairs(rest) <= set(group.pairs(clean)), second  # the others go on
        if noticed == {double, 4} and second > 3:
            break
    assert noticed == {double, 4}


@pytest.mark.parametrize("who", [0, 1, 3])
@pytest.mark.parametrize("jump", [5.0, 0.7, 1e-3, 1e-5, -1e-5, -1e-3, -1.5e-3, -0.7, -4.0])
def test_a_clock_that_jumps(who, jump):
    group = Group(CORNERS[:4], 8)
    group.right(group.run(1.0))
    group.air._nodes[who]["base"] += int(jump * TICK_HZ)
    ranges = group.run(2.0)
    group.right(ranges)
    ranges = group.run(0.5)
    group.right(ranges)
    assert set(group.pairs(ranges)) == all_pairs(range(4))
    assert group.together()


@pytest.mark.parametrize("laps", [(1,), (0, 1, 2, 3)])
def test_clocks_that_wrap(laps):
    group = Group(CORNERS[:4], 9)
    for k in laps:
        group.air._nodes[k]["base"] = MODULUS - int((1.0 + 0.1 * k) * TICK_HZ)
    group.right(group.run(0.5))
    assert group.together()
    for _ in range(10):
        ranges = group.run(0.1)
        group.right(ranges)
        assert set(group.pairs(ranges)) == all_pairs(range(4))
        assert group.together()


@pytest.mark.parametrize("n", [3, 6])
@pytest.mark.parametrize(("succession", "limit"), [(True, 0.1), (False, 1.0)])
def test_the_initiator_is_switched_off(n, succession, limit):
    group = Group(CORNERS[:n], 10, session=SessionParams(succession=succession))
    group.run(1.0)
    assert group.together()
    rest = all_pairs(range(1, n))
    for lost in range(1, n - 1):
        group.air.switch_off(lost - 1)
        start = group.air.t
        ranges = group.run(2.0)
        group.right(ranges)
        assert group.together()
        rest = all_pairs(range(lost, n))
        times = [t.t - start for t in ranges if (t.event.i, t.event.j) in rest]
        silence = max(np.diff([0.0, *times]))
        assert silence < limit
        assert set(group.pairs(ranges)) >= rest
