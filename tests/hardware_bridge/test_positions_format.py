"""Lines of external trackers: their meaning, and refused lines."""

import json
import math

import pytest
from decoder_samples import POSITIONS, decoder_of
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.decoders.positions import MOST_LINE, MOST_PLACE, MOST_SPEED
from hardware_bridge.emulator.encoders import make_encoder
from hardware_bridge.readings import MICROSECONDS_64, UNNAMED, PairReading, PoseReading, Source
from tracking.estimate import Status


def read(**said):
    return decoder_of("positions").feed((json.dumps(said) + "\n").encode())


def is_damaged(**said):
    decoder = decoder_of("positions")
    assert decoder.feed((json.dumps(said) + "\n").encode()) == []
    return decoder.counts.damaged == 1


def at(ticks):
    return Source(ticks=ticks, clock=MICROSECONDS_64)


def test_golden_lines():
    decoder = decoder_of("positions")
    pair, plane, pose, yaw = decoder.feed(b"".join(POSITIONS))
    v = 0.02**2
    assert pair == PairReading(
        at(81250000), "1", "2", (1.25, -0.5, 0.125), (0.1, 0.0, -0.2), (v, 0, 0, 0, v, 0, 0, 0, v)
    )
    # The variance of z is not given: it is the larger one of x and y.
    cov = (4e-4, 1e-4, 0, 1e-4, 9e-4, 0, 0, 0, 9e-4)
    assert plane == PairReading(
        at(81250000), "2", "3", (1.0, 2.0, 0.0), None, cov, Status.LOST, 0.25
    )
    assert pose == PoseReading(
        at(81250001), "1", (3.5, 0.25, 0.1), q_wb=(0.6, 0.0, 0.0, 0.8), speed=0.75
    )
    assert (yaw.node, yaw.pos) == ("CAR B", None)
    assert yaw.q_wb == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    assert (decoder.counts.frames, decoder.counts.skipped, decoder.counts.damaged) == (4, 2, 0)


def test_time_is_optional():
    assert read(i=1, j=2, pos=[1, 2, 3])[0].source == UNNAMED
    assert read(node=1, yaw=0, time=2**40)[0].source.ticks == 2**40


def test_a_status_is_a_name_or_a_number():
    for status in Status:
        for written in (status.name, status.name.lower(), int(status)):
            assert read(i=1, j=2, pos=[1, 2], status=written)[0].status is status


def test_what_was_not_measured_is_left_out():
    nan = math.nan
    assert read(node=1, pos=[1, nan, 2]) == read(node=1, pos=None) == read(node=1) == []
    assert read(i=1, j=2, pos=[nan, nan], cov=0.1) == []
    (reading,) = read(node=1, pos=[1, nan, 2], yaw=0.0, speed=None, vel=[1, 2, 3], cov=None)
    assert (reading.pos, reading.vel, reading.speed) == (None, None, None)
    assert read(i=1, j=2, pos=[1, 2], vel=[nan, 1], cov=nan)[0].vel is None


def test_a_covariance_without_a_velocity_keeps_its_position():
    cov = [[4.0 if r == c else 0.5 for c in range(6)] for r in range(6)]
    (reading,) = read(i=1, j=2, pos=[1, 2, 3], cov=cov)
    assert reading.cov == (4.0, 0.5, 0.5, 0.5, 4.0, 0.5, 0.5, 0.5, 4.0)
    (reading,) = read(i=1, j=2, pos=[1, 2, 3], vel=[0, 0, 0], cov=cov)
    assert reading.cov == tuple(each for row in cov for each in row)


