"""Command line as users see it: results, JSON, and faults without a traceback."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from agents.cli.main import cli
from agents.simulation.frames import NAMES
from tests.command_line import relpos
from tracking.filters import FILTERS


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    out = tmp_path_factory.mktemp("sim") / "run"
    done = relpos("simulate", "--out", out, "--seconds", 20, "--seed", 3, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["nodes"] == 3
    assert record["ranges"] > 3000
    return out


def test_track_writes_results_and_json(recording, tmp_path):
    out = tmp_path / "results"
    done = relpos(
        "track", recording, "--filter", "ekf", "--filter", "ekf-mds", "--json", "--out", out
    )
    assert done.returncode == 0, done.stderr
    records = [json.loads(line) for line in done.stdout.splitlines()]
    assert [r["filter"] for r in records] == ["ekf", "ekf-mds"]
    keys = {
        "log", "filter", "nodes", "duration_s", "ranges", "rmse", "rmse_yaw", "yaw_deg",
        "rmse_shape", "pair_rmse", "nees", "nis", "realtime_factor",
    }  # fmt: skip
    assert keys <= set(records[0])
    assert set(records[0]["pair_rmse"]) == {"1-2", "1-3", "2-3"}
    page = (out / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64") == 6
    assert "http" not in page.replace("http-equiv", "")
    tables = sorted(out.rglob("estimates.csv"))
    assert len(tables) == 2
    header = "t_s,node_i,node_j,x,y,z,vx,vy,vz,sx,sy,sz,protection,status"
    assert tables[0].read_text().splitlines()[0] == header


def test_track_prints_a_table(recording):
    command = [Path(sys.executable).with_name("relpos"), "track", recording, "--skip", "5"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    for word in ("rmse_yaw", "rmse_shape", "1-2", "all", "bad rows skipped: 0"):
        assert word in done.stdout


def test_track_tells_the_least_error_that_is_possible(recording, tmp_path):
    done = relpos("track", recording, "--bound", "--skip", 5, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "bound" in done.stdout
    assert "bound" in (tmp_path / "out" / "report.html").read_text()
    told = json.loads(relpos("track", recording, "--bound", "--json").stdout)
    assert 0.0 < told["bound_rmse_shape"] <= told["bound_rmse_yaw"] <= told["bound_rmse"]
    assert "bound_rmse" not in json.loads(relpos("track", recording, "--json").stdout)


def test_without_truth_no_bound_is_told(recording, tmp_path):
    blind = tmp_path / "blind"
    shutil.copytree(recording, blind)
    for name in blind.glob("truth*"):
        name.unlink()
    done = relpos("track", blind, "--bound")
    assert done.returncode == 2
    assert "truth" in done.stderr
    assert "Traceback" not in done.stderr


def test_smoothed_estimates_are_better(recording):
    from agents.evaluation.track import track_log
    from agents.simulation.simulate import simulate

    told = json.loads(relpos("track", recording, "--json", "--smooth", "lag").stdout)
    assert told["rmse_shape"] == track_log(recording, smooth="lag").score.rmse_shape
    ratios = []
    for seed in range(4):
        log = simulate(scenario="cars-nlos", seconds=20.0, seed=seed)
        plain, smooth = (track_log(log, smooth=each, findings=[]).score for each in (None, "lag"))
        ratios.append(smooth.rmse_shape / plain.rmse_shape)
    assert sum(ratios) / len(ratios) < 0.99
    done = relpos("track", recording, "--filter", "ekf", "--smooth", "lag")
    assert done.returncode == 2
    assert "--smooth: expected filter joint" in done.stderr


def test_where_nothing_can_be_written_nothing_is_tracked(recording, tmp_path):
    (tmp_path / "file").write_text("")
    done = relpos("track", recording, "--out", tmp_path / "file" / "out")
    assert done.returncode == 2
    assert "is a file, expected a folder" in done.stderr


def test_a_folder_that_may_not_be_written_to_is_found_first(monkeypatch, tmp_path):
    import tempfile

    from agents.errors import UsageError
    from agents.output import check_folder

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "mkdtemp", refuse)
    with pytest.raises(UsageError, match="cannot be written to"):
        check_folder(tmp_path / "new", ["report.html"])


def test_no_figure_is_cut_off(capsys, monkeypatch):
    from agents.cli.console import print_table

    monkeypatch.setenv("COLUMNS", "80")
    cells = [f"figure-{k}-of-a-long-row" for k in range(12)]
    print_table("Title", [f"column {k}" for k in range(12)], [cells])
    told = capsys.readouterr().out
    assert all(cell in told for cell in cells)


def test_a_log_that_cannot_be_scored(tmp_path):
    """Static nodes only, no truth, no inertial samples: nothing to draw or to score."""
    (tmp_path / "meta.toml").write_text(
        'format = 1\nname = "still"\ndimensions = 3\n'
        + "".join(f'[nodes.{n}]\nkind = "static"\n' for n in range(1, 5))
    )
    rows = [f"{0.1 * k},{1 + k % 3},4,{2.0 + 0.01 * (k % 7)}" for k in range(200)]
    (tmp_path / "ranges.csv").write_text("t_s,node_i,node_j,range_m\n" + "\n".join(rows) + "\n")
    done = relpos("track", tmp_path, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "status ok - of the scored time" in done.stdout
    assert "nothing to draw" in (tmp_path / "out" / "report.html").read_text()
    told = json.loads(relpos("track", tmp_path, "--json").stdout)
    assert told["coverage"] is None
    assert told["ok_share"] is None


def test_single_bad_measurements_are_shown(recording, tmp_path):
    import gzip
    import shutil

    copy = tmp_path / "copy"
    shutil.copytree(recording, copy)
    lines = gzip.decompress((copy / "ranges.csv.gz").read_bytes()).decode().splitlines()
    cells = lines[100].split(",")
    cells[3] = "-2.0"
    lines[100] = ",".join(cells)
    (copy / "ranges.csv.gz").write_bytes(gzip.compress("\n".join(lines).encode()))
    done = relpos("track", copy)
    assert done.returncode == 0
    assert "1 in ranges.csv.gz" in done.stdout


FAULTS = [
    (["train"], "--out, --resume: expected one of them"),
    (["train", "--resume", "nowhere"], "nowhere: no training run"),
    (["train", "--resume", "nowhere", "--seed", "1"], "--seed: a run goes on with its own"),
    (["train", "--out", "run", "--gamma", "2"], "--gamma: expected 0 to 1, got 2"),
    (["train", "--out", "run", "--critic", "all"], "--critic: expected one of own, central"),
    (["train", "--out", "run", "--scenario", "moon"], "scenario: expected one of"),
    (["train", "--out", "run", "--cars", "3"], "--cars: expected at least 6"),
    (["train", "--out", "run", "--weight", "collision"], "--weight: expected TERM=WEIGHT"),
    (["train", "--out", "run", "--weight", "luck=1"], "weights: expected terms among"),
    (["export", "nowhere", "--out", "out"], "nowhere: no training run"),
    (["bench", "train", "--updates", "0"], "--updates: expected 1 to"),
    (["track", "nowhere"], "no such folder"),
    (["track"], "Missing argument"),
    (
        ["track", ".", "--filter", "magic"],
        "filter: expected one of joint, ekf-mds, ekf, paper-",
    ),
    (["track", ".", "--skip", "-1"], "--skip"),
    (["track", "."], "no meta.toml"),
    (["simulate", "--out", "x", "--scenario", "moon"], "scenario: expected one of"),
    (["simulate", "--out", "x", "--cars", "1"], "cars: expected 2 to 20"),
    (
        ["simulate", "--out", "x", "--scenario", "swarm-nlos", "--cars", "7"],
        "at most 6 in scenario",
    ),
    (["simulate", "--out", "x", "--cars", "19"], "n_cars: 19 do not fit"),
    (["simulate", "--out", "x", "--scenario", "moon.toml"], "scenario: cannot read 'moon.toml'"),
    (["simulate", "--out", "x", "--seconds", "nan"], "seconds: expected 3 to 86400"),
    (["simulate", "--out", "x", "--seed", "-4"], "seed: expected 0 or more"),
    (["simulate", "--out", "x", "--cars", "two"], "--cars"),
    (["simulate", "--out", "x", "--channel", "moon"], "channel: expected one of"),
    (["simulate", "--out", "x", "--antenna-delay", "-1"], "antenna delay: expected 0 to 10"),
    (["protocol", "--events", "0"], "--events: expected 1 to 100000"),
    (["protocol", "--nodes", "3,x"], "--nodes: expected numbers"),
    (["protocol", "--nodes", "1"], "--nodes: expected 2 to 62"),
    (["protocol", "--seed", "-1"], "--seed: expected 0 or more"),
    (["demo", "--seconds", "1"], "--seconds: expected 15"),
    (["demo", "--scenario", "moon"], "scenario: expected one of"),
    (["demo", "--scenario", "moon.toml"], "scenario: cannot read 'moon.toml'"),
    (["demo", "--scenario", "human"], "scenario: 'human' has a person"),
    (["demo", "--task", "dance"], "task: expected one of"),
    (
        ["demo", "--task", "gap", "--scenario", "hall"],
        "scenario: task 'gap' expected one with a gap",
    ),
    (["demo", "--cars", "40"], "--cars: expected 2 to 20"),
    (["demo", "--cars", "19"], "n_cars: 19 do not fit"),
    (["demo", "--seed", "-1"], "--seed: expected 0 or more"),
    (["demo", "--policy", "nowhere"], "nowhere: no such file or folder, and no policy"),
    (["demo", "--policy", "best_model.zip"], "may execute code when it is loaded"),
    (["demo", "--policy", "a", "--controller", "b"], "--policy: expected either a policy or a"),
    (["demo", "--controller", "magic"], "controller: expected one of consensus"),
    (["policy", "show", "vec_normalize.pkl"], "may execute code when it is loaded"),
    (["policy", "show"], "Missing argument"),
    (["bench", "policy", "--steps", "0"], "--steps: expected 1 to"),
    (["bench", "tracker", "--rounds", "3"], "--rounds"),
    (["nonsense"], "No such command"),
]


@pytest.mark.parametrize(
    ("args", "message"), FAULTS, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_faults_end_in_one_clear_message_and_status_2(args, message, tmp_path):
    done = relpos(*args, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_results_are_whole_or_not_at_all(recording, tmp_path):
    (tmp_path / "estimates.csv").mkdir()
    done = relpos("track", recording, "--out", tmp_path, "--overwrite")
    assert done.returncode == 2
    assert "estimates.csv is a folder" in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["estimates.csv"]
    (tmp_path / "file").write_text("")
    for args in (
        ["track", recording, "--out", tmp_path / "file" / "x"],
        ["simulate", "--out", tmp_path / "file" / "x", "--seconds", 4],
    ):
        done = relpos(*args)
        assert done.returncode == 2
        assert "Traceback" not in done.stderr


def test_protocol_in_json_and_pictures(tmp_path):
    done = relpos("protocol", "--events", 3, "--nodes", "3", "--json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    rates = {(r["phy"], r["n"]): r for r in rows if r["experiment"] == "rate"}
    assert rates["110k", 3]["rounds_hz"] == pytest.approx(rates["110k", 3]["paper_hz"], rel=0.02)
    assert rates["6M8", 3]["paper_hz"] is None
    recovery = {(r["event"], r["mode"]): r for r in rows if r["experiment"] == "recovery"}
    assert len(recovery) == 6
    assert recovery["initiator-loss", "succession"]["mean_ms"] < 100.0
    assert 500.0 < recovery["initiator-loss", "watchdog"]["mean_ms"] < 1000.0
    clock = [r for r in rows if r["experiment"] == "clock" and r["ppm"] == 20.0]
    assert [r["slot"] for r in clock] == [1, 2, 3, 4, 5]
    assert max(abs(r["bias_cm"]) for r in clock) < 2.0
    assert all(r["std_ratio"] < 1.2 for r in clock)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert {"report.html", "protocol-timeline.svg", "protocol-rates.svg"} <= names


def test_help_names_the_filters_scenarios_and_tasks():
    from relpos_env.scenarios import RECORDABLE, SCENARIOS
    from relpos_env.tasks import TASKS
    from tracking.filters import FILTERS

    assert all(name in relpos("track", "--help").stdout for name in FILTERS)
    driving = ("demo", "demo-hardware", "compare", "emulate", "rllib")
    for command, names in (
        ("simulate", RECORDABLE),
        *((command, [*SCENARIOS, *TASKS]) for command in driving),
    ):
        page = "".join(relpos(command, "--help").stdout.split())  # lines break at hyphens
        assert all(name in page for name in names)


@pytest.fixture
def small_room(tmp_path):
    path = tmp_path / "small-room.toml"
    path.write_text('extends = "ring-nlos"\nn_cars = 4\nlayout = "scattered"\n')
    return path


def test_a_scenario_of_ones_own(small_room, tmp_path):
    done = relpos(
        "simulate", "--out", tmp_path / "run", "--scenario", small_room, "--seconds", 5, "--json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["nodes"] == 4
    done = relpos(
        "demo", "--scenario", small_room, "--seconds", 15, "--out", tmp_path / "demo", "--json"
    )
    assert done.returncode == 0, done.stderr
    formation = json.loads(done.stdout.splitlines()[-1])
    assert formation["scenario"] == "small-room"


@pytest.mark.parametrize("scenario", ["random", "gap"])
def test_simulate_takes_every_kind_of_scenario(scenario, tmp_path):
    done = relpos(
        "simulate", "--out", tmp_path / "run", "--scenario", scenario, "--seconds", 5, "--json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["ranges"] > 0


def out_commands():
    """Return the names of all commands that write results into a folder."""
    for name, command in cli.commands.items():
        parts = getattr(command, "commands", {"": command})
        for part, each in parts.items():
            if {"out", "overwrite"} <= {option.name for option in each.params}:
                yield f"{name} {part}".strip()


@pytest.mark.parametrize("name", sorted({*out_commands()} - {"export"}))
def test_a_folder_that_holds_anything_is_refused_before_any_work(name, recording, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    needed = [recording] if name.split()[0] in ("track", "calibrate", "convert") else []
    done = relpos(*name.split(), *needed, "--out", tmp_path)
    assert done.returncode == 2
    assert "exists already, expected a new or empty folder or --overwrite" in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_overwrite_replaces_files_of_the_same_names_alone(recording, tmp_path):
    for name in ("mine.txt", "report.html"):
        (tmp_path / name).write_text("mine")
    # The order of the two arguments has no effect.
    done = relpos("track", recording, "--out", tmp_path, "--overwrite")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert "<html" in (tmp_path / "report.html").read_text()
    (tmp_path / "report.html").write_text("mine")
    assert relpos("track", recording, "--overwrite", "--out", tmp_path).returncode == 0
    assert "<html" in (tmp_path / "report.html").read_text()


def test_every_command_that_writes_results_knows_overwrite():
    assert set(out_commands()) == {
        "track", "calibrate imu", "calibrate mag", "calibrate uwb", "evaluate", "protocol",
        "demo", "compare", "export", "demo-hardware", "bench tracker", "bench env", "simulate",
        "convert",
    }  # fmt: skip


def test_simulate_does_not_overwrite(recording):
    before = sorted((p.name, p.stat().st_mtime_ns) for p in recording.iterdir())
    done = relpos("simulate", "--out", recording, "--seconds", 5)
    assert done.returncode == 2
    assert "exists already" in done.stderr
    assert sorted((p.name, p.stat().st_mtime_ns) for p in recording.iterdir()) == before


def test_simulate_is_repeatable(tmp_path):
    for name in ("a", "b"):
        assert (
            relpos("simulate", "--out", tmp_path / name, "--seconds", 5, "--seed", 8).returncode
            == 0
        )
    for file in ("ranges.csv.gz", "imu.csv.gz", "truth.csv.gz", "meta.toml"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_demo_tells_errors_and_draws_the_drive(tmp_path):
    done = relpos("demo", "--seconds", 20, "--out", tmp_path / "demo", "--json")
    assert done.returncode == 0, done.stderr
    *tracks, formation = [json.loads(line) for line in done.stdout.splitlines()]
    assert [t["filter"] for t in tracks] == list(FILTERS)
    assert 0.0 < formation["formation_error_truth"] < formation["formation_error"]
    assert formation["formation_error"] < 0.5 * formation["formation_error_blind"]
    assert "<canvas" in (tmp_path / "demo" / "report.html").read_text()


def test_a_demonstration_of_a_task_that_ends(tmp_path):
    from agents.simulation.demo import demo

    result = demo(task="gap", seconds=40.0, seed=1)
    assert result.scenario == "gap"
    frames = result.frames
    lengths = {len(frames[name]) for name in NAMES}
    assert lengths == {round(result.seconds / 0.1)}
    assert result.done == (result.seconds < 40.0)


def test_a_demonstration_with_a_tracker_on_each_car():
    from agents.simulation.demo import demo

    errors = [
        demo(seconds=15.0, seed=1, trackers=trackers, filters=[]).formation_error
        for trackers in ("group", "own")
    ]
    assert errors[0] != errors[1]
    assert max(errors) < 0.5


def test_contacts_of_a_demonstration_are_those_of_its_steps():
    """The reference counts the contacts of the steps independently."""
    from agents.controllers import Consensus
    from agents.simulation.demo import demo
    from relpos_env import formation_v0

    result = demo(task="follow", seconds=15.0, seed=2)
    env = formation_v0.parallel_env(task="follow", max_cycles=150)
    observations, _ = env.reset(seed=2)
    controller, contacts = Consensus(env.fields), 0
    while env.agents:
        actions = {a: controller.act(o) for a, o in observations.items()}
        observations, _, _, _, infos = env.step(actions)
        contacts += sum(info["collisions"] for info in infos.values())
    assert result.collisions == contacts > 0


def test_bench_lines_have_a_peer():
    done = relpos("bench", "tracker", "--rounds", 200, "--json")
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines():
        row = json.loads(line)
        assert set(row) == {"bench", "case", "value", "unit", "peer", "peer_value", "ratio"}
        assert row["ratio"] == pytest.approx(row["peer_value"] / row["value"])


def test_an_unknown_controller_is_named():
    from agents.simulation.demo import demo
    from relpos_env.errors import EnvError

    with pytest.raises(EnvError, match="controller: expected one of consensus"):
        demo(seconds=15.0, controller="magic")
