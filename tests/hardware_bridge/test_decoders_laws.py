"""Invariants of every registered decoder, for any bytes."""

import tracemalloc
from dataclasses import asdict
from random import Random

import pytest
from decoder_damage import DAMAGES, fuzz
from decoder_samples import SAMPLES, decoder_of
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware_bridge.decoders import DECODERS, make_decoder
from hardware_bridge.decoders.base import MOST_WAITING
from hardware_bridge.errors import BridgeError

FORMATS = pytest.mark.parametrize("name", list(DECODERS))
CHUNKS = 20_000


def cut(data, places):
    places = [0, *sorted(p % (len(data) + 1) for p in places), len(data)]
    return [data[a:b] for a, b in zip(places, places[1:], strict=False)]


def pieces(name):
    """Return frames, garbage and tokens of the format in any order."""
    sample = SAMPLES[name]
    parts = st.sampled_from([*sample.all_frames, *sample.tokens])
    return st.lists(parts | st.binary(max_size=20), max_size=12).map(b"".join)


def test_every_format_has_a_sample():
    assert set(SAMPLES) >= set(DECODERS)


@FORMATS
@settings(max_examples=60)
@given(data=st.data())
def test_any_cut_gives_the_same(name, data):
    stream = data.draw(pieces(name))
    whole, cut_up, bytewise = decoder_of(name), decoder_of(name), decoder_of(name)
    readings = whole.feed(stream)
    parts = cut(stream, data.draw(st.lists(st.integers(0, 4000), max_size=8)))
    assert [r for part in parts for r in cut_up.feed(part)] == readings
    assert [r for byte in stream for r in bytewise.feed(bytes((byte,)))] == readings
    assert asdict(whole.counts) == asdict(cut_up.counts) == asdict(bytewise.counts)
    assert whole.waiting == cut_up.waiting == bytewise.waiting
    assert whole.counts.n_bytes == len(stream)


@FORMATS
def test_damage_and_garbage_cost_at_most_one_frame(name):
    done = fuzz(name, CHUNKS)
    assert done.out_of_step == 0
    assert done.readings > 0
    assert done.checks > 0


@FORMATS
@settings(max_examples=60)
@given(data=st.data())
def test_garbage_that_ends_costs_nothing(name, data):
    """The garbage is between complete frames, and not itself the beginning of one."""
    noise = bytes(data.draw(st.lists(st.integers(0x80, 0xFF), max_size=300)))
    unit = SAMPLES[name].unit
    decoder = decoder_of(name)
    first = decoder.feed(unit)
    frames = decoder.counts.frames
    decoder.feed(noise + SAMPLES[name].end)
    assert decoder.feed(unit) == first
    assert decoder.counts.frames == 2 * frames
    assert decoder.counts.damaged + decoder.counts.strange >= bool(noise)


@FORMATS
def test_holds_no_memory(name):
    sample = SAMPLES[name]
    decoder = decoder_of(name)
    floods = [b"\x55" * 997, b"\x55\x00\xff\x03" * 256, b"[" * 3000, b"{" * 10, bytes(5000)]
    floods += [token * 100 for token in sample.tokens]
    for flood in floods:
        decoder.feed(flood)
    tracemalloc.start()
    try:
        for _ in range(3):
            for flood in floods:
                decoder.feed(flood)
                assert decoder.waiting <= MOST_WAITING
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held < 256 * 1024


@FORMATS
def test_frames_without_damage_are_not_counted_as_damaged(name):
    decoder = decoder_of(name)
    for _ in range(5):
        decoder.feed(SAMPLES[name].unit)
    assert (decoder.counts.damaged, decoder.counts.strange, decoder.waiting) == (0, 0, 0)


@FORMATS
@pytest.mark.parametrize("kind", list(DAMAGES))
def test_what_is_refused_is_counted(name, kind):
    """Every frame without a reading is counted or still kept."""
    rng = Random(5)
    unit = SAMPLES[name].unit
    n_silent = 0
    for _ in range(300):
        decoder = decoder_of(name)
        damaged = DAMAGES[kind](rng, unit, unit)
        if damaged.strip() and not decoder.feed(damaged + SAMPLES[name].end):
            n_silent += 1
            counts = decoder.counts
            assert counts.damaged + counts.strange + counts.skipped + decoder.waiting > 0
    assert n_silent > 0


@FORMATS
def test_what_the_registry_says_is_so(name):
    entry = DECODERS[name]
    sample = SAMPLES[name]
    decoder = decoder_of(name)
    readings = [r for f in sample.all_frames for r in decoder.feed(f)]
    assert {type(r) for r in readings} <= set(entry.tells)
    if not entry.has_time:
        assert all(r.source.ticks is None for r in readings)
    else:
        assert all(r.source.ticks is not None and r.source.clock is not None for r in readings)
    assert all((r.source.device is not None) == entry.names_itself for r in readings)


def test_unknown_format_is_named():
    with pytest.raises(
        BridgeError, match="format 'uwb' is not known; choose one of relpos, linktrack,"
    ):
        make_decoder("uwb")


@FORMATS
def test_a_key_is_only_for_formats_that_have_one(name):
    if DECODERS[name].keyed:
        return
    with pytest.raises(BridgeError, match=f"format '{name}' has no key"):
        make_decoder(name, bytes(16))
