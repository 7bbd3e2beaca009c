"""The alignment of a group goes from state to state as its table says, whatever is measured."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.exact_motion import ExactGroup
from tracking import Tracker
from tracking.filters.joint.hypotheses.alignment import TRANSITIONS, Alignment
from tracking.measurements import Kind

ALLOWED = {(a, b) for a, following in TRANSITIONS.items() for b in following}
WITHIN_ONE_EVENT = {
    # A node moves and the group is supervised; a Gaussian sum ends and is pruned; its only
    # hypothesis fits badly.
    (Alignment.STATIC, Alignment.MODES),
    (Alignment.MODES, Alignment.FILTERED),
    (Alignment.MODES, Alignment.CHALLENGED),
}
"""Steps of the table that one event can make in a row."""


def test_every_state_follows_the_first_one_and_ends():
    assert set(TRANSITIONS) == set(Alignment)
    found, new = {Alignment.NONE}, [Alignment.NONE]
    while new:
        new = [b for a in new for b in TRANSITIONS[a] if b not in found]
        found.update(new)
    assert found == set(Alignment)
    for state in set(Alignment) - {Alignment.NONE}:
        assert Alignment.NONE in TRANSITIONS[state]


def walk(group, silences=(), reflected=None):
    """Alignment and number of hypotheses after every event."""
    block, tracker = group.block, Tracker(group.constellation)
    t, kind = block.t[0], block.kind[0]
    kept = np.ones(len(t), dtype=bool)
    for begin, seconds in silences:
        kept &= (t < begin) | (t > begin + seconds)
    if reflected is not None:
        # Accelerations point elsewhere from here on: the group fits no more as it is aligned.
        later = (t > reflected) & (kind == Kind.STATE)
        block.values[0, later, 4:6] *= -1.0
    states = []
    for k in np.flatnonzero(kept):
        tracker.step(block.take(slice(int(k), int(k) + 1)), t[k])
        record = tracker.save()["filter"].group[0, 0]
        states.append((Alignment(record["alignment"]), int(record["n_alive"])))
    return states


@pytest.mark.parametrize(
    ("vehicle", "dimensions", "n"),
    [("car", 2, 3), ("human", 2, 4), ("hand", 3, 3), ("drone", 3, 4), ("hand", 3, 5)],
)
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_only_transitions_of_the_table_occur(vehicle, dimensions, n, data):
    silence = st.tuples(st.floats(0.5, 5.0), st.floats(0.5, 7.0))
    group = ExactGroup(
        vehicle,
        data.draw(st.permutations(range(n))),
        at_rest=data.draw(st.booleans()),
        dimensions=dimensions,
        seconds=9.0,
        hz=28.0,
    )
    silences = data.draw(st.lists(silence, max_size=2))
    states = walk(group, silences, data.draw(st.none() | st.floats(3.0, 6.0)))
    for (before, _), (after, n_alive) in zip(states, states[1:], strict=False):
        assert before == after or (before, after) in ALLOWED | WITHIN_ONE_EVENT
        assert (n_alive == 0) == (after == Alignment.NONE)


def test_a_group_in_space_that_moves_is_filtered_in_its_modes():
    states = [a for a, _ in walk(ExactGroup("hand", range(5), at_rest=True, dimensions=3))]
    order = list(dict.fromkeys(states))
    assert order[:3] == [Alignment.NONE, Alignment.STATIC, Alignment.LINEAR]
    assert order[3] == Alignment.MODES


@pytest.mark.parametrize("vehicle", ["robot", "human"])
def test_rotations_of_a_small_group_at_rest_are_not_split(vehicle, monkeypatch):
    """Rest does not tell rotations apart, however uncertain errors of ranges leave them."""
    monkeypatch.setattr("tests.exact_motion.STAND", 30.0)
    group = ExactGroup(vehicle, range(4), at_rest=True, hz=10.0, seconds=29.0)
    group.block.values[0, group.block.kind[0] == Kind.RANGE, 0] *= 0.06
    assert set(walk(group)) <= {(Alignment.NONE, 0), (Alignment.STATIC, 1)}
