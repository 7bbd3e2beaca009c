"""Bytes captured from devices, with all values, as a whole and byte by byte."""

import struct

import pytest
from decoder_samples import (
    ACC,
    ANGLE,
    DW1000,
    DWM1001,
    GYR,
    LINKTRACK,
    MAG,
    QUATERNION,
    UWB_CORE,
    node_frame_2,
    summed,
    witmotion_frame,
)

from hardware_bridge.decoders import make_decoder
from hardware_bridge.decoders.uwb_core import RADIO_64
from hardware_bridge.readings import (
    MICROSECONDS_32,
    MILLISECONDS_32,
    UNNAMED,
    ImuReading,
    RangeReading,
    Source,
    StatusReading,
)


def decode(name, data):
    """Return readings and counts, which must be equal byte by byte."""
    whole, bytewise = make_decoder(name), make_decoder(name)
    readings = whole.feed(data)
    assert [r for byte in data for r in bytewise.feed(bytes((byte,)))] == readings
    assert whole.counts == bytewise.counts
    return readings, whole.counts


def node(name, ticks):
    return Source(device=name, ticks=ticks, clock=MILLISECONDS_32)


def at(ticks, clock=MICROSECONDS_32):
    return Source(ticks=ticks, clock=clock)


def test_linktrack_moving_cars():
    readings, counts = decode("linktrack", b"".join(LINKTRACK[:3]))
    expected = []
    times = (0x0D3B27, 0x0D3B3B, 0x0D3B4F)
    for ticks, metres, first, total in zip(
        times, (0.657, 0.641, 0.647), (-81.0, -81.5, -81.0), (-77.5, -77.5, -77.0), strict=True
    ):
        source = node("1", ticks)
        expected.append(RangeReading(source, "0", metres, rx_power=total, fp_power=first))
        expected.append(StatusReading(source, voltage=4.939))
    assert readings == expected
    assert (counts.frames, counts.damaged, counts.strange) == (3, 0, 0)
    assert times[1] - times[0] == times[2] - times[1] == 20  # 50 Hz


def test_linktrack_tag_with_four_anchors():
    readings, _ = decode("linktrack", LINKTRACK[3])
    source = node("T1", 0x0711F8)
    assert readings == [
        RangeReading(source, "A0", 2.850, rx_power=-79.5, fp_power=-90.5),
        RangeReading(source, "A1", 6.051, rx_power=-80.0, fp_power=-91.0),
        RangeReading(source, "A2", 7.304, rx_power=-79.5, fp_power=-85.0),
        RangeReading(source, "A3", 5.350, rx_power=-80.0, fp_power=-92.0),
        StatusReading(source, voltage=4.954),
    ]


def test_linktrack_node_frame_2_gives_the_raw_imu_and_no_orientation():
    readings, _ = decode("linktrack", node_frame_2())
    source = node("7", 123456)
    assert readings == [
        ImuReading(source, gyr=(0.25, -0.5, 1.5), acc=(0.5, -0.25, 9.75)),
        RangeReading(source, "12", 2.5, rx_power=-75.0, fp_power=-80.0),
        StatusReading(source, voltage=3.7),
    ]


def test_linktrack_leaves_out_what_was_not_measured():
    source = node("7", 123456)
    for frame in (node_frame_2(distance=0), node_frame_2(distance=-20)):
        readings, _ = decode("linktrack", frame)
        assert [type(r) for r in readings] == [ImuReading, StatusReading]
    readings, _ = decode("linktrack", node_frame_2(gyr=(0, 0, 0), acc=(0, 0, 0)))
    assert readings[0] == RangeReading(source, "12", 2.5, rx_power=-75.0, fp_power=-80.0)


@pytest.mark.parametrize("frame", [
    node_frame_2(gyr=(float("nan"), 0, 0)), node_frame_2(acc=(0, 0, float("inf"))),
    node_frame_2(gyr=(200.0, 0, 0)), node_frame_2(acc=(0, 0, 2000.0)),
    node_frame_2(distance=1_000_001),
])  # fmt: skip
def test_linktrack_refuses_what_cannot_be(frame):
    readings, counts = decode("linktrack", frame)
    assert not readings
    assert counts.damaged == 1


