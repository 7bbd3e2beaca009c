"""Samples of every format: frames of devices, and a frame that resynchronises a decoder."""

import struct
from dataclasses import dataclass, field

from hardware_bridge.decoders import make_decoder
from hardware_bridge.readings import (
    MICROSECONDS_32,
    HeartbeatReading,
    ImuReading,
    RangeReading,
    Source,
)
from hardware_bridge.wire.encoder import RelposEncoder


@dataclass(frozen=True, kw_only=True)
class Sample:
    unit: bytes
    """Complete frames that give readings at once; a line with its end, or a set of frames."""
    frames: tuple[bytes, ...] = ()
    """Further frames of devices."""
    tokens: tuple[bytes, ...] = field(default=())
    """Tokens of the format that random bytes rarely contain."""
    end: bytes = b"\n"
    """Bytes after which preceding bytes have no effect."""
    key: bytes | None = None

    @property
    def all_frames(self) -> tuple[bytes, ...]:
        return (self.unit, *self.frames)


def decoder_of(name):
    return make_decoder(name, SAMPLES[name].key)


def hex_bytes(text):
    return bytes.fromhex(text)


LINKTRACK = tuple(
    map(
        hex_bytes,
        (
            "55051d000001273b0d00383b0d0000000000 4b1301 0000910200a29b96",
            "55051d0000013b3b0d004c3b0d0000000000 4b1301 0000810200a39baf",
            "55051d0000014f3b0d00603b0d0000000000 4b1301 0000870200a29adb",
            "550532000201f81107006fd06e0000000102 5a1304 0100220b00b59f 0101a31700b6a0"
            "0102881c00aa9f 0103e61400b8a0 9a",
        ),
    )
)


def summed(body):
    return body + bytes((sum(body) & 0xFF,))


def node_frame_2(distance=2500, gyr=(0.25, -0.5, 1.5), acc=(0.5, -0.25, 9.75)):
    """Build a frame offset by offset, from the table of the format."""
    frame = bytearray(119 + 13)
    frame[0:2] = b"\x55\x04"
    struct.pack_into("<H", frame, 2, 119 + 13 + 1)
    struct.pack_into("<BBI", frame, 4, 0, 7, 999)
    struct.pack_into("<3f", frame, 40, *gyr)
    struct.pack_into("<3f", frame, 52, *acc)
    struct.pack_into("<4f", frame, 82, 1.0, 0.0, 0.0, 0.0)
    struct.pack_into("<I", frame, 102, 123456)
    struct.pack_into("<HB", frame, 116, 3700, 1)
    struct.pack_into("<BB", frame, 119, 0, 12)
    frame[121:124] = distance.to_bytes(3, "little", signed=True)
    frame[124:126] = bytes((160, 150))
    return summed(bytes(frame))


UWB_CORE = (
    b'{"utime": 3505358,"c": 278,"uid": 39068,"ouid": 4660,"raz": [4.561713],'
    b'"rssi": [-88.538536],"los": [0.000000]}\n',
    b'{"utime": 3636526,"c": 274,"uid": 39068,"ouid": 4660,"raz": [4.602430],'
    b'"rssi": [-88.202758],"los": [0.000000]}\n',
    b'{"utime": 88307220,"nrng": {"seq": 224,"mask": 127,"rng": ["8.088","8.039","1.320",'
    b'"8.426","7.131","6.604","7.026"],"uid": ["1946","5199","5235","2293","1436","5936",'
    b'"3958"]}}\n',
    b'{"utime": 9484254696807, "twr": {"rng": "1.071","uid": "d22d"},"uid": "55a6",'
    b' "diag": {"rssi": "-79.562","los": "1.000"}}\n',
    b'{"utime": 23859733,"tof": 1101004815,"range": 1036004551,"azimuth": 0,'
    b'"res_req":"6003EB0", "rec_tra": "6003E60"}\n',
)

DW1000 = (b"from: A1B2\t Range: 3.01 m\t RX power: -45.00 dBm\r\n",)

DWM1001 = (
    b"DIST,4,AN0,022E,7.94,8.03,0.00,3.44,AN1,9280,7.95,0.00,0.00,5.68,AN2,DCAE,0.00,8.03,0.00,"
    b"7.76,AN3,5431,0.00,0.00,0.00,8.73,POS,6.95,5.37,-1.97,52\r\n",
    b"DIST,3,AN0,2F2F,3.05,2.68,0.00,2.20,AN1,2ED0,3.02,0.00,0.00,2.23,AN2,2BA2,0.00,0.00,0.00,"
    b"3.13,POS,1.76,1.59,0.51,40\r\n",
    b"POS,7.10,5.24,-2.03,53\r\n",
    b"DIST,4,AN0,0090,0.00,0.00,0.00,3.25,AN1,D91E,0.00,0.00,0.00,3.33,AN2,0487,0.00,0.00,0.00,"
    b"0.18,AN3,15BA,0.00,0,AN3,15BA,0.00,0.00,0.00,0.00\r\n",
)
"""Lines of a device; the last one is damaged."""


def witmotion_frame(kind, *counts):
    return summed(
        bytes((0x55, kind)) + b"".join(c.to_bytes(2, "little", signed=True) for c in counts)
    )


