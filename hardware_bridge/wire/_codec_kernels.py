"""Conversion of complete byte buffers to arrays of frames and values, and back.

A frame on the wire is stuffed by COBS [1], so that it contains no zero byte. A zero terminates it;
a zero before it terminates any preceding noise.

References:
    [1] Cheshire, Baker, Consistent overhead byte stuffing, IEEE/ACM Transactions on Networking
        7 (2), 1999.
"""

import numpy as np

from hardware_bridge.wire._check_kernels import crc32, siphash
from tracking.kernels.jit import kernel, small_kernel

HEADER, MAC, CRC = 16, 8, 4
VERSION, MOST_FRAME, MOST_CODED, MOST_ROWS = 1, 512, 515, 32
POSITION, FRAMES, ROWS, SKIPPED, DAMAGED, STRANGE = 0, 1, 2, 3, 4, 5


@small_kernel
def _unstuff(data, at, end, raw):
    """Undo COBS of the bytes between two zeros; return the frame's length, or -1 if invalid."""
    n = 0
    while at < end:
        code = np.int64(data[at])
        if at + code > end:
            return -1
        for k in range(1, code):
            raw[n] = data[at + k]
            n += 1
        at += code
        if code < 255 and at < end:
            raw[n] = 0
            n += 1
    return n


@small_kernel
def _stuff(raw, n, out, at):
    """Write a frame with COBS and a final zero; return the position behind it."""
    mark = at
    at += 1
    for k in range(n):
        if raw[k] != 0:
            out[at] = raw[k]
            at += 1
        full = at - mark == 255 and k + 1 < n
        if raw[k] == 0 or full:
            out[mark] = at - mark
            mark = at
            at += 1
    out[mark] = at - mark
    out[at] = 0
    return at + 1


@small_kernel
def _number(raw, at, size):
    value = np.int64(0)
    for k in range(size):
        value |= np.int64(raw[at + k]) << (8 * k)
    return value


@small_kernel
def _put(raw, at, size, value):
    for k in range(size):
        raw[at + k] = (value >> (8 * k)) & 0xFF


@kernel
def decode_frames(data, key, keyed, crc_table, messages, columns, raw, frames, values, state):
    """Decode complete frames from state[POSITION] on, as long as there is capacity.

    Args:
        data: Bytes, (n).
        key: Key of the MAC, two words; read only if keyed.
        keyed: True to refuse frames without MAC or with a wrong one.
        crc_table: CRC table, (8, 256); as the next two from `hardware_bridge.wire.layout`.
        messages: Messages by type, (256).
        columns: Columns, (column).
        raw: Work array for one frame, (`MOST_CODED`).
        frames: Output, (frame).
        values: Output in SI units, (row, column).
        state: Position in data, input and output; then outputs: number of frames and of rows, and
            counters of skipped, damaged and strange, which are incremented.
    """
    n = len(data)
    at = state[POSITION]
    n_frames = 0
    n_rows = 0
    while n_frames < len(frames) and n_rows + MOST_ROWS <= len(values):
        end = at
        while end < n and data[end] != 0:
            end += 1
        if end == n:
            break
        begin = at
        at = end + 1
        if end == begin:
            continue
        if end - begin > MOST_CODED:
            state[STRANGE] += end - begin
            continue
        size = _unstuff(data, begin, end, raw)
        if size < HEADER + CRC or size > MOST_FRAME:
            state[DAMAGED] += 1
            continue
        size -= CRC
        if np.int64(crc32(raw, size, crc_table)) != _number(raw, size, 4):
            state[DAMAGED] += 1
            continue
        form = raw[0]
        if form & 1:
            size -= MAC
        if size < HEADER:
            state[DAMAGED] += 1
            continue
        if keyed:
            if not form & 1:
                state[DAMAGED] += 1
                continue
            if np.int64(siphash(raw, size, key)) != _number(raw, size, 8):
                state[DAMAGED] += 1
                continue
        if form >> 4 != VERSION or form & 14:
            state[SKIPPED] += 1
            continue
        kind = np.int64(raw[1])
        message = messages[kind]
        if not message.known:
            state[SKIPPED] += 1
            continue
        place = HEADER
        rows = 1
        if message.repeated:
            rows = np.int64(raw[HEADER]) if size > HEADER else -1
            place += 1
        if rows < 0 or rows > MOST_ROWS or size != place + rows * message.size:
            state[DAMAGED] += 1
            continue
        frame = frames[n_frames]
        frame.type = kind
        frame.mac = form & 1
        frame.node = _number(raw, 2, 2)
        frame.boot = _number(raw, 4, 4)
        frame.sequence = _number(raw, 8, 4)
        frame.time = _number(raw, 12, 4)
        frame.first = n_rows
        frame.rows = rows
        n_frames += 1
        for _ in range(rows):
            for k in range(message.columns):
                column = columns[message.first + k]
                value = _number(raw, place, column.size)
                if column.signed:
                    shift = 64 - 8 * column.size
                    value = (value << shift) >> shift
                values[n_rows, k] = value / column.steps
                place += column.size
            n_rows += 1
    state[POSITION] = at
    state[FRAMES] = n_frames
    state[ROWS] = n_rows


@kernel
def encode_frames(frames, n_frames, values, key, crc_table, messages, columns, raw, out):
    """Encode frames, each between two zeros; return the number of bytes, or -1.

    Values out of range are clipped to the limits of their number.

    Args:
        frames: Frames, (frame); the caller has checked that types are known and rows fit.
        n_frames: Number of frames to encode.
        values: Values in SI units, (row, column); -1 is returned if one is not finite.
        key: Key of the MAC, two words, for frames that carry one.
        crc_table: CRC table; this and the next two as in `decode_frames`.
        messages: Messages by type.
        columns: Columns, (column).
        raw: Work array for one frame.
        out: Output bytes, with capacity for the longest frames.
    """
    at = 0
    for f in range(n_frames):
        frame = frames[f]
        message = messages[frame.type]
        raw[0] = VERSION << 4 | frame.mac
        raw[1] = frame.type
        _put(raw, 2, 2, np.int64(frame.node))
        _put(raw, 4, 4, np.int64(frame.boot))
        _put(raw, 8, 4, np.int64(frame.sequence))
        _put(raw, 12, 4, np.int64(frame.time))
        size = HEADER
        if message.repeated:
            raw[size] = frame.rows
            size += 1
        for r in range(frame.first, frame.first + frame.rows):
            for k in range(message.columns):
                column = columns[message.first + k]
                if not np.isfinite(values[r, k]):
                    return -1
                value = np.floor(values[r, k] * column.steps + 0.5)
                value = min(max(value, column.low), column.high)
                _put(raw, size, column.size, np.int64(value))
                size += column.size
        if frame.mac:
            _put(raw, size, MAC, np.int64(siphash(raw, size, key)))
            size += MAC
        _put(raw, size, CRC, np.int64(crc32(raw, size, crc_table)))
        out[at] = 0
        at = _stuff(raw, size + CRC, out, at + 1)
    return at