def test_linktrack_skips_other_functions_and_products():
    other = summed(b"\x55\x02\x0a\x00" + bytes(5))
    tofsense = summed(b"\x57\x00" + bytes(13))
    readings, counts = decode("linktrack", other + tofsense + LINKTRACK[0])
    assert len(readings) == 2
    assert (counts.frames, counts.skipped, counts.strange, counts.damaged) == (1, 1, 16, 0)


def test_linktrack_count_of_neighbours_must_fit_the_length():
    body = bytearray(LINKTRACK[0][:-1])
    body[20] = 2
    readings, counts = decode("linktrack", summed(bytes(body)))
    assert (readings, counts.damaged) == ([], 1)


def test_a_false_beginning_holds_up_nothing():
    decoder = make_decoder("linktrack")
    decoder.feed(b"\x55\x00\xff\x03" * 3)  # announces 1023 bytes that do not follow
    assert len(decoder.feed(LINKTRACK[0])) == 2
    assert decoder.waiting == 0


def test_uwb_core_both_dialects():
    readings, counts = decode("uwb-core", b"".join(UWB_CORE))
    own = at(88307220)
    metres = (8.088, 8.039, 1.320, 8.426, 7.131, 6.604, 7.026)
    others = ("1946", "5199", "5235", "2293", "1436", "5936", "3958")
    assert readings == [
        RangeReading(at(3505358), "1234", 4.561713, rx_power=-88.538536, nearer="989C"),
        RangeReading(at(3636526), "1234", 4.602430, rx_power=-88.202758, nearer="989C"),
        *(RangeReading(own, o, m) for o, m in zip(others, metres, strict=True)),
        RangeReading(at(9484254696807, RADIO_64), "D22D", 1.071, rx_power=-79.562, nearer="55A6"),
        RangeReading(at(23859733), "", struct.unpack("<f", struct.pack("<I", 1036004551))[0]),
    ]
    assert (counts.frames, counts.skipped, counts.damaged) == (5, 0, 0)
    assert 148.0 < 9484254696807 / RADIO_64.hz < 149.0  # [s]; as microseconds 110 days


def one_range(to="1234", metres=4.5, **more):
    return RangeReading(at(1), to, metres, nearer="989C", **more)


@pytest.mark.parametrize(("line", "expected"), [
    ('{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5,0.1,null]}', [one_range()]),
    ('> {"utime":1,"uid":"989c","ouid":"1234","raz":["4.500"],"rssi":[null]}', [one_range()]),
    ('{"utime":1,"uid":39068,"ouid":[4660,17],"rng":[4.5,1.25]}',
     [one_range(), one_range("0011", 1.25)]),
    ('{"utime":1,"uid":39068,"ouid":[4660,17],"rng":[0.000,1.25]}', [one_range("0011", 1.25)]),
    ('{"utime":1,"twr":{"raz":[4.5],"uid":4660},"uid":39068}', [one_range()]),
    ('{"utime":1,"twr":{"rng":1083179008,"uid":4660},"uid":39068}', [one_range()]),
    ('{"utime":1,"uid":39{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5]}', [one_range()]),
    ('{"utime":1,"uid":39068,"ouid":4660,"raz":[null]}', []),
    ('{"utime":1,"uid":39068,"ouid":4660,"raz":[-0.040]}', []),
    ('{"utime": 18724444,"nrng": {"seq": 133,"mask": 1,"rng": [1047851887],"tdoa": [0]}}', []),
    ('{"utime": 1640,"msg": "dw1000_dev_init"}', []),
    ('{"utime": 4291084105,"wcs": [412782451200,412782451200],"skew": 0}', []),
    ("main(): This is RIOT!", []),
    ("> range start", []),
])  # fmt: skip
def test_uwb_core_forms(line, expected):
    readings, counts = decode("uwb-core", line.encode() + b"\n")
    assert readings == expected
    assert (counts.skipped, counts.damaged) == (int(not expected), 0)


