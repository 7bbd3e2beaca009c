"""Layouts: equal digests mean equal fields; few cars are padded with absent ones."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.policies.layout import Layout
from agents.policies.padding import PaddedDriver, Padding
from relpos_env.config import configure
from relpos_env.core.env_core import EnvCore
from relpos_env.core.tracked_world import default_params
from relpos_env.errors import EnvError
from relpos_env.interface.observations import OBSERVATIONS, observation_mode, total_size
from relpos_env.interface.views import make_view
from relpos_env.scenarios import scenario

MODES = tuple(OBSERVATIONS)
OWN = ("heading", "oriented", "command", "speed", "steering", "present")


def three_cars(**changes):
    s = scenario("cars-nlos")
    return replace(s, randomisation=replace(s.randomisation, n_cars=(3, 3), **changes))


def environments(mode, slots, history=1, steps=25):
    """Return the same three cars in rooms with `slots` agent slots."""
    s = three_cars()
    params = default_params(s, max(slots))
    made = []
    for n in slots:
        arguments = {"scenario": s, "n_cars": n, "observation": mode, "history": history}
        formation = EnvCore(configure({**arguments, "params": params}))
        formation.seed(0, np.random.default_rng(5))
        formation.begin([0])
        made.append(formation)
    yield made
    rng = np.random.default_rng(1)
    for _ in range(steps):
        speed, steering = rng.uniform(0.0, 1.0, (1, 20)), rng.uniform(-0.4, 0.4, (1, 20))
        for formation, n in zip(made, slots, strict=True):
            formation.step(speed[:, :n], steering[:, :n])
        yield made


def telling(layout):
    """Return a mask that is False for meaningless numbers, such as ages of absent cars."""
    absent = np.ones(layout.one, dtype=bool)
    for row in layout.index:
        if layout.observation == "estimate_cov" and row["name"] == "age":
            absent[row["first"] + 2 : row["last"] + 1] = False
    return np.tile(absent, layout.history)


@pytest.mark.parametrize("history", [1, 3])
@pytest.mark.parametrize("mode", MODES)
def test_padded_is_what_an_environment_with_more_slots_sees(mode, history):
    required, given_ = Layout(mode, 6, history), Layout(mode, 3, history)
    pad, told = Padding(required, given_), telling(required)
    for few, many in environments(mode, (3, 6), history):
        padded = pad(few.observations)
        assert np.array_equal(padded[..., told], many.observations[:, :3][..., told])
        assert not many.observations[:, 3:].any()
    assert few.observations[0, 0].any()


@given(
    mode=st.sampled_from(MODES),
    few=st.integers(2, 8),
    more=st.integers(0, 6),
    history=st.integers(1, 3),
    seed=st.integers(0, 1000),
)
def test_padded_is_what_the_mode_writes_of_absent_cars(mode, few, more, history, seed):
    rng, many = np.random.default_rng(seed), few + more
    large, small = make_view(1, many), make_view(1, few)
    for name, there, here in zip(large._fields, large, small, strict=True):
        if name == "present":
            here[...] = rng.random(here.shape) < 0.8
        elif here.dtype == bool:
            here[...] = rng.random(here.shape) < 0.6
        elif name == "status":
            here[...] = rng.integers(0, 6, here.shape)
        else:
            here[...] = rng.uniform(0.0, 3.0, here.shape)
        axes = 0 if name == "now" else 1 if name in OWN else 2
        there[(slice(None), *(slice(0, few),) * axes)] = here
    frames = []
    for view, n in ((small, few), (large, many)):
        built = observation_mode(mode, n)
        out = np.zeros((1, n, total_size(built.fields)), np.float32)
        built.bind(view, out)()
        frames.append(np.tile(out, history))
    pad = Padding(Layout(mode, many, history), Layout(mode, few, history))
    assert np.array_equal(pad(frames[0]), frames[1][:, :few])


@pytest.mark.parametrize("mode", MODES)
def test_beams_end_the_observation_and_are_padded_as_they_are(mode):
    required, given_ = Layout(mode, 6, 2, 8), Layout(mode, 3, 2, 8)
    assert required.index[-1]["name"] == "near"
    assert required.one == Layout(mode, 6, 2).one + 8
    seen = np.random.default_rng(0).uniform(0.1, 1.0, given_.size).astype(np.float32)
    padded = Padding(required, given_)(seen).reshape(2, -1)
    assert np.array_equal(padded[:, -8:], seen.reshape(2, -1)[:, -8:])
    assert (required.alone().reshape(2, -1)[:, -8:] == 3.0).all()
    parts = configure({"observation": mode, "history": 2, "n_cars": 3, "proximity": 8})
    assert Layout.of(parts) == given_


def test_other_beams_are_another_layout():
    without, some, more = (Layout("estimate", 3, 1, n) for n in (0, 8, 16))
    assert len({without.digest, some.digest, more.digest}) == 3
    reason = some.refusal(more)
    assert reason is not None
    assert reason.endswith(
        "of 3 cars with 16 distance sensors: the numbers of distance sensors differ"
    )
    assert some.refusal(without).endswith("the numbers of distance sensors differ")
    with pytest.raises(EnvError, match="^proximity: expected a whole number from 0 to 32"):
        Layout("estimate", 3, 1, 33)


def test_the_index_map_counts_every_number_once():
    required, given_ = Layout("estimate_cov", 6, 4), Layout("estimate_cov", 3, 4)
    where = required.padding_from(given_)
    assert where.shape == (required.size,)
    assert sorted(where[where >= 0]) == list(range(given_.size))
    same = required.padding_from(required)
    assert np.array_equal(same, np.arange(required.size))


def test_digests_tell_layouts_apart_but_not_estimate_from_truth():
    layouts = [Layout(m, n, h) for m in MODES for n in (2, 3, 6) for h in (1, 2)]
    digests = {}
    for layout in layouts:
        digests.setdefault(layout.digest, set()).add(layout.observation)
    assert sorted(map(sorted, digests.values())) == sorted(
        [["estimate", "truth"], ["estimate_cov"], ["ranges"]] * 6
    )
    assert Layout("estimate", 3).digest == Layout("estimate", 3).digest


@pytest.mark.parametrize(
    ("given_", "reason"),
    [
        (Layout("estimate", 7), "more cars than the policy has slots for"),
        (Layout("estimate", 6, 2), "the history differs"),
        (Layout("ranges", 3), "the numbers differ"),
        (Layout("estimate_cov", 6), "the numbers differ"),
    ],
)
def test_what_does_not_fit_is_told(given_, reason):
    required = Layout("estimate", 6)
    told = required.refusal(given_)
    assert reason in told
    assert told.startswith("expected observation 'estimate' of 6 cars, got observation")
    with pytest.raises(ValueError, match=reason):
        required.padding_from(given_)


def test_estimate_and_truth_may_be_exchanged():
    assert Layout("estimate", 6).refusal(Layout("truth", 3)) is None
    assert Layout("truth", 6).refusal(Layout("estimate", 6)) is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("magic", 3, 1), "observation: expected one of"),
        (("estimate", 1, 1), "n_cars: expected"),
        (("estimate", True, 1), "n_cars: expected"),
        (("estimate", 3, 0), "history: expected"),
        (("estimate", 3, 65), "history: expected"),
    ],
)
def test_impossible_layouts_are_refused(arguments, message):
    with pytest.raises(EnvError, match=message):
        Layout(*arguments)


def test_a_layout_of_an_environment():
    parts = configure({"scenario": "cars-nlos", "observation": "ranges", "history": 2})
    layout = Layout.of(parts)
    assert layout == Layout("ranges", 3, 2)
    assert layout.size == EnvCore(parts).observations.shape[-1]


def test_differences_are_named_row_by_row():
    layout = Layout("estimate", 3)
    assert layout.differences(layout.index) == []
    other = [dict(row) for row in layout.index]
    other[1] = other[1] | {"unit": "ft"}
    assert layout.differences(other) == [
        "expected pos at 2 to 5 in m from -20 to 20, got pos at 2 to 5 in ft from -20 to 20"
    ]
    assert layout.differences([])[-1] == "5 more"


def test_a_padded_driver_names_a_wrong_size():
    class Still:
        def act(self, observations):
            return np.zeros((*observations.shape[:-1], 2), np.float32)

    driver = PaddedDriver(Still(), Layout("estimate", 6), Layout("estimate", 3))
    assert driver.act(np.zeros((4, 3, 22))).shape == (4, 3, 2)
    with pytest.raises(ValueError, match=r"expected \(\.\.\., 22\), got \(46,\)"):
        driver.act(np.zeros(46))
