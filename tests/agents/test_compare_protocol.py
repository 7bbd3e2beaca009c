"""Evaluation protocols: what they fix, and comparisons on several tasks."""

import json

import pytest
from click.testing import CliRunner

from agents.cli.main import cli
from agents.comparison.compare import compare
from agents.comparison.protocol import Protocol, protocol_arguments, protocols
from agents.errors import UsageError
from relpos_env.tasks import TASKS

SHORT = """
tasks = ["hold", "rendezvous"]
observations = ["truth"]
trackers = "group"
operator = 1.0
episodes = 2
first_seed = 7
seconds = 2.0
settle = 1.0
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


def test_the_first_protocol_has_every_task_and_seeds_of_its_own():
    assert protocols() == ("1",)
    fixed = protocol_arguments("1")
    assert fixed["protocol"] == "1"
    assert set(fixed["tasks"]) <= set(TASKS)
    # Training draws seeds below 2^30 at random; shipped comparisons use 1000 to 4999.
    assert fixed["first_seed"] >= 10_000


def test_a_protocol_names_the_groups_and_is_named_in_the_result(file):
    result = compare(drivers=["consensus"], level="easy", **protocol_arguments(str(file)))
    assert result.groups == ("hold in ring-nlos", "rendezvous in hall")
    assert [(r["task"], r["protocol"], r["level"]) for r in result.records] == [
        ("hold", "short", "easy"),
        ("rendezvous", "short", "easy"),
    ]
    assert {e["task"] for e in result.episode_records} == {"hold", "rendezvous"}
    assert [e.seed for e in result.rows[0].episodes] == [7, 8]
    # A level by number gives the same episodes.
    again = compare(drivers=["consensus"], level=1, **protocol_arguments(str(file)))
    for one, other in zip(result.rows, again.rows, strict=True):
        assert one.values("formation_error").tolist() == other.values("formation_error").tolist()


def test_the_command_takes_a_protocol_and_a_level(file, tmp_path):
    arguments = ["compare", "consensus", "--protocol", str(file), "--level", "easy"]
    done = CliRunner().invoke(cli, [*arguments, "--json", "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["episodes"] for row in rows] == [2, 2]
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Tasks hold, rendezvous, level easy, protocol short, 2 episodes" in report


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--episodes", "5"], "--episodes: expected without --protocol, which fixes it"),
        (["--task", "hold"], "--task: expected without --protocol"),
        (["--scenario", "hall"], "--scenario: expected without --protocol"),
        (["--first-seed", "1"], "--first-seed: expected without --protocol"),
        (["--level", "tough"], "level: expected 0 to 4 or one of easy"),
    ],
)
def test_what_a_protocol_fixes_cannot_be_chosen(file, options, message):
    arguments = ["compare", "consensus", "--protocol", str(file), *options]
    with pytest.raises(Exception, match=message):
        CliRunner().invoke(cli, arguments, catch_exceptions=False)


@pytest.mark.parametrize("field", Protocol.__dataclass_fields__)
def test_a_protocol_has_all_fields(file, field):
    file.write_text("\n".join(ln for ln in SHORT.splitlines() if not ln.startswith(field)))
    with pytest.raises(UsageError, match=f"short.toml: {field}: missing"):
        protocol_arguments(str(file))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SHORT.replace('"group"', '"all"'), "trackers: expected one of 'group', 'own', got 'all'"),
        (SHORT.replace("= 2\n", '= "two"\n'), "episodes: expected a whole number, got 'two'"),
        (SHORT + "cars = 3\n", "cars: unknown, expected one of tasks"),
        ("tasks = [", "cannot be read"),
    ],
)
def test_wrong_protocols_are_refused_by_field(file, text, message):
    file.write_text(text)
    with pytest.raises(UsageError, match=message):
        protocol_arguments(str(file))


def test_unknown_protocols_are_refused():
    with pytest.raises(UsageError, match="--protocol: expected 1 or a file .*, got '9'"):
        protocol_arguments("9")
    with pytest.raises(UsageError, match="cannot be read"):
        protocol_arguments("nosuch.toml")
    with pytest.raises(UsageError, match="--task: expected at least one"):
        compare(drivers=["consensus"], tasks=[])