@pytest.mark.parametrize("line", [
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5]',
    '{"utime":1,"uid":39068,"ouid":39068,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":0,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":65535,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":"12g4","raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":true,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[304.5]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[Infinity]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":["4.5m"]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":["\\u0664.5"]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5],"rssi":[-148.5]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5],"rssi":[8.5]}',
    '{"utime":-1,"uid":39068,"ouid":4660,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5,4.5,4.5,4.5]}',
    '{"utime":1,"nrng":[4.5]}',
    '{"utime":6291084105,"uid":39068,"ouid":4660,"raz":[4.5]}',
    '{"utime":1.5,"uid":39068,"ouid":4660,"raz":[4.5]}',
    '{"utime":1,"uid":39068,"ouid":4660,"raz":[4.5],"raz":[4.6]}',
    '{"utime":1,"nrng":{"rng":["8.088"],"uid":["1946","5199"]}}',
    '{"utime":1,"nrng":{"rng":["8.088","8.1"],"uid":["1946","1946"]}}',
    '{"utime":1,"uid":39068,"ouid":[9592,18288],"rng":[-2147483648.2147483648,9259532.000]}',
    "{" + "[" * 900,
])  # fmt: skip
def test_uwb_core_refuses(line):
    readings, counts = decode("uwb-core", line.encode() + b"\n")
    assert (readings, counts.damaged) == ([], 1)


def test_dw1000_capture():
    readings, counts = decode("dw1000", DW1000[0])
    assert readings == [RangeReading(UNNAMED, "A1B2", 3.01, rx_power=-45.0)]
    assert (counts.frames, counts.skipped, counts.damaged) == (1, 0, 0)


@pytest.mark.parametrize(("line", "n", "damaged"), [
    ("from: A1B2\t Range: 3.01 m\t RX power: nan dBm", 1, 0),
    ("from: A1from: A1B2\t Range: 3.01 m\t RX power: -45.00 dBm", 1, 0),
    ("from: A1B2\t Range: nan m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: ovf m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: -0.25 m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: 0.00 m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: 300.01 m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: 3.01 m\t RX power: -145.00 dBm", 0, 1),
    ("from: A1B2\t Range: 3.01 m\t RX power: 45.00 dBm", 0, 1),
    ("from: A1B2F\t Range: 3.01 m\t RX power: -45.00 dBm", 0, 1),
    ("from: G1B2\t Range: 3.01 m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: 3.1 m\t RX power: -45.00 dBm", 0, 1),
    ("from: A1B2\t Range: 3.01 m\t RX power: -45.00 dB", 0, 1),
    ("ranging init; 1 device added ! ->  short:1783", 0, 0),
    ("blink; 1 device added ! ->  short:1783", 0, 0),
    ("delete inactive device: 1783", 0, 0),
    ('{"links":[{"A":"1783","R":"1.2"},{"A":"1782","R":"0.0"}]}', 1, 0),
    ('{"links":[]}', 0, 0),
    ('{"links":[{"A":"1783","R":"1.2"}', 0, 1),
    ('{"links":[{"A":"1783","R":"301.2"}]}', 0, 1),
    ('{"links":[{"A":"17","B":"1.2"}]}', 0, 1),
    ('{"links":7}', 0, 1),
    ('{"links":[7]}', 0, 1),
    ('{"links":[{"A":1783,"R":"1.2"}]}', 0, 1),
])  # fmt: skip
def test_dw1000_lines(line, n, damaged):
    readings, counts = decode("dw1000", line.encode() + b"\r\n")
    assert len(readings) == n
    assert counts.damaged == damaged
    assert counts.frames + counts.skipped + counts.damaged == 1


def test_dw1000_links_are_read_until_lines_come():
    links = b'{"links":[{"A":"1783","R":"1.2"}]}\r\n'
    decoder = make_decoder("dw1000")
    assert decoder.feed(links) == [RangeReading(UNNAMED, "1783", 1.2)]
    decoder.feed(DW1000[0])
    assert decoder.feed(links) == []


def test_dwm1001_captures():
    readings, counts = decode("dwm1001", b"".join(DWM1001))
    assert [(r.to, r.distance) for r in readings] == [
        ("022E", 3.44), ("9280", 5.68), ("DCAE", 7.76), ("5431", 8.73),
        ("2F2F", 2.20), ("2ED0", 2.23), ("2BA2", 3.13),
    ]  # fmt: skip
    assert all(r == RangeReading(UNNAMED, r.to, r.distance) for r in readings)
    assert (counts.frames, counts.skipped, counts.damaged) == (2, 1, 1)


ONE = "DIST,1,AN0,022E,7.94,8.03,0.00,3.44"


