"""Scenario files: every field can be set, and every fault is named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relpos_env.errors import EnvError
from relpos_env.scenarios import (
    LEVELS,
    SCENARIOS,
    Gap,
    Obstacle,
    Randomisation,
    Scenario,
    draw_episode,
    load_scenario,
    scenario,
)
from relpos_env.scenarios.cars import CARS_NLOS
from relpos_env.scenarios.catalogue import FILES, scenario_from
from relpos_env.sensors.radio.channel import INDOOR
from relpos_env.world.car_nodes import car_constellation
from tracking.mount import Mount
from tracking.params.tables import readable
from tracking.ranging.frames.airtime import FAST_PHY


def save(tmp_path, text, name="my.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


ROOM = "room = [6.0, 5.0]\nring = [1.5, 1.5]\n"


def test_a_file_sets_everything(tmp_path):
    text = """
    extends = "cars-nlos"
    n_cars = 4
    layout = "scattered"
    [car]
    mass = 3
    [radio]
    antenna_delay_std = 0.1
    [radio.channel]
    place = "indoor"
    loss = 0.02
    [radio.session.phy]
    setting = "6M8"
    [randomisation]
    level = 4
    n_cars = [3, 5]
    [[obstacles]]
    x = 1.0
    y = 0.0
    width = 0.3
    height = 0.3
    movable = true
    """
    s = scenario(str(save(tmp_path, text)))
    assert (s.name, s.n_cars, s.car.mass, s.radio.antenna_delay_std) == ("my", 4, 3.0, 0.1)
    assert s.radio.channel == replace(INDOOR, loss=0.02)
    assert s.radio.session.phy == FAST_PHY
    assert s.randomisation == replace(LEVELS[4], n_cars=(3, 5))
    assert s.obstacles == (Obstacle(x=1.0, y=0.0, width=0.3, height=0.3, movable=True),)
    assert (s.room, s.ring, s.imu) == (CARS_NLOS.room, CARS_NLOS.ring, CARS_NLOS.imu)


def test_files_extend_files_and_move_the_wall_along(tmp_path):
    save(tmp_path, 'extends = "gap"\nroom = [9.0, 7.0]\n', "a.toml")
    b = load_scenario(save(tmp_path, 'extends = "a.toml"\n[gap]\nwidth = 1.0\n', "b.toml"))
    assert (b.name, b.room, b.gap) == ("b", (9.0, 7.0), Gap(width=1.0))
    assert b.obstacles == Gap(width=1.0).wall((9.0, 7.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            ROOM + "[[obstacles]]\n[[obstacles]]\n[[obstacles]]\nwidht = 1.0",
            "obstacles[0].x: missing",
        ),
        (
            ROOM + "[[obstacles]]\nx = 1\ny = 0\nwidht = 1.0",
            "obstacles[0].widht: unknown, expected one of x, y, width, height, angle, movable",
        ),
        (ROOM + "colour = 1", "colour: unknown, expected one of extends, name, room, obstacles"),
        (ROOM + "in_line = true", "in_line: unknown"),
        ("ring = [1.0, 1.0]", "room: missing"),
        (ROOM + "n_cars = true", "n_cars: expected a whole number, got true"),
        (ROOM + "n_cars = 3.0", "n_cars: expected a whole number, got 3.0"),
        (ROOM + "n_cars = 1", "n_cars: expected at least 2, got 1"),
        (ROOM + "[car]\nmass = nan", "car.mass: expected a finite number, got nan"),
        (ROOM + '[car]\nmass = "3"', "car.mass: expected a number, got '3'"),
        (ROOM + "[car]\nmass = 300", "car.mass: expected 0.1 to 100, got 300.0"),
        (ROOM + "car = 3", "car: expected a table, got 3"),
        (ROOM + "obstacles = 3", "obstacles: expected a list, got 3"),
        (ROOM + "obstacles = [3]", "obstacles[0]: expected a table, got 3"),
        ("room = [3.0]\nring = [1.0, 1.0]", "room: expected 2 values, got 1"),
        (ROOM + 'layout = "row"', "layout: expected one of 'ring', 'line', 'scattered', got 'row'"),
        (ROOM + '[radio.channel]\nplace = "moon"', "radio.channel.place: expected one of cal"),
        (ROOM + "[radio.channel]\nloss = 2", "radio.channel.loss: expected 0 to 1, got 2"),
        (ROOM + "[radio.session]\npan = -1", "radio.session.pan: expected 0 to 65535"),
        (
            ROOM + "[randomisation]\nlevel = 9",
            "randomisation.level: expected 0 to 4 or one of easy, medium, hard, expert, got 9",
        ),
        (ROOM + "[randomisation]\nmass = [2, 1]", "randomisation.mass: expected 0.01 <= low"),
        (ROOM + "[gap]\nwidth = 9.0", "gap.width: expected less than 4.98 m"),
        (ROOM + "[gap]\nwidth = 0.001", "gap.width: expected 0.05 to 100 m"),
        ('extends = "human"', "extends: expected one of cars-los"),
        ('extends = "my.toml"', "my.toml: extends: "),
        ('extends = "none.toml"', "extends: scenario: cannot read"),
        ('extends = "../my.toml"', "extends: expected a file in the folder of the scenario, got"),
        ('extends = "/etc/my.toml"', "extends: expected a file in the folder of the scenario"),
        ('extends = "a\\u0000.toml"', "extends: expected a file in the folder of the scenario"),
        (ROOM + 'floor_plan = "../a.csv"', "floor_plan: expected a file in the folder of the"),
        (ROOM + 'floor_plan = "sub/../../a"', "floor_plan: expected a file in the folder of"),
        (ROOM + 'floor_plan = "a\\u0000"', "floor_plan: expected a file in the folder of the"),
        (ROOM + 'floor_plan = "."', "floor_plan: expected a file in the folder of the scenario"),
        ("room = [", "expected TOML"),
        ("n_cars = 1979-05-27", "n_cars: expected a whole number, got 1979-05-27"),
    ],
)
def test_mistakes_in_files_are_named(tmp_path, text, message):
    with pytest.raises(EnvError) as caught:
        load_scenario(save(tmp_path, text))
    assert str(caught.value).startswith("my.toml: ")
    assert message in str(caught.value)


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(EnvError, match=r"scenario: cannot read .*none.toml"):
        scenario(str(tmp_path / "none.toml"))
    (tmp_path / "bytes.toml").write_bytes(b"\xff\x00")
    with pytest.raises(EnvError, match=r"bytes.toml: expected TOML"):
        scenario(str(tmp_path / "bytes.toml"))


VALID = {
    "extends": "gap",
    "room": [8.0, 6.0],
    "n_cars": 4,
    "n_cars_range": [2, 6],
    "layout": "scattered",
    "start_area": [-4.0, -3.0, -1.0, 3.0],
    "gap": {"width": 0.9, "y": 0.5, "direction": 0.0},
    "obstacles": [{"x": 2.0, "y": 2.0, "width": 0.5, "height": 0.5, "movable": True}],
    "car": {"mass": 3.0, "length": 0.5},
    "mag": {"field_w": [0.0, 20.0, -43.0], "n_waves": 4},
    "radio": {
        "channel": {"place": "hall", "excess": [-1.0, 1.0, 0.5], "gap_shares": [0.1, 0.1]},
        "session": {"listen": [0.04, 0.06], "phy": {"setting": "6M8"}},
    },
    "randomisation": {"level": 3, "n_cars": [3, 5], "friction": [0.5, 1.0], "movable_share": 0.5},
}
NUMBERS = st.one_of(
    st.floats(), st.integers(), st.sampled_from([0, -1, 1e-9, 1e9, 10**400, float("nan")])
)
ANYTHING = st.recursive(
    st.one_of(NUMBERS, st.booleans(), st.text(max_size=5), st.sampled_from(["gap", "indoor"])),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)


def places(value, path=()):
    """Yield the paths of all values in a table."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for key, entry in inner:
        yield (*path, key)
        if isinstance(entry, (dict, list)):
            yield from places(entry, (*path, key))