ACC = witmotion_frame(0x51, 16, -32, 2048, 2500)
GYR = witmotion_frame(0x52, 100, -200, 16384, 2500)
ANGLE = witmotion_frame(0x53, 1, 2, 3, 2500)
MAG = witmotion_frame(0x54, 200, -100, -400, 2500)
QUATERNION = witmotion_frame(0x59, 32767, 0, 0, 0)

POSITIONS = (
    b'{"time": 81250000, "i": 1, "j": 2, "pos": [1.25, -0.5, 0.125], "vel": [0.1, 0, -0.2], '
    b'"cov": 0.02}\n',
    b'{"time": 81250000, "i": 2, "j": "3", "pos": [1, 2], "cov": [[4e-4, 1e-4], [1e-4, 9e-4]], '
    b'"status": "lost", "nlos": 0.25}\n',
    b'{"time": 81250001.0, "node": 1, "pos": [3.5, 0.25, 0.1], "q": [0.6, 0, 0, 0.8], '
    b'"speed": 0.75}\n',
    b'{"time": 81250002, "node": "car b", "yaw": 1.5707963267948966}\n',
    b'{"time": 81250003, "node": 1, "pos": [NaN, NaN, NaN]}\n',
    b'{"time": 81250003, "frame": 17}\n',
)


def relpos_frames():
    """Return two messages of each of three types that a node sends."""
    encoder, frames = RelposEncoder(1, 7, KEY), []
    for k in range(2):
        source = Source(device="1", ticks=1000 * k, clock=MICROSECONDS_32)
        for reading in (
            ImuReading(source, (0.1, -0.2, 0.3), (0.5, 0.25, 9.75), (20.0, -5.0, -40.0)),
            RangeReading(source, "2", 2.5, -80.0, -82.0),
            HeartbeatReading(source),
        ):
            frames.append(encoder.encode([reading]))
    return tuple(frames)


KEY = bytes(range(16))
RELPOS = relpos_frames()


def scanned(*samples):
    """Return samples of an RPLidar, bit by bit: angle [1/64 deg] and distance [1/4 mm]."""
    frames = [
        bytes(
            (
                0xBE if k else 0xBD,
                angle % 128 << 1 | 1,
                angle // 128,
                distance % 256,
                distance // 256,
            )
        )
        for k, (angle, distance) in enumerate(samples)
    ]
    return b"".join(frames)


RPLIDAR = (
    scanned(*((64 * k, 4000 + 40 * k) for k in range(12))),
    scanned(*((23039 - 64 * k, 0 if k % 3 else 65535) for k in range(11, -1, -1))),
    scanned(*((9000 + 57 * k, 700 + 9 * k) for k in range(10))),
)

SAMPLES = {
    "relpos": Sample(
        unit=RELPOS[0],
        frames=RELPOS[1:],
        tokens=(b"\0", b"\xff" * 255),
        end=b"\0",
        key=KEY,
    ),
    "linktrack": Sample(
        unit=LINKTRACK[0],
        frames=(*LINKTRACK[1:], node_frame_2(), node_frame_2(gyr=(float("nan"), 0, 0))),
        tokens=(b"\x55", b"\x55\x05\x1d\x00", b"\x55\x04\x85\x00", b"\x55\x00\xff\x03",
                b"\x57\x00"),
    ),
    "uwb-core": Sample(
        unit=UWB_CORE[0],
        frames=UWB_CORE[1:],
        tokens=(b'{"utime": ', b'"nrng": ', b'"twr": ', b"null", b"NaN", b"1e999", b"[" * 900,
                b"\n", b'"uid": ', b'"rng": [', b"\\u0664", b"true", b"> "),
    ),
    "dw1000": Sample(
        unit=DW1000[0],
        frames=(b'{"links":[{"A":"1783","R":"1.2"},{"A":"1782","R":"0.0"}]}\r\n',
                b"ranging init; 1 device added ! ->  short:1783\r\n",
                b"from: 1783\t Range: nan m\t RX power: -inf dBm\r\n"),
        tokens=(b"from: ", b"\t Range: ", b" m\t RX power: ", b" dBm", b"ovf", b"\r", b"\n",
                b'{"links":'),
    ),
    "dwm1001": Sample(
        unit=DWM1001[0],
        frames=DWM1001[1:],
        tokens=(b"DIST,", b"DIST,99", b",AN0,", b",POS,", b"dwm> ", b"\r\n", b",0.00"),
    ),
    "positions": Sample(
        unit=POSITIONS[0],
        frames=POSITIONS[1:],
        tokens=(b'{"time": ', b'"i": 1, "j": 2, ', b'"pos": [', b'"cov": [[', b'"q": [', b"NaN",
                b"null", b"1e999", b"9" * 900, b"[" * 900, b"\n", b'"node": "', b"\\u0664",
                b"true"),
    ),
    "rplidar": Sample(
        unit=RPLIDAR[0],
        frames=RPLIDAR[1:],
        tokens=(b"\xbd", b"\xbe", b"\xa5\x5a\x05\0\0\x40\x81", b"\xbe\x01\x2d\0\0"),
        end=b"\xa5\x5a\x05\0\0\x40\x81",
    ),
    "witmotion": Sample(
        unit=ACC + GYR + MAG,
        frames=(ACC + GYR, ACC + GYR + ANGLE + MAG + QUATERNION, ANGLE, MAG),
        tokens=(b"\x55", b"\x55\x51", b"\x55\x52", b"\x55\x54"),
    ),
}  # fmt: skip
"""Samples by name of the format; all registered formats must have one."""