@pytest.mark.parametrize(("line", "n", "damaged"), [
    (ONE, 1, 0),
    ("dwm> " + ONE, 1, 0),
    ("DIST,2,AN0,022E,7.94,8.03,0.dwm> 00,3.44,AN1,022F,0.00,0.00,0.00,1.00", 2, 0),
    ("DIST,2,AN0,02" + ONE, 1, 0),
    ("DIST,2,AN0,022E,7.94,8.03,0.00,0.00,AN1,022F,0.00,0.00,0.00,1.00", 1, 0),
    ("DIST,1,AN0,022E,7.94,8.03,0.00,0.00", 0, 0),
    ("DIST,0", 0, 0),
    (ONE + ",POS,1.00,2.00,3.00,100", 1, 0),
    (ONE + ",POS,1.00,2.00,3.00,101", 0, 1),
    (ONE + ",POS,1.00,2.00,3.00", 0, 1),
    ("DIST,2,AN0,022E,7.94,8.03,0.00,3.44", 0, 1),
    ("DIST,1,AN1,022E,7.94,8.03,0.00,3.44", 0, 1),
    ("DIST,1,AN0,022e,7.94,8.03,0.00,3.44", 0, 1),
    ("DIST,1,AN0,022E,7.94,8.03,0.00,3.4", 0, 1),
    ("DIST,1,AN0,022E,7.94,8.03,0.00,344.00", 0, 1),
    ("DIST,2,AN0,022E,7.94,8.03,0.00,3.44,AN1,022E,0.00,0.00,0.00,1.00", 0, 1),
    ("DIST,", 0, 1),
    (" DWM1001 TWR Real Time Location System", 0, 0),
])  # fmt: skip
def test_dwm1001_lines(line, n, damaged):
    readings, counts = decode("dwm1001", line.encode() + b"\r\n")
    assert len(readings) == n
    assert counts.damaged == damaged


IMU = ImuReading(
    UNNAMED,
    gyr=tuple(k * 2000.0 / 32768.0 * 0.017453292519943295 for k in (100, -200, 16384)),
    acc=tuple(k * 16.0 / 32768.0 * 9.80665 for k in (16, -32, 2048)),
)
WITH_MAG = ImuReading(UNNAMED, gyr=IMU.gyr, acc=IMU.acc, mag=(20.0, -10.0, -40.0))


def near(readings, expected):
    flat = [v for r in readings for v in (*r.gyr, *r.acc, *(r.mag or ()))]
    told = [v for r in expected for v in (*r.gyr, *r.acc, *(r.mag or ()))]
    assert flat == pytest.approx(told, rel=1e-12)
    assert [r.mag is None for r in readings] == [r.mag is None for r in expected]


@pytest.mark.parametrize(("stream", "expected"), [
    (ACC + GYR + MAG, [WITH_MAG]),
    (ACC + GYR + ANGLE + MAG + QUATERNION, [WITH_MAG]),
    (ACC + GYR, []),  # a magnetometer may follow
    (ACC + GYR + ANGLE + ACC, [IMU]),
    ((ACC + GYR) * 3, [IMU, IMU]),  # the second at once: no magnetometer followed the first
    (ACC + GYR + ACC + GYR + MAG + ACC + GYR + MAG, [IMU, IMU, WITH_MAG]),
    (ACC + GYR + MAG + ACC + GYR + ACC + GYR + MAG, [WITH_MAG, IMU, IMU]),
    (ACC + ANGLE + GYR + MAG, []),  # the gyroscope of this burst was lost
    (GYR + MAG + ACC + GYR + MAG, [WITH_MAG]),
])  # fmt: skip
def test_witmotion_bursts(stream, expected):
    readings, counts = decode("witmotion", stream)
    if stream == (ACC + GYR) * 3:
        expected = [IMU, IMU, IMU]
    near(readings, expected)
    assert (counts.damaged, counts.strange) == (0, 0)


def test_witmotion_at_rest_feels_gravity_upwards():
    readings, _ = decode("witmotion", ACC + GYR + MAG)
    assert readings[0].acc[2] == pytest.approx(9.80665)
    assert readings[0].gyr[2] == pytest.approx(17.453292519943295)


def test_a_magnetometer_does_not_wait_in_the_frame_of_another():
    readings, counts = decode("witmotion", ACC + b"\x55" + GYR + witmotion_frame(0x5A, 0, 0, 0, 0))
    assert not readings
    assert counts.strange == 1


def test_linktrack_and_witmotion_do_not_mistake_each_other():
    readings, _ = decode("linktrack", ACC + GYR + ANGLE + MAG)
    assert not readings
    readings, _ = decode("witmotion", b"".join(LINKTRACK))
    assert not readings
