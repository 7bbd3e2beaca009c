"""Serialisation of snapshots and messages."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_bridge.safety.messages import (
    Decision,
    Notice,
    Order,
    Ready,
    Report,
    Telemetry,
    Word,
    pack,
    unpack,
)
from hardware_bridge.safety.picture import Picture, blank_picture

N = 3


def drawn_picture(seed):
    rng = np.random.default_rng(seed)
    return Picture(*(rng.normal(size=each.shape) for each in blank_picture(1, N)))


def row(seed):
    return np.random.default_rng(seed).normal(size=N)


MESSAGES = [
    Word(1.5, np.array([1.0, -np.inf, np.nan])),
    Decision(drawn_picture(0)),
    Order("arm"),
    Telemetry(2, 123456789012345, b"\x00\x01"),
    Telemetry(255, -1, b""),
    Report(2.5, *(row(k) for k in range(7)), True, 0.002, 3, 0.015),
    Notice("car 1: gone – für immer"),
    Ready(),
    Ready("no port"),
]


def same(one, other):
    if isinstance(one, Picture):
        return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)
    return one == other


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: type(m).__name__)
def test_messages_come_back(message):
    back = unpack(pack(message), N)
    assert type(back) is type(message)
    for name in message.__dataclass_fields__:
        assert same(getattr(message, name), getattr(back, name)), name


def test_pictures_come_back():
    q = drawn_picture(1)
    q.pos[0, 0, 1], q.t[0] = np.nan, -np.inf
    back = Picture.from_bytes(q.to_bytes(), N)
    assert same(q, back)
    assert [a.shape for a in back] == [a.shape for a in q]


@pytest.mark.parametrize("n_cars", [1, 2, 4])
def test_pictures_of_another_number_of_cars_are_refused(n_cars):
    with pytest.raises(ValueError, match="expected"):
        Picture.from_bytes(drawn_picture(1).to_bytes(), n_cars)


@given(st.binary(max_size=300))
def test_other_bytes_are_refused_or_understood(data):
    """Only ValueError is raised, and an accepted message is encoded with the same type."""
    try:
        message = unpack(data, N)
    except ValueError:
        return
    assert pack(message)[:1] == data[:1]


@given(st.sampled_from(MESSAGES), st.integers(0, 400))
def test_cut_messages_of_fixed_length_are_refused(message, length):
    data = pack(message)
    if length >= len(data) or data[:1] in b"NYOT":
        return
    with pytest.raises(ValueError, match="expected|unknown"):
        unpack(data[:length], N)
