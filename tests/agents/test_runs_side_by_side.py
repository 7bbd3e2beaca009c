"""Several training runs at a time: each equals a run alone, and the best policy is kept."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from processes import is_running

from agents.cli.main import cli
from agents.errors import UsageError
from agents.policies import load_policy
from agents.settings import from_options
from agents.training.choice import FILE, choose, read_choice
from agents.training.config import TrainConfig
from agents.training.export import export_policy
from agents.training.run import train_policy
from agents.training.run_folder import BEST, LAST, RunFolder
from agents.training.side_by_side import train_side_by_side
from agents.training.train import train

SMALL = {
    "frames": "1400", "eval_interval": "2", "envs": "3", "steps": "16", "batch": "64",
    "epochs": "2", "eval_episodes": "2", "choice_episodes": "4", "seconds": "12", "width": "8",
    "threads": "2", "seed": "3",
}  # fmt: skip


def small(**changes):
    return from_options(TrainConfig, {**SMALL, **changes})


def same_weights(one, other):
    a, b = (RunFolder(path).load(LAST)[0] for path in (one, other))
    return a.keys() == b.keys() and all(torch.equal(a[k], b[k]) for k in a)


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """Make two runs side by side; return their reports, too."""
    folder, told = tmp_path_factory.mktemp("runs") / "two", []
    result = train_policy(
        small(runs="2"), folder, progress=lambda share, row: told.append((share, row))
    )
    return folder, result, told


def test_each_is_as_if_it_were_alone(two, tmp_path):
    folder, result, told = two
    alone = train(small(seed="4", threads="1"), tmp_path / "alone")
    assert same_weights(folder / "seed-4", tmp_path / "alone")
    assert not same_weights(folder / "seed-3", tmp_path / "alone")
    strip = [{k: v for k, v in r.items() if k != "seconds"} for r in alone.records]
    other = [{k: v for k, v in r.items() if k != "seconds"} for r in result.records]
    assert other[3:] == [{"seed": 4, **r} for r in strip]
    assert sorted((row["seed"], row["interval"]) for _, row in told if row) == [
        (seed, interval) for seed in (3, 4) for interval in range(3)
    ]
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_the_best_of_both_is_kept(two):
    folder, result, _ = two
    choice = read_choice(folder)
    assert choice.measured == result.best
    assert choice.measured["return"] == max(r["return"] for r in choice.rows)
    assert {r["seed"] for r in choice.rows} == {3, 4}
    card = load_policy(folder / "two.onnx").card.training
    assert (card["seed"], card["interval"]) == (result.best["seed"], result.best["interval"])
    assert card["chosen_by"] == result.best
    assert "seeds 3 to 4" in (folder / "report.html").read_text()
    # The exported policy is that of the chosen run and iteration.
    path = export_policy(choice.run, folder / "again", last=choice.weights == LAST)
    seen = np.random.default_rng(0).normal(size=(9, load_policy(path).layout.size))
    driven = [load_policy(p).act(seen.astype(np.float32)) for p in (path, folder / "two.onnx")]
    assert np.array_equal(*driven)


def test_the_choice_is_made_in_episodes_of_its_own(two):
    folder, result, _ = two
    config = RunFolder(folder).config()
    again = choose(config, [folder / "seed-3", folder / "seed-4"])
    assert again.rows == read_choice(folder).rows
    intervals = {r["interval"]: r["return"] for r in result.records if r["seed"] == 4}
    assert all(r["return"] != intervals[r["interval"]] for r in again.rows if r["seed"] == 4)


def test_runs_that_were_stopped_go_on_as_if_they_had_not_been(two, tmp_path):
    class Stop(Exception):
        pass

    def stop(share, row):
        if row is not None:
            raise Stop

    folder = tmp_path / "two"
    with pytest.raises(Stop):
        train_policy(small(runs="2"), folder, progress=stop)
    assert not (folder / FILE).exists()
    with pytest.raises(UsageError, match="2 runs side by side, expected that they have ended"):
        export_policy(folder, tmp_path / "out")
    train_policy(None, folder)
    for seed in (3, 4):
        assert same_weights(two[0] / f"seed-{seed}", folder / f"seed-{seed}")


def test_a_run_that_fails_says_why(tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "config.json").write_text("{")
    configs = [small().of_run(k) for k in range(2)]
    with pytest.raises(UsageError, match="damaged, expected JSON"):
        train_side_by_side(configs, [tmp_path / "a", tmp_path / "b"], lambda *_: None)


def test_a_process_that_is_killed_is_told(tmp_path):
    def kill(k, share, row):
        for process in multiprocessing.active_children():
            process.kill()

    with pytest.raises(UsageError, match="ended from outside.*--resume"):
        train_side_by_side([small(frames="20000")], [tmp_path / "a"], kill)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_runs_end_with_the_process_that_began_them(tmp_path):
    """A run that went on would write into a folder that --resume uses."""
    code = """
