"""Effects of the fault injector on frames, and validation of fault plans."""

import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware_bridge.emulator.fault_plan import Fault, FaultPlan, parse_faults, read_faults
from hardware_bridge.emulator.faults import FaultInjector, FaultParams
from hardware_bridge.errors import BridgeError

MS = 1_000_000
KEYS = st.sampled_from(["frames", "faults", "loss", "delay", "t", "kind", "target", "seconds", "x"])
FRAMES = [bytes([k % 251, k // 251]) * 8 for k in range(4000)]


def through(params, frames=FRAMES, every=10 * MS, seed=1):
    """Return the injector and arrivals with their times; frames are sent at a constant rate."""
    injector = FaultInjector(params, np.random.default_rng(seed))
    arrived, t = [], 0
    for k, frame in enumerate(frames):
        t = k * every
        injector.push(t, frame)
        arrived += [(t, each) for each in injector.due(t)]
    arrived += [(t, each) for each in injector.due(t + 10_000 * MS)]
    return injector, arrived


@given(st.lists(st.binary(min_size=1, max_size=40), max_size=30), st.integers(0, 99))
def test_without_faults_all_comes_whole_in_order_and_at_once(frames, seed):
    _, arrived = through(FaultParams(), frames, seed=seed)
    assert arrived == [(k * 10 * MS, frame) for k, frame in enumerate(frames)]


@pytest.mark.parametrize("rate", [0.05, 0.3])
def test_rates_are_those_asked_for(rate):
    band = 4.0 * np.sqrt(rate * (1.0 - rate) / len(FRAMES))
    for field, counter in {
        "loss": "lost", "corruption": "damaged", "truncation": "damaged",
        "duplication": "doubled", "reordering": "reordered",
    }.items():  # fmt: skip
        injector, arrived = through(FaultParams(**{field: rate}))
        share = getattr(injector, counter) / len(FRAMES)
        assert abs(share - rate) < band, field
        assert len(arrived) == len(FRAMES) - injector.lost + injector.doubled


def test_damaged_frames_differ():
    injector, arrived = through(FaultParams(corruption=1.0))
    assert injector.damaged == len(FRAMES)
    for frame, (_, came) in zip(FRAMES, arrived, strict=True):
        assert len(came) == len(frame)
        flipped = int.from_bytes(frame, "big") ^ int.from_bytes(came, "big")
        assert 1 <= flipped.bit_count() <= 3


def test_truncated_frames_are_beginnings():
    injector, arrived = through(FaultParams(truncation=1.0))
    assert injector.damaged == len(FRAMES)
    for frame, (_, came) in zip(FRAMES, arrived, strict=True):
        assert 1 <= len(came) < len(frame)
        assert frame.startswith(came)


def test_more_of_one_fault_changes_not_which_frames_others_befall():
    some, much = (
        {frame for _, frame in through(FaultParams(loss=0.2, duplication=d))[1]} for d in (0.0, 0.5)
    )
    assert some == much


def test_a_line_keeps_its_order_however_late_its_frames_are():
    params = FaultParams(delay=0.02, delay_spread=0.02)
    _, arrived = through(params)
    assert [frame for _, frame in arrived] == FRAMES
    sent = {frame: k * 10 * MS for k, frame in enumerate(FRAMES)}
    late = np.array([1e-9 * (t - sent[frame]) for t, frame in arrived])
    assert (late >= 0.0).all()
    assert 0.02 < late[:-10].mean() < 0.06


def test_reordered_frames_are_overtaken():
    _, arrived = through(FaultParams(reordering=0.1, reordering_by=0.025))
    order = [FRAMES.index(frame) for _, frame in arrived]
    assert sorted(order) == list(range(len(FRAMES)))
    overtaken = sum(later < before for before, later in zip(order, order[1:], strict=False))
    assert overtaken > 0.05 * len(FRAMES)
    moved = np.abs(np.array(order) - np.arange(len(order)))
    assert moved.max() <= 4


def test_a_plan_is_read():
    text = """
    [frames]
    loss = 0.02
    [[faults]]
    t = 12
    kind = "unplug"
    target = "nodes.1"
    seconds = 2.0
    [[faults]]
    t = 3.5
    kind = "clock-step"
    target = "nodes.2"
    seconds = -0.5
    """
    assert parse_faults(tomllib.loads(text)) == FaultPlan(
        frames=FaultParams(loss=0.02),
        faults=(
            Fault(t=12.0, kind="unplug", target="nodes.1", seconds=2.0),
            Fault(t=3.5, kind="clock-step", target="nodes.2", seconds=-0.5),
        ),
    )
    assert parse_faults({}) == FaultPlan()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("frames = 3", "frames"),
        ("[frames]\nloss = 1.5", "frames.loss: expected 0 to 1"),
        ("[frames]\nlos = 0.5", "frames.los: unknown"),
        ("[frames]\ndelay = nan", "frames.delay"),
        ("[[fault]]\nt = 1", "fault: unknown, expected one of frames, faults"),
        ("[faults]\nt = 1", "faults: expected a list"),
        ("[[faults]]\nkind = 'reboot'\ntarget = 'nodes.1'", "faults[0].t: missing"),
        ("[[faults]]\nt = 'x'\nkind = 'reboot'\ntarget = 'nodes.1'", "faults[0].t: expected a num"),
        ("[[faults]]\nt = -1\nkind = 'reboot'\ntarget = 'nodes.1'", "faults[0].t: expected 0"),
        ("[[faults]]\nt = 1\nkind = 'bang'\ntarget = 'nodes.1'", "faults[0].kind: expected one of"),
        (
            "[[faults]]\nt = 1\nkind = 'duplicate-id'\ntarget = 'cars.1'",
            "faults[0].target: duplicate-id is for",
        ),
        (
            "[[faults]]\nt = 1\nkind = 'duplicate-id'\ntarget = 'n1'",
            "faults[0].target: expected nodes.ID",
        ),
    ],
)  # fmt: skip
def test_errors_name_file_and_key(text, told, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(BridgeError) as error:
        read_faults(path)
    assert told in str(error.value)
    assert "bad.toml" in str(error.value)
    assert "\n" not in str(error.value)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9)
    | st.sampled_from(["unplug", "duplicate-id", "nodes.1", "cars.2", "links.n1"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=5),
    max_leaves=12,
)  # fmt: skip


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(KEYS, VALUES, max_size=3))
def test_whatever_a_file_says_it_is_a_plan_or_an_error_of_one_line(table):
    told = ""
    try:
        assert isinstance(parse_faults(table), FaultPlan)
    except BridgeError as error:
        told = str(error)
    assert "\n" not in told


def test_a_plan_must_be_a_file_that_is_there(tmp_path):
    with pytest.raises(BridgeError, match=r"none\.toml: expected a TOML file"):
        read_faults(tmp_path / "none.toml")


def test_a_plan_names_what_is_there():
    plan = FaultPlan(faults=(Fault(t=1.0, kind="reboot", target="nodes.7"),))
    with pytest.raises(BridgeError, match=r"faults\[0\]\.target: expected one of nodes\.1"):
        plan.check(["nodes.1"])
