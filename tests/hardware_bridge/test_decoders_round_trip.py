"""Decoders read the output of the encoders, within the resolution of the format."""

import math

import pytest
from decoder_samples import decoder_of
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.decoders import DECODERS
from hardware_bridge.decoders.rplidar import LOCK, WATCH
from hardware_bridge.emulator.encoders import ENCODERS, make_encoder
from hardware_bridge.emulator.encoders.ticks import ticks_on
from hardware_bridge.errors import BridgeError
from hardware_bridge.readings import (
    MICROSECONDS_32,
    MICROSECONDS_64,
    MILLISECONDS_32,
    RADIO_40,
    UNNAMED,
    HeartbeatReading,
    ImuReading,
    RangeReading,
    ScanReading,
    Source,
    StatusReading,
)

TICKS = st.integers(0, 2**32 - 1)
METRES = st.floats(0.01, 290.0)
HEX4 = st.integers(1, 0xFFFE).map("{:04X}".format)


def vectors(most, width=64):
    return st.tuples(*[st.floats(-most, most, width=width)] * 3)


def decoded(name, device, readings):
    return decoder_of(name).feed(make_encoder(name, device).encode(readings))


def same_ranges(got, sent, metres, decibels):
    assert [r._replace(distance=0.0, rx_power=None, fp_power=None) for r in got] == [
        r._replace(distance=0.0, rx_power=None, fp_power=None) for r in sent
    ]
    for g, s in zip(got, sent, strict=True):
        assert g.distance == pytest.approx(s.distance, abs=metres)
        for ours, theirs in ((g.rx_power, s.rx_power), (g.fp_power, s.fp_power)):
            assert (ours is None) == (theirs is None)
            assert ours is None or ours == pytest.approx(theirs, abs=decibels)


def test_every_decoder_of_devices_has_its_other_end():
    # The encoder of our own format is in hardware_bridge.wire: it needs a boot number and a key.
    assert set(ENCODERS) == set(DECODERS) - {"relpos"}


@given(
    ticks=TICKS,
    others=st.lists(st.integers(0, 255).map(str), max_size=6, unique=True),
    metres=st.lists(METRES, min_size=6, max_size=6),
    power=st.floats(-120.0, -1.0) | st.none(),
    imu=st.tuples(vectors(30.0, 32), vectors(150.0, 32)) | st.none(),
    volts=st.floats(0.001, 60.0),
)
def test_linktrack(ticks, others, metres, power, imu, volts):
    source = Source(device="3", ticks=ticks, clock=MILLISECONDS_32)
    ranges = [
        RangeReading(source, to, m, rx_power=power, fp_power=power)
        for to, m in zip(others, metres, strict=False)
    ]
    sent = [*ranges, StatusReading(source, voltage=volts)]
    if imu is not None and any(imu[0] + imu[1]):
        sent.insert(0, ImuReading(source, gyr=imu[0], acc=imu[1]))
    got = decoded("linktrack", "3", sent)
    assert [type(r) for r in got] == [type(r) for r in sent]
    same_ranges([r for r in got if isinstance(r, RangeReading)], ranges, 0.00051, 0.26)
    assert got[-1].voltage == pytest.approx(volts, abs=0.00051)
    if isinstance(sent[0], ImuReading):
        assert got[0].source == source
        for ours, theirs in ((got[0].gyr, sent[0].gyr), (got[0].acc, sent[0].acc)):
            assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-30)


def test_linktrack_sends_a_frame_for_each_sample_of_the_imu():
    samples = [
        ImuReading(Source("3", ticks=k, clock=MILLISECONDS_32), gyr=(0, 0, k), acc=(0, 0, 9.75))
        for k in range(1, 4)
    ]
    got = decoded("linktrack", "3", samples)
    assert [r for r in got if isinstance(r, ImuReading)] == samples
    same = [r._replace(source=samples[0].source) for r in samples]
    assert [r for r in decoded("linktrack", "3", same) if isinstance(r, ImuReading)] == same


@given(ticks=TICKS, to=HEX4, metres=METRES, power=st.floats(-139.0, 0.0) | st.none())
def test_uwb_core(ticks, to, metres, power):
    source = Source(ticks=ticks, clock=MICROSECONDS_32)
    sent = [RangeReading(source, to, metres, rx_power=power, nearer="FACE")]
    if to == "FACE":
        return
    same_ranges(decoded("uwb-core", "FACE", sent), sent, 1e-6, 1e-6)


@given(
    to=st.integers(0, 0xFFFF).map("{:X}".format),
    metres=METRES,
    power=st.floats(-139.0, 0.0) | st.none(),
)
def test_dw1000(to, metres, power):
    sent = [RangeReading(UNNAMED, to, metres, rx_power=power)]
    same_ranges(decoded("dw1000", "A1B2", sent), sent, 0.0051, 0.0051)


@given(others=st.lists(HEX4, max_size=9, unique=True), metres=st.lists(METRES, min_size=9))
def test_dwm1001(others, metres):
    sent = [RangeReading(UNNAMED, to, m) for to, m in zip(others, metres, strict=False)]
    same_ranges(decoded("dwm1001", "tag", sent), sent, 0.0051, 0.0)