import multiprocessing, sys, threading, time
from pathlib import Path
from agents.settings import from_options
from agents.training.config import TrainConfig
from agents.training.side_by_side import train_side_by_side

def tell():
    folder = Path(sys.argv[1])
    while not (folder / "tensorboard").exists():
        time.sleep(0.05)
    print(*(p.pid for p in multiprocessing.active_children()), flush=True)

if __name__ == "__main__":
    threading.Thread(target=tell, daemon=True).start()
    config = from_options(
        TrainConfig, {"eval_interval": "10000", "envs": "3", "frames": "1000000000"}
    )
    train_side_by_side([config], [Path(sys.argv[1])], lambda *_: None)
"""
    script = tmp_path / "begin.py"
    script.write_text(code)
    command = [sys.executable, str(script), str(tmp_path / "run")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as first:
        (pid,) = first.stdout.readline().split()
        assert is_running(pid)
        first.kill()
    until = time.monotonic() + 20.0
    while is_running(pid) and time.monotonic() < until:
        time.sleep(0.05)
    still = is_running(pid)
    if still:
        os.kill(int(pid), signal.SIGKILL)
    assert not still


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"run": "..", "weights": 3, "measured": {}, "rows": []}',
     '{"run": "../..", "weights": "last.safetensors", "measured": {}, "rows": []}',
     '{"run": "../other", "weights": "last.safetensors", "measured": {}, "rows": []}'],
)  # fmt: skip
def test_a_damaged_choice_is_refused(tmp_path, text):
    (tmp_path / FILE).write_text(text)
    with pytest.raises(UsageError, match="damaged"):
        read_choice(tmp_path)
    assert read_choice(tmp_path / "none") is None


def test_seeds_of_all_runs_are_looked_at_first(tmp_path):
    with pytest.raises(UsageError, match="--seed: expected at most 2147483646 with 2 runs"):
        train_policy(small(runs="2", seed="2147483647"), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_what_cannot_be_chosen_is_refused_before_any_training(tmp_path):
    with pytest.raises(UsageError, match="--choice-episodes: expected at least 2"):
        train_policy(small(runs="2", choice_episodes="1"), tmp_path / "run")
    assert not (tmp_path / "run").exists()
    with pytest.raises(UsageError, match=r"expected best\.safetensors of a finished run"):
        choose(small(), [tmp_path])


def test_the_command_trains_several_and_tells_them_apart(tmp_path):
    given = {**SMALL, "runs": "2", "frames": "1000"}
    options = [f"--{k.replace('_', '-')}={v}" for k, v in given.items()]
    done = CliRunner().invoke(cli, ["train", "--out", str(tmp_path / "run"), "--json", *options])
    assert done.exit_code == 0, done.output
    *intervals, last = (json.loads(line) for line in done.stdout.splitlines())
    assert {row["seed"] for row in intervals} == {3, 4}
    assert last["result"] == "policy"
    assert last["seed"] in (3, 4)
    refused = CliRunner().invoke(
        cli, ["export", str(tmp_path / "run"), "--last", "--out", str(tmp_path / "out")]
    )
    assert "2 runs side by side, expected the folder of one" in str(refused.exception)
    assert BEST in {p.name for p in (tmp_path / "run" / "seed-3").iterdir()}
