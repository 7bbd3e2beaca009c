"""Damage of bytes in transmission, and its effect on decoders."""

from dataclasses import dataclass
from random import Random

from decoder_samples import SAMPLES, decoder_of

from hardware_bridge.decoders.base import MOST_WAITING
from hardware_bridge.readings import ImuReading, RangeReading, ScanReading


def flip_bit(rng, frame, other):
    at = rng.randrange(len(frame))
    return frame[:at] + bytes((frame[at] ^ 1 << rng.randrange(8),)) + frame[at + 1 :]


def lose_byte(rng, frame, other):
    at = rng.randrange(len(frame))
    return frame[:at] + frame[at + 1 :]


def burst(rng, frame, other):
    n = rng.randint(2, 8)
    at = rng.randrange(max(len(frame) - n, 0) + 1)
    return (frame[:at] + rng.randbytes(n) + frame[at + n :])[: len(frame)]


def splice(rng, frame, other):
    """Return the beginning of one frame and the end of another, as after a buffer overflow."""
    return frame[: rng.randrange(len(frame) + 1)] + other[rng.randrange(len(other) + 1) :]


DAMAGES = {"one bit": flip_bit, "byte lost": lose_byte, "burst 2-8": burst, "splice": splice}


@dataclass
class Fuzzed:
    chunks: int = 0
    n_bytes: int = 0
    readings: int = 0
    most_waiting: int = 0
    checks: int = 0
    """Number of checks for resynchronisation."""
    out_of_step: int = 0


def chunk_of(rng, sample):
    """Return a chunk as it may come out of a port."""
    kind = rng.randrange(6)
    frames = sample.all_frames
    if kind == 0:
        return rng.randbytes(rng.randrange(64))
    if kind == 1 and sample.tokens:
        return b"".join(rng.choice(sample.tokens) for _ in range(rng.randrange(1, 6)))
    if kind == 2:
        frame = rng.choice(frames)
        return frame[: rng.randrange(len(frame))]
    if kind == 3 and sample.tokens:
        frame = rng.choice(frames)
        at = rng.randrange(len(frame))
        return frame[:at] + rng.choice(sample.tokens) + frame[at:]
    damage = rng.choice(tuple(DAMAGES.values()))
    return damage(rng, rng.choice(frames), rng.choice(frames))


def fuzz(name, chunks, seed=0, check_every=4):
    """Feed one decoder with chunks, and check regularly that it reads a good frame.

    It may lose the first good frame, which may continue preceding garbage; the next must give the
    same readings as alone.
    """
    rng = Random(seed)
    sample = SAMPLES[name]
    decoder = decoder_of(name)
    alone = decoder_of(name).feed(sample.unit)
    assert alone
    done = Fuzzed()
    for k in range(chunks):
        chunk = chunk_of(rng, sample)
        done.readings += len(decoder.feed(chunk))
        done.n_bytes += len(chunk)
        done.most_waiting = max(done.most_waiting, decoder.waiting)
        if k % check_every == 0:
            decoder.feed(sample.unit)
            done.checks += 1
            if not set(alone) <= set(decoder.feed(sample.unit)):
                done.out_of_step += 1
    done.chunks = chunks
    assert done.most_waiting <= MOST_WAITING
    return done


def wrongly_accepted(name, kind, trials, seed=0):
    """Return the number of damaged frames with a reading that was not sent, and of those with a
    wrong distance, of a scanner or to a known device: the configuration refuses unknown ones."""
    rng = Random(seed)
    frames = [f for f in SAMPLES[name].all_frames if decoder_of(name).feed(f)]
    true = {f: decoder_of(name).feed(f) for f in frames}
    wrong = wrong_distance = 0
    for _ in range(trials):
        frame, other = rng.choice(frames), rng.choice(frames)
        damaged = DAMAGES[kind](rng, frame, other)
        if damaged in (frame, other):
            continue
        sent = true[frame] + true[other]
        # The loss of a magnetometer frame is not an error.
        sent += [r._replace(mag=None) for r in sent if isinstance(r, ImuReading)]
        strange = [r for r in decoder_of(name).feed(damaged) if r not in sent]
        wrong += bool(strange)
        told = {(r.to, r.distance) for r in sent if isinstance(r, RangeReading)}
        known = {to for to, _ in told}
        ranges = [r for r in strange if isinstance(r, RangeReading)]
        far = {r.distance for r in sent if isinstance(r, ScanReading)}
        wrong_distance += any(
            r.to in known and (r.to, r.distance) not in told for r in ranges
        ) or any(r.distance not in far for r in strange if isinstance(r, ScanReading))
    return wrong, wrong_distance
