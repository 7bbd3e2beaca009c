"""Tables of observations, actions, rewards, arguments, scenarios and training."""

from __future__ import annotations

from dataclasses import fields

from agents.settings import leaves
from agents.training.config import TrainConfig
from relpos_env import config
from relpos_env.interface.actions import ACTIONS, MAX_SPEED, MAX_STEERING, DiscreteActions
from relpos_env.interface.observations import (
    OBSERVATIONS,
    index_table,
    observation_mode,
    total_size,
)
from relpos_env.scenarios import LEVELS, SCENARIOS, Scenario
from relpos_env.sensors.radio.channel import CHANNELS
from relpos_env.tasks import DEFAULT_WEIGHTS, TASKS
from relpos_env.tasks.needs import DEFAULT_SCENARIO
from tables.markdown import default_of, docstrings, markdown

CARS = 3
"""[-] Cars of the observations whose indices are shown."""


def sizes() -> str:
    """Return the table of the observation sizes of all modes."""
    rows = []
    for name in OBSERVATIONS:
        two, three = observation_mode(name, 2), observation_mode(name, CARS)
        n = total_size(three.fields)
        size = in_others(total_size(two.fields), n)
        rows.append([f"`{name}`", size, str(n), "the truth" if two.needs_truth else "the tracker"])
    rows[[r[0] for r in rows].index("`ranges`")][3] = "the radio; the heading is the tracker's"
    return markdown(("mode", "size", "three cars", "from"), rows, right="three cars")


def observations(mode: str) -> str:
    """Return the layout of one observation mode for three cars, with sizes for n cars."""
    small = observation_mode(mode, 2).fields
    large = observation_mode(mode, CARS).fields
    rows = []
    for few, many, row in zip(small, large, index_table(large), strict=True):
        last = f" to {row['last']}" if row["last"] > row["first"] else ""
        size = in_others(few.size, many.size)
        limits = f"{row['low']:g} to {row['high']:g}"
        name = f"`{row['name']}`"
        rows.append([f"{row['first']}{last}", name, size, row["unit"], limits, row["meaning"]])
    return markdown(("index", "field", "size", "unit", "limits", "meaning"), rows)


def in_others(at_two: int, at_three: int) -> str:
    """Return a size linear in the number of cars n as text, from those for two and three cars."""
    slope = at_three - at_two
    rest = at_two - slope
    if slope == 0:
        return str(rest)
    share = "n - 1" if slope == 1 else f"{slope} (n - 1)"
    return f"{share} + {rest}" if rest else share


def continuous() -> str:
    """Return the table of the continuous action."""
    return markdown(
        ("index", "values", "meaning"),
        [
            ["0", "-1 to 1", f"commanded forward speed, share of {MAX_SPEED:g} m/s"],
            ["1", "-1 to 1", f"commanded steering angle, share of {MAX_STEERING:g} rad; left is +"],
        ],
    )


def discrete() -> str:
    """Return the table of the discrete actions."""
    mode = DiscreteActions()
    assert isinstance(ACTIONS["discrete"](), DiscreteActions)
    head = ["speed \\ steering [rad]", *(f"{angle:+.2f}" for angle in mode.angles)]
    rows, number = [], 0
    for speed in mode.speeds:
        cells = []
        for angle in mode.angles:
            assert mode.decode(number, "") == (speed, angle)
            cells.append(str(number))
            number += 1
        rows.append([f"{speed:g} m/s", *cells])
    return markdown(head, rows, right="rest")


def weights() -> str:
    """Return the table of the reward weights of all tasks."""
    terms: list[str] = []
    for task in TASKS:
        terms += [t for t in DEFAULT_WEIGHTS[task] if t not in terms]
    rows = []
    for task in TASKS:
        default = config.configure({"task": task})
        has = default.make_task(1).terms
        cells = []
        for term in terms:
            weight = DEFAULT_WEIGHTS[task].get(term)
            unused = "" if term in has else "*"
            cells.append("" if weight is None else f"{weight:g}{unused}")
        rows.append([f"`{task}`", f"`{DEFAULT_SCENARIO[task]}`", *cells])
    return markdown(("task", "scenario", *terms), rows, right=", ".join(terms))


def arguments() -> str:
    """Return the table of the fields of a configuration."""
    meanings = docstrings(config.FormationConfig)
    rows = []
    for f in fields(config.FormationConfig):
        rows.append([f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]])
    return markdown(("argument", "default", "meaning"), rows)


def scenarios() -> str:
    """Return the table of the scenarios of the package."""
    rows = []
    for name in SCENARIOS:
        s = SCENARIOS[name]
        room = f"{s.room[0]:g} m x {s.room[1]:g} m"
        boxes = str(len(s.obstacles)) if s.gap is None else f"a wall with a gap of {s.gap.width} m"
        channel = next((k for k, c in CHANNELS.items() if c == s.radio.channel), "its own")
        rows.append([f"`{name}`", room, str(s.n_cars), s.layout, boxes, channel, drawn(s)])
    head = ("scenario", "room", "cars", "start", "obstacles", "radio", "drawn again")
    return markdown(head, rows, right="cars")


def drawn(s: Scenario) -> str:
    """Return the randomisation of a scenario per episode, apart from poses, as text."""
    for k, level in enumerate(LEVELS):
        if s.randomisation == level:
            return f"level {k}" if k else ""
    own = [f.name for f in fields(s.randomisation)]
    least = [
        (sum(getattr(s.randomisation, n) != getattr(level, n) for n in own), k)
        for k, level in enumerate(LEVELS)
    ]
    _, nearest = min(least)
    differ = [n for n in own if getattr(s.randomisation, n) != getattr(LEVELS[nearest], n)]
    changes = ", ".join(f"{n} {getattr(s.randomisation, n)}" for n in differ)
    return f"level {nearest}, {changes}"


def training() -> str:
    """Return the table of the options of a training run."""
    rows = []
    for leaf in leaves(TrainConfig):
        default = ",".join(map(str, leaf.default)) if leaf.many else leaf.default
        shown = f"`{default}`" if default != "" else "none"
        rows.append([f"`{leaf.option}`", shown, leaf.help])
    return markdown(("option", "default", "meaning"), rows)
