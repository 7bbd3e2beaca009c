"""WitMotion inertial sensors, the standard protocol: ``55 TT d0..d7 SUM`` [1].

One burst holds a frame per quantity, in the order of their types. Accelerometer and gyroscope of a
burst become one reading, with the magnetometer if the sensor is configured to send it. Time, angle
and quaternion are skipped: the tracker filters orientation itself.

The magnetometer follows the gyroscope, and the previous burst tells whether to expect it: if so, a
reading waits for it; if not, the gyroscope completes the reading. A reading of the first burst
waits for the next frame of either kind.

References:
    [1] WitMotion, WT901 datasheet v20-0702, section 5.1; the unit of the magnetometer from the
        WT901BLECL datasheet v20-0707, section 6.1.2.
"""

from __future__ import annotations

import struct
from math import pi

from hardware_bridge.decoders.checked_frames import CheckedFrames
from hardware_bridge.readings import UNNAMED, ImuReading, Reading, Vector

START = 0x55
TIME, ACC, GYR, MAG, QUATERNION = 0x50, 0x51, 0x52, 0x54, 0x59
TYPES = range(0x50, 0x60)
FRAME = struct.Struct("<2B4hB")

ACC_UNIT = 16.0 * 9.80665 / 32768.0
"""[m/s2] Unit of the accelerometer."""
GYR_UNIT = 2000.0 * pi / 180.0 / 32768.0
"""[rad/s] Unit of the gyroscope."""
MAG_UNIT = 0.1
"""[uT] Unit of the magnetometer, one milligauss. Models differ; calibration absorbs the scale."""


def frame_length(head: bytes) -> int:
    """Return the length of a frame, equal for all types; 0 for an unknown type."""
    return FRAME.size if head[1] in TYPES else 0


class Bursts:
    """Combination of the frames of a burst to readings."""

    def __init__(self) -> None:
        self._acc: Vector | None = None
        self._imu: ImuReading | None = None
        """Reading that waits for its magnetometer sample."""
        self._mag_comes: bool | None = None

    def read_frame(self, frame: bytes) -> list[Reading]:
        """Return the readings that a frame with a correct sum completes."""
        kind, x, y, z = FRAME.unpack(frame)[1:5]
        if kind in (TIME, ACC):
            readings = self._finish(None)
            self._acc = (x * ACC_UNIT, y * ACC_UNIT, z * ACC_UNIT) if kind == ACC else None
            return readings
        if kind == GYR and self._acc is not None:
            gyr = (x * GYR_UNIT, y * GYR_UNIT, z * GYR_UNIT)
            self._imu = ImuReading(UNNAMED, gyr=gyr, acc=self._acc)
            self._acc = None
            if self._mag_comes is False:
                return self._finish(None)
            return []
        # A gyroscope frame that follows later belongs to another burst.
        self._acc = None
        if kind != MAG:
            return []
        self._mag_comes = True
        return self._finish((x * MAG_UNIT, y * MAG_UNIT, z * MAG_UNIT))

    def _finish(self, mag: Vector | None) -> list[Reading]:
        imu, self._imu = self._imu, None
        if imu is None:
            return []
        self._mag_comes = mag is not None
        return [ImuReading(UNNAMED, gyr=imu.gyr, acc=imu.acc, mag=mag)]


def witmotion_decoder() -> CheckedFrames:
    """Return a decoder for one port."""
    return CheckedFrames(START, 2, frame_length, Bursts().read_frame)
