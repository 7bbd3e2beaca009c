"""CRC-32 and SipHash-2-4 of bytes in an array.

CRC-32 is that of zlib and Ethernet: reflected polynomial 0xEDB88320, initial value and final XOR
all ones, eight bytes at a time from tables ("slicing by 8", [1]). SipHash-2-4 is a keyed hash for
short messages [2], with a 64 bit result.

References:
    [1] Kounavis, Berry, A systematic approach to building high performance software-based CRC
        generators, ISCC 2005.
    [2] Aumasson, Bernstein, SipHash: a fast short-input PRF, INDOCRYPT 2012.
"""

import numpy as np

from tracking.kernels.jit import kernel, small_kernel


@small_kernel
def crc32(data, n, table):
    """Return the CRC-32 of the first n bytes."""
    crc = np.uint32(0xFFFFFFFF)
    full = np.uint32(0xFF)
    at = 0
    while at + 8 <= n:
        low = crc ^ (
            np.uint32(data[at])
            | np.uint32(data[at + 1]) << np.uint32(8)
            | np.uint32(data[at + 2]) << np.uint32(16)
            | np.uint32(data[at + 3]) << np.uint32(24)
        )
        crc = np.uint32(
            table[7, low & full]
            ^ table[6, (low >> np.uint32(8)) & full]
            ^ table[5, (low >> np.uint32(16)) & full]
            ^ table[4, (low >> np.uint32(24)) & full]
            ^ table[3, data[at + 4]]
            ^ table[2, data[at + 5]]
            ^ table[1, data[at + 6]]
            ^ table[0, data[at + 7]]
        )
        at += 8
    while at < n:
        crc = np.uint32((crc >> np.uint32(8)) ^ table[0, (crc ^ np.uint32(data[at])) & full])
        at += 1
    return np.uint32(crc ^ np.uint32(0xFFFFFFFF))


@small_kernel
def _turn(x, bits):
    return (x << np.uint64(bits)) | (x >> np.uint64(64 - bits))


@small_kernel
def _round(v0, v1, v2, v3):
    v0 = v0 + v1
    v1 = _turn(v1, 13) ^ v0
    v0 = _turn(v0, 32)
    v2 = v2 + v3
    v3 = _turn(v3, 16) ^ v2
    v0 = v0 + v3
    v3 = _turn(v3, 21) ^ v0
    v2 = v2 + v1
    v1 = _turn(v1, 17) ^ v2
    v2 = _turn(v2, 32)
    return v0, v1, v2, v3


@small_kernel
def siphash(data, n, key):
    """Return the SipHash-2-4 of the first n bytes; the key is two little-endian words."""
    v0 = key[0] ^ np.uint64(0x736F6D6570736575)
    v1 = key[1] ^ np.uint64(0x646F72616E646F6D)
    v2 = key[0] ^ np.uint64(0x6C7967656E657261)
    v3 = key[1] ^ np.uint64(0x7465646279746573)
    at = 0
    while at <= n:
        # The last word holds the remaining bytes and, in its highest byte, the length.
        word = np.uint64(0)
        most = min(8, n - at)
        for k in range(most):
            word |= np.uint64(data[at + k]) << np.uint64(8 * k)
        if most < 8:
            word |= np.uint64(n & 0xFF) << np.uint64(56)
        v3 ^= word
        v0, v1, v2, v3 = _round(v0, v1, v2, v3)
        v0, v1, v2, v3 = _round(v0, v1, v2, v3)
        v0 ^= word
        at += 8
    v2 ^= np.uint64(0xFF)
    for _ in range(4):
        v0, v1, v2, v3 = _round(v0, v1, v2, v3)
    return v0 ^ v1 ^ v2 ^ v3


@kernel
def check_sums(data, n, table, key, out):
    """Write CRC-32 and SipHash of the first n bytes into out, (2) of uint64."""
    out[0] = np.uint64(crc32(data, n, table))
    out[1] = siphash(data, n, key)
