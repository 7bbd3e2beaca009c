"""Preintegrated motion of a node, as it sends it in its ranging messages.

A node integrates its gravity-free acceleration in the world frame from the moment when its
orientation is known (its epoch). Every message carries both sums and the orientation at the last
inertial sample before the message:

    v(t) = int a dt,    p(t) = int v dt

The difference of two messages is the motion between them, so a lost message costs nothing but the
time resolution (preintegration, Forster et al., IEEE Trans. Robotics 33 (2017), in the world frame,
since the orientation is known). Rounding errors do not add up for the same reason. Sums wrap:

    bytes  field                       unit
    2      age of the sums             10 us, before the time stamp of the message
    3 x 3  v, x y z                    1/4096 m/s, modulo 4096 m/s
    3 x 2  p, x y z                    1/8192 m, modulo 8 m
    6      epoch                       1 bit, changes whenever the sums start again
           orientation, body to world  2 bits: the largest of w x y z, which is positive; 15 bits
                                       each of the others, in this order, in 2^-14.5
    1      added noise of acceleration 0 none, else 2^((k - 128) / 8) m/s2/sqrt(Hz)

The covariance of a difference over T seconds is that of white acceleration noise of density q:
q^2 T, q^2 T^2 / 2 and q^2 T^3 / 3 for v, v p and p. A receiver knows q from the vehicle of the
node; the last byte adds to it, for instance while an accelerometer saturates.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from tracking.errors import WireError

MOTION_BYTES = 24
AGE_UNIT = 1e-5
VELOCITY_UNIT, VELOCITY_BITS = 1.0 / 4096.0, 24
POSITION_UNIT, POSITION_BITS = 1.0 / 8192.0, 16
ROTATION_UNIT = 2.0**-14.5
NOISE_ONE, NOISE_STEPS = 128, 8.0
"""Byte of a noise density of 1 m/s2/sqrt(Hz); steps per factor of two."""

_PACKED = struct.Struct("<H9s3h6sB")


@dataclass(frozen=True, slots=True)
class Motion:
    """Sums of one message, in counts of their units."""

    age: int
    velocity: tuple[int, int, int]
    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int]
    """Index of the largest component of the quaternion, and the other three."""
    noise: int
    epoch: int = 0
    """Bit that changes whenever the sums start again."""


def encode_motion(motion: Motion) -> bytes:
    """Return the bytes of a motion."""
    velocity = b"".join(v.to_bytes(3, "little", signed=True) for v in motion.velocity)
    packed = motion.epoch << 2 | motion.rotation[0]
    for count in motion.rotation[1:]:
        packed = packed << 15 | count & 0x7FFF
    rotation = packed.to_bytes(6, "little")
    return _PACKED.pack(motion.age, velocity, *motion.position, rotation, motion.noise)


def decode_motion(data: bytes) -> Motion:
    """Return the motion of some bytes.

    Raises:
        WireError: The bytes are too few or too many, or the orientation is none.
    """
    if len(data) != MOTION_BYTES:
        raise WireError(f"motion: expected {MOTION_BYTES} bytes, got {len(data)}")
    age, velocity, px, py, pz, rotation, noise = _PACKED.unpack(data)
    v = [int.from_bytes(velocity[k : k + 3], "little", signed=True) for k in (0, 3, 6)]
    packed = int.from_bytes(rotation, "little")
    x, y, z = ((packed >> shift & 0x7FFF ^ 0x4000) - 0x4000 for shift in (30, 15, 0))
    if math.hypot(x, y, z) * ROTATION_UNIT > 0.75**0.5 + 4.0 * ROTATION_UNIT:
        raise WireError("motion: expected an orientation, its quaternion is too long")
    return Motion(
        age, (v[0], v[1], v[2]), (px, py, pz), (packed >> 45 & 3, x, y, z), noise, packed >> 47
    )