@given(
    samples=st.lists(st.tuples(vectors(34.9), vectors(156.0), vectors(3000.0)), max_size=5),
    has_mag=st.booleans(),
)
def test_witmotion(samples, has_mag):
    sent = [ImuReading(UNNAMED, gyr=g, acc=a, mag=m if has_mag else None) for g, a, m in samples]
    got = decoded("witmotion", "imu", [*sent, ImuReading(UNNAMED, (0, 0, 0), (0, 0, 9.8))])
    for ours, theirs in zip(got, sent, strict=False):
        assert ours.gyr == pytest.approx(theirs.gyr, abs=0.00054)
        assert ours.acc == pytest.approx(theirs.acc, abs=0.0025)
        assert (ours.mag is None) == (theirs.mag is None)
        assert ours.mag is None or ours.mag == pytest.approx(theirs.mag, abs=0.051)
    assert len(got) >= len(sent)


@given(
    metres=st.lists(st.floats(0.01, 16.0) | st.none(), min_size=8, max_size=400),
    first=st.floats(-math.pi, math.pi),
    step=st.floats(0.003, 0.3),
)
def test_rplidar(metres, first, step):
    sent = [ScanReading(UNNAMED, first - k * step, m) for k, m in enumerate(metres)]
    got = decoded("rplidar", "scanner", sent)
    sent = [reading for reading in sent if reading.distance is not None]
    for ours, theirs in zip(got, sent, strict=True):
        turn = math.remainder(ours.bearing - theirs.bearing, 2.0 * math.pi)
        assert turn == pytest.approx(0.0, abs=0.00014)
        assert ours.distance == pytest.approx(theirs.distance, abs=0.00013)


def test_rplidar_is_not_read_before_enough_samples_follow_each_other():
    encoder, decoder = make_encoder("rplidar", ""), decoder_of("rplidar")
    sent = [ScanReading(UNNAMED, -0.02 * k, 1.0) for k in range(20)]
    counts = [len(decoder.feed(encoder.encode([reading]))) for reading in sent]
    assert counts == [0] * (LOCK - 1) + [LOCK] + [1] * (20 - LOCK)
    back = encoder.encode([ScanReading(UNNAMED, -0.02 * 19 + 0.2, 1.0)])  # 11 deg, no parallax
    other = decoder_of("rplidar")
    other.feed(make_encoder("rplidar", "").encode(sent))
    assert other.feed(back) == []
    jump = encoder.encode([ScanReading(UNNAMED, -0.02 * 20 - 1.5, 1.0)])
    assert decoder.feed(jump) == []
    still = decoder_of("rplidar")
    assert still.feed(encoder.encode([ScanReading(UNNAMED, 1.0, 1.0)]) * 30) == []
    # A scanner that stops or turns back after a rotation is soon not accepted.
    for step in (0.0, 0.02):
        turned, scanner = decoder_of("rplidar"), make_encoder("rplidar", "")
        turned.feed(scanner.encode(sent))
        later = [ScanReading(UNNAMED, -0.38 + step * k, 1.0) for k in range(1000)]
        assert len(turned.feed(scanner.encode(later))) < 2 * WATCH


def test_witmotion_stops_at_its_limits():
    sent = ImuReading(UNNAMED, gyr=(100.0, -100.0, 0.0), acc=(500.0, -500.0, 0.0), mag=(0, 0, 0))
    (got,) = decoded("witmotion", "imu", [sent])
    assert got.acc[:2] == pytest.approx((156.9, -156.9), abs=0.01)
    assert got.gyr[:2] == pytest.approx((34.906, -34.907), abs=0.002)


@pytest.mark.parametrize("name", list(ENCODERS))
def test_what_a_format_cannot_say_is_left_out(name):
    encoder = make_encoder(name, "1")
    assert encoder.encode([]) == b""
    assert encoder.encode([HeartbeatReading(UNNAMED)]) == b""
    strange = [RangeReading(UNNAMED, "no such id", 1.0)]
    assert encoder.encode(strange) == b""


def test_names_that_a_format_does_not_have_are_refused():
    with pytest.raises(BridgeError, match="format 'uwb' is not known; choose one of linktrack"):
        make_encoder("uwb", "1")
    with pytest.raises(BridgeError, match="device '256' is no LinkTrack node"):
        make_encoder("linktrack", "256")
    with pytest.raises(BridgeError, match="device 'FFFF' is no id of uwb-core"):
        make_encoder("uwb-core", "FFFF")


def test_times_go_from_one_clock_to_another():
    def said(ticks, clock):
        return HeartbeatReading(Source(ticks=ticks, clock=clock))

    assert ticks_on(MILLISECONDS_32, said(2**40, MICROSECONDS_64)) == round(2**40 / 1000) % 2**32
    assert ticks_on(MICROSECONDS_32, said(63897600000, RADIO_40)) == 1_000_000
    assert ticks_on(MICROSECONDS_32, HeartbeatReading(UNNAMED)) == 0