def mutated(value, path, change):
    """Return a copy with the value at a path replaced, removed or renamed."""
    if len(path) > 1:
        inner = mutated(value[path[0]], path[1:], change)
        if isinstance(value, dict):
            return {**value, path[0]: inner}
        return [inner if k == path[0] else v for k, v in enumerate(value)]
    what, new = change
    if isinstance(value, list):
        return [v for k, v in enumerate(value) if k != path[0]] + ([new] if what == "set" else [])
    rest = {k: v for k, v in value.items() if k != path[0]}
    if what == "set":
        return {**rest, path[0]: new}
    return rest if what == "drop" else {**rest, new: value[path[0]]}


def outcome(load):
    """Return the message of an `EnvError` and the result, one of them None."""
    try:
        return None, load()
    except EnvError as error:
        return str(error), None


changes = st.one_of(
    st.tuples(st.just("set"), NUMBERS | ANYTHING),
    st.tuples(st.just("drop"), st.none()),
    st.tuples(st.just("rename"), st.text(max_size=6) | st.sampled_from(["x", "name", "room"])),
)


@given(st.lists(st.tuples(st.sampled_from(list(places(VALID))), changes), min_size=1, max_size=2))
@settings(max_examples=500)
def test_any_change_of_a_file_loads_or_names_a_key(edits):
    table = VALID
    for path, change in edits:
        try:
            table = mutated(table, path, change)
        except (KeyError, IndexError, TypeError, AttributeError):
            continue  # an earlier edit removed the place
    message, loaded = outcome(lambda: scenario_from(table, file="my.toml", name="my"))
    if loaded is None:
        assert message.startswith("my.toml: ")
        assert len(message.split(": ")) >= 3
    else:
        assert draw_episode(loaded, 20, 30.0, np.random.default_rng(0)).present.sum() >= 2