@pytest.mark.parametrize(
    "said",
    [
        {"pos": [1]},
        {"pos": [1, 2, 3, 4]},
        {"pos": "1 2 3"},
        {"pos": [1, "2", 3]},
        {"pos": [True, 2, 3]},
        {"pos": [1, 2, math.inf]},
        {"pos": [1, 2, 1.1 * MOST_PLACE]},
        {"pos": [10**400, 2, 3]},
        {"pos": [1, 2, 3], "vel": [1.1 * MOST_SPEED, 0, 0]},
        {"pos": [1, 2, 3], "cov": 0},
        {"pos": [1, 2, 3], "cov": -0.1},
        {"pos": [1, 2, 3], "cov": 1e4},
        {"pos": [1, 2, 3], "cov": [[1, 0], [0, 1]]},
        {"pos": [1, 2, 3], "cov": [[1, 0, 0], [0, 1, 0], [0, 0]]},
        {"pos": [1, 2, 3], "cov": [[1, 0, 0], [0, 1, 0], [0, 0, 0]]},
        {"pos": [1, 2], "cov": [[1, 2], [2, 1]]},
        {"pos": [1, 2], "cov": [[1, 0.1], [0.2, 1]]},
        {"pos": [1, 2], "status": "fine"},
        {"pos": [1, 2], "status": 6},
        {"pos": [1, 2], "status": True},
        {"pos": [1, 2], "nlos": 1.5},
        {"pos": [1, 2], "nlos": -0.5},
        {"pos": [1, 2], "time": -1},
        {"pos": [1, 2], "time": 2**64},
        {"pos": [1, 2], "time": "now"},
        {"pos": [1, 2], "i": 2},
        {"pos": [1, 2], "i": -1},
        {"pos": [1, 2], "i": ""},
        {"pos": [1, 2], "i": 1.0},
    ],
)
def test_what_cannot_be_of_a_pair_is_damaged(said):
    assert is_damaged(**{"i": 1, "j": 2, **said})


@pytest.mark.parametrize(
    "said",
    [
        {"q": [1, 0, 0]},
        {"q": [1, 1, 0, 0]},
        {"q": [0, 0, 0, 0]},
        {"q": [math.inf, 0, 0, 0]},
        {"q": {}},
        {"yaw": 1e7},
        {"yaw": "east"},
        {"yaw": 0, "speed": 101},
        {"yaw": 0, "node": None},
        {"yaw": 0, "node": "x" * 33},
    ],
)
def test_what_cannot_be_of_a_node_is_damaged(said):
    assert is_damaged(**{"node": 1, **said})


def test_a_line_whose_end_was_lost_costs_no_other():
    line = b'{"i": 1, "j": 2, "pos": [1, 2]}\n'
    assert decoder_of("positions").feed(line[:17] + line) == decoder_of("positions").feed(line)
    assert decoder_of("positions").feed(b"> " + line) == decoder_of("positions").feed(line)


VECTOR = st.tuples(*[st.floats(-99.0, 99.0)] * 3)
SOURCES = st.just(UNNAMED) | st.integers(0, 2**64 - 1).map(at)


@st.composite
def covs(draw):
    n = draw(st.sampled_from([3, 6]))
    std = draw(st.lists(st.floats(0.01, 30.0), min_size=n, max_size=n))
    mixed = draw(st.floats(-0.15, 0.15))
    return tuple(
        std[r] * std[c] * (1.0 if r == c else mixed) for r in range(n) for c in range(n)
    )  # fmt: skip


@given(
    source=SOURCES,
    pos=VECTOR,
    vel=st.none() | VECTOR,
    cov=st.none() | covs(),
    status=st.sampled_from(Status),
    nlos=st.floats(0.0, 1.0),
)
def test_what_is_written_is_read(source, pos, vel, cov, status, nlos):
    if vel is None and cov is not None and len(cov) == 36:
        return
    sent = [
        PairReading(source, "1", "CAR B", pos, vel, cov, status, nlos),
        PoseReading(source, "7", pos, vel, cov, (0.6, 0.0, 0.0, 0.8), 1.5),
    ]
    said = make_encoder("positions", "1").encode(sent)
    assert max(map(len, said.splitlines())) < MOST_LINE
    assert decoder_of("positions").feed(said) == sent
