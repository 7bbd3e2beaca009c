"""Cards: any text is a card, or is refused with the position of the fault."""

import copy
import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.policies import Card, Layout, PolicyError
from agents.policies.strict_json import Reader, parse_json

SHA = "0" * 64
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=6),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=8,
)
OBJECTS = st.dictionaries(st.text(max_size=6), VALUES, max_size=4)


def card(**changes):
    return Card(**{"name": "a", "layout": Layout("estimate", 3), "onnx_sha256": SHA,
                   "training": {}} | changes)  # fmt: skip


RECORD = json.loads(card(results=({"x": 1.0},)).to_json())


def places(value, path=()):
    """Yield the path of every value in a record."""
    yield path
    if isinstance(value, list):
        value = dict(enumerate(value))
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from places(inner, (*path, key))


PLACES = [path for path in places(RECORD) if path]
NEEDED = [p for p in PLACES if isinstance(p[-1], str) and p[:2] != ("results", 0)]
NEEDED.remove(("layout", "proximity"))  # older cards do not have it


def changed(path, change):
    record = copy.deepcopy(RECORD)
    inner = record
    for key in path[:-1]:
        inner = inner[key]
    change(inner, path[-1])
    return record


@given(
    mode=st.sampled_from(["estimate", "estimate_cov", "ranges", "truth"]),
    n_cars=st.integers(2, 20),
    history=st.integers(1, 64),
    training=OBJECTS,
    results=st.lists(OBJECTS, max_size=3),
)
def test_what_is_written_is_read(mode, n_cars, history, training, results):
    before = card(
        layout=Layout(mode, n_cars, history),
        training=training,
        results=tuple(results),
        decision=0.2,
    )
    after = Card.from_json(before.to_json())
    assert after == before
    assert after.to_json() == before.to_json()


@given(text=st.text() | st.binary() | VALUES.map(json.dumps))
def test_any_text_is_refused_with_a_reason(text):
    with pytest.raises(PolicyError, match="^somewhere.json: ."):
        Card.from_json(text, "somewhere.json")


@given(path=st.sampled_from(PLACES), value=VALUES)
def test_any_other_value_gives_a_card_or_a_reason(path, value):
    def replace(inner, key):
        inner[key] = value

    text = json.dumps(changed(path, replace))
    with suppress(PolicyError):
        found = Card.from_json(text)
        assert Card.from_json(found.to_json()) == found


@pytest.mark.parametrize("path", NEEDED, ids=str)
def test_a_missing_value_is_named(path):
    record = changed(path, lambda inner, key: inner.pop(key))
    with pytest.raises(PolicyError, match=f"{path[-1]}: is missing") as caught:
        Card.from_json(json.dumps(record))
    assert caught.value.where == "card"


def test_a_card_that_says_nothing_of_beams_has_none():
    older = changed(("layout", "proximity"), lambda inner, key: inner.pop(key))
    assert Card.from_json(json.dumps(older)).layout.proximity == 0


def test_a_card_has_beams():
    found = Card.from_json(card(layout=Layout("estimate", 3, 2, 8)).to_json())
    assert found.layout == Layout("estimate", 3, 2, 8)
    assert found.layout.index[-1]["name"] == "near"


@pytest.mark.parametrize("path", [(), ("layout",), ("actions",), ("layout", "index", 3)], ids=str)
def test_an_unknown_key_is_named(path):
    record = changed((*path, "wheels"), lambda inner, key: inner.update({key: 4}))
    with pytest.raises(PolicyError, match="'wheels': unknown, expected "):
        Card.from_json(json.dumps(record))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("format",), 2, "format: expected 1, got 2: of another version"),
        (("format",), True, "format: expected a whole number, got true"),
        (("name",), "../evil", "name: expected a name of letters"),
        (("name",), "", "name: expected a name"),
        (("name",), 5, "name: expected a string, got 5"),
        (("layout",), [], "layout: expected an object, got a list"),
        (("layout", "observation"), "magic", "layout: observation: expected one of"),
        (("layout", "n_cars"), 1, "layout: n_cars: expected a whole number from 2 to 20"),
        (("layout", "history"), 1.5, "layout.history: expected a whole number, got 1.5"),
        (("layout", "n_cars"), 4, "another observation layout: expected mask at 0 to 2"),
        (("layout", "observation"), "ranges", "another observation layout: expected range at"),
        (("layout", "history"), 2, "layout.digest: another observation layout"),
        (("layout", "digest"), "ab" * 32, "layout.digest: another observation layout"),
        (("layout", "digest"), "xyz", "layout.digest: expected 64 hexadecimal digits"),
        (("layout", "index", 1, "unit"), "ft", "got pos at 2 to 5 in ft"),
        (("layout", "index", 1, "low"), "x", r"layout.index\[1\].low: expected a number"),
        (("layout", "index", 0), 7, r"layout.index\[0\]: expected an object, got 7"),
        (("actions", "kind"), "discrete", "actions.kind: expected 'continuous', got 'discrete'"),
        (("actions", "max_speed_m_s"), -1, "actions.max_speed_m_s: expected a number above 0"),
        (("decision_s",), 10**400, "decision_s: expected a number, got one that is too large"),
        (("onnx_sha256",), "A" * 64, "onnx_sha256: expected 64 hexadecimal digits"),
        (("training",), None, "training: expected an object, got null"),
        (("results",), {}, "results: expected a list, got an object"),
        (("results", 0), "fine", r"results\[0\]: expected an object, got 'fine'"),
    ],
    ids=str,
)  # fmt: skip
def test_a_wrong_value_is_named(path, value, message):
    def put(inner, key):
        inner[key] = value

    with pytest.raises(PolicyError, match=message):
        Card.from_json(json.dumps(changed(path, put)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no JSON"),
        ("[1, 2]", "expected an object, got a list"),
        ('{"format": 1, "format": 1}', "a duplicate key"),
        ('{"format": NaN}', "nan is not finite|NaN is not finite"),
        ('{"format": 1e999}', "1e999 is not finite"),
        ("[" * 100_000, "is no JSON"),
        ('{"a":' * 100_000, "is no JSON"),
        ("9" * 5000, "is no JSON"),
        (b"\xff\xfe", "is no JSON"),
        (b"\x80\x04\x95", "is no JSON"),
        ('{"format": 7, "more": 1}', "format: expected 1, got 7: of another version"),
    ],
    ids=lambda v: str(v)[:20],
)
def test_what_is_no_card_is_refused(text, message):
    with pytest.raises(PolicyError, match=message):
        Card.from_json(text)


@pytest.mark.parametrize(
    "changes",
    [
        {"training": {"x": float("nan")}},
        {"training": {"x": print}},
        {"training": {1: 2}, "name": "a b"},
        {"onnx_sha256": ""},
        {"decision": 0.0},
        {"actions": "discrete"},
    ],
    ids=str,
)
def test_what_could_not_be_read_is_not_written(changes):
    with pytest.raises(PolicyError):
        card(**changes).to_json()


def test_messages_print_on_one_line():
    error = PolicyError("evil\n\x1b[2J\ud800.onnx", "no")
    assert str(error).isprintable()
    with pytest.raises(PolicyError) as caught:
        Reader(parse_json('{"\\u001b[2J": 1}', "f"), "f").keys(("a",))
    assert str(caught.value).isprintable()