@given(st.integers(0, 10_000), st.text(max_size=3))
@settings(max_examples=100)
def test_any_change_of_a_files_text_loads_or_is_named(tmp_path_factory, at, text):
    source = (FILES / "warehouse.toml").read_text()
    at %= len(source)
    path = tmp_path_factory.mktemp("files") / "my.toml"
    path.write_text(source[:at] + text + source[at + 1 :], encoding="utf-8", errors="replace")
    message, loaded = outcome(lambda: load_scenario(path))
    assert loaded is not None or message.startswith("my.toml: ")


def test_the_manual_has_every_key():
    text = (Path(__file__).parents[2] / "docs" / "reference" / "scenarios.md").read_text()
    kinds = (Scenario, Randomisation, Gap, Obstacle)
    missing = {name for kind in kinds for name in readable(kind) if f"`{name}`" not in text}
    assert not missing
    assert {name for name in SCENARIOS if f"`{name}`" not in text} == set()


def test_the_example_of_the_manual_loads(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "reference" / "scenarios.md").read_text()
    example = text.split("```toml\n", 1)[1].split("```", 1)[0]
    s = load_scenario(save(tmp_path, example))
    assert draw_episode(s, 8, 60.0, np.random.default_rng(0)).present.sum() >= 2


def test_mounts_of_a_file_hold_in_the_world_and_in_the_tracker(tmp_path):
    text = """
    extends = "cars-los"
    [randomisation]
    mount_ahead = [-0.1, 0.1]
    mount_aside = [-0.05, 0.05]
    [[mounts]]
    ahead = 0.3
    aside = 0.02
    height = 0.1
    [[mounts]]
    aside = -0.01
    """
    mounted = load_scenario(save(tmp_path, text))
    axle = mounted.car.rear_axle
    draws = [
        draw_episode(mounted, 3, 20.0, np.random.default_rng(seed)).mounts for seed in range(20)
    ]
    for drawn in draws:
        np.testing.assert_allclose(drawn[0], [0.3 - axle, 0.02, 0.1])
        np.testing.assert_allclose(drawn[1, 1:], [-0.01, 0.0])
    assert np.ptp([drawn[1, 0] for drawn in draws]) > 0.05
    told = [node.mount for node in car_constellation(mounted, 3).nodes]
    assert told == [Mount(ahead=0.3, aside=0.02, height=0.1), Mount(aside=-0.01), Mount()]


@pytest.mark.parametrize(
    ("table", "message"),
    [("ahead = 11.0", r"mounts\[0\].ahead: expected -10 to 10"), ("side = 1.0", "side"),
     ('ahead = "far"', "ahead")],
)  # fmt: skip
def test_a_wrong_mount_is_named(tmp_path, table, message):
    with pytest.raises(EnvError, match=message):
        load_scenario(save(tmp_path, f'extends = "cars-los"\n[[mounts]]\n{table}\n'))
