"""Heading from the magnetometer, with rejection of disturbed fields, [1] sec. 3.3 and 3.6.

The field, rotated to the world by the orientation without a magnetometer, should point north: the
heading correction delta is a first-order low pass of the angle between. A field whose norm or dip
differs from the reference is disturbed: it corrects nothing for a minute, then at half the gain. A
new field is accepted as the reference once it has lasted while the sensor turned.

References:
    [1] Laidig, Seel, VQF, Information Fusion 91 (2023) 187.
"""

from __future__ import annotations

import math

from tracking.ahrs.lowpass import low_pass
from tracking.kernels.jit import small_kernel

DELTA, COS, SIN, GAIN, DISTURBED, REJECTED_T, UNDISTURBED_T = 0, 1, 2, 3, 4, 5, 6
NORM, DIP, NEW_NORM, NEW_DIP, NEW_T, COUNT, FIELD = 7, 8, 9, 10, 11, 12, 13
N_MAGNETIC = 19
"""Columns of the memory: delta [rad], cosine and sine of its half; least gain of the next reading,
for an initial mean; 1 in a disturbed field; rejected time and undisturbed time [s]; norm and dip
[rad] of the reference field, then of the candidate for a new one, and turning time in that [s];
number of readings; low pass of norm and dip."""


@small_kernel
def start_magnetic(magnetic, c, e, n):
    """Initialise the memory: no reference field, and full gain for the first reading."""
    for k in range(N_MAGNETIC):
        magnetic[e, n, k] = 0.0
    magnetic[e, n, COS] = magnetic[e, n, GAIN] = magnetic[e, n, DISTURBED] = 1.0
    magnetic[e, n, REJECTED_T] = c.field[0].longest_rejection
    magnetic[e, n, NEW_NORM] = -1.0


@small_kernel
def is_near(c, norm, dip, known_norm, known_dip):
    """Return whether a field matches a known one."""
    near = abs(norm - known_norm) < c.field[0].norm_change * known_norm
    return near and abs(dip - known_dip) < c.field[0].dip_change


@small_kernel
def watch_field(magnetic, c, e, n, norm, dip, rate):
    """Detect whether the field is disturbed, and update the reference.

    Args:
        magnetic: Memory, updated.
        c: OrientationCoefficients.
        e: Environment.
        n: Node.
        norm: Norm of the field, in any unit.
        dip: Angle of the field below the horizon [rad].
        rate: Low-passed turn rate [rad/s].
    """
    dt, gain, limits = c.mag_dt[n], c.reference_gain[n], c.field[0]
    magnetic[e, n, COUNT] += 1.0
    magnetic[e, n, FIELD], magnetic[e, n, FIELD + 1] = norm, dip
    low_pass(magnetic, e, n, FIELD, 2, magnetic[e, n, COUNT], c.field_pass, n)
    norm, dip = magnetic[e, n, FIELD], magnetic[e, n, FIELD + 1]
    if is_near(c, norm, dip, magnetic[e, n, NORM], magnetic[e, n, DIP]):
        magnetic[e, n, UNDISTURBED_T] += dt
        if magnetic[e, n, UNDISTURBED_T] >= limits.undisturbed_after:
            magnetic[e, n, DISTURBED] = 0.0
            magnetic[e, n, NORM] += gain * (norm - magnetic[e, n, NORM])
            magnetic[e, n, DIP] += gain * (dip - magnetic[e, n, DIP])
    else:
        magnetic[e, n, UNDISTURBED_T] = 0.0
        magnetic[e, n, DISTURBED] = 1.0
    if is_near(c, norm, dip, magnetic[e, n, NEW_NORM], magnetic[e, n, NEW_DIP]):
        if rate >= limits.least_turn:
            magnetic[e, n, NEW_T] += dt
        magnetic[e, n, NEW_NORM] += gain * (norm - magnetic[e, n, NEW_NORM])
        magnetic[e, n, NEW_DIP] += gain * (dip - magnetic[e, n, NEW_DIP])
        needed = limits.first_after if magnetic[e, n, NORM] == 0.0 else limits.new_after
        if magnetic[e, n, DISTURBED] != 0.0 and magnetic[e, n, NEW_T] >= needed:
            magnetic[e, n, NORM] = magnetic[e, n, NEW_NORM]
            magnetic[e, n, DIP] = magnetic[e, n, NEW_DIP]
            magnetic[e, n, DISTURBED] = 0.0
            magnetic[e, n, UNDISTURBED_T] = limits.undisturbed_after
    else:
        magnetic[e, n, NEW_T] = 0.0
        magnetic[e, n, NEW_NORM], magnetic[e, n, NEW_DIP] = norm, dip


@small_kernel
def wrapped(angle):
    """Wrap an angle within -3 pi to 3 pi to -pi to pi."""
    if angle > math.pi:
        angle -= 2.0 * math.pi
    elif angle < -math.pi:
        angle += 2.0 * math.pi
    return angle


@small_kernel
def correct_heading(magnetic, c, e, n, mx, my, mz, rate):
    """Correct the heading by a field that the 6D orientation rotated to the world.

    Args:
        magnetic: Memory, updated.
        c: OrientationCoefficients.
        e: Environment.
        n: Node.
        mx: Field, not all zero, in any unit, along x.
        my: Field, not all zero, in any unit, along y.
        mz: Field, not all zero, in any unit, along z, up.
        rate: Low-passed turn rate [rad/s].
    """
    norm = math.sqrt(mx * mx + my * my + mz * mz)
    watch_field(magnetic, c, e, n, norm, -math.asin(min(max(mz / norm, -1.0), 1.0)), rate)
    angle = wrapped(math.atan2(mx, my) - magnetic[e, n, DELTA])
    gain, dt, limits = c.mag_gain[n], c.mag_dt[n], c.field[0]
    if magnetic[e, n, DISTURBED] == 0.0:
        left = magnetic[e, n, REJECTED_T] - limits.rejection_factor * dt
        magnetic[e, n, REJECTED_T] = max(left, 0.0)
    elif magnetic[e, n, REJECTED_T] <= limits.longest_rejection:
        magnetic[e, n, REJECTED_T] += dt
        gain = 0.0
    else:
        gain /= limits.rejection_factor
    # The first readings are averaged in any field: 1, 1/2, 1/3, ...
    least = magnetic[e, n, GAIN]
    if least != 0.0:
        gain = max(gain, least)
        least /= least + 1.0
        magnetic[e, n, GAIN] = 0.0 if least * c.tau_mag[n] < dt else least
    delta = wrapped(magnetic[e, n, DELTA] + gain * angle)
    if gain != 0.0:
        magnetic[e, n, DELTA] = delta
        magnetic[e, n, COS] = math.cos(0.5 * delta)
        magnetic[e, n, SIN] = math.sin(0.5 * delta)
