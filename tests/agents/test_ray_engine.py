"""Ray engine on a cluster of two cores: results are those of a loop, despite failures."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from agents.errors import UsageError
from agents.jobs import find_engine
from agents.jobs.ray_engine import start_ray

pytest.importorskip("ray", reason="ray is not installed: pip install -e '.[ray]'")

# Ray leaves its sockets to the garbage collector.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def cluster():
    """Start a cluster of two cores, which the engine uses."""
    import ray

    start_ray(2, None)
    yield ray
    ray.shutdown()


def divided(a, b):
    return a / b, os.getpid(), os.getsid(0) if hasattr(os, "getsid") else None


def text_of(path):
    return Path(path).read_text(), os.getpid()


def ended_at_first(folder, n):
    """End the worker the first two times that it is called with 1."""
    marks = Path(folder)
    if n == 1 and len(list(marks.iterdir())) < 2:
        (marks / str(os.getpid())).touch()
        os._exit(3)
    return n * n


def ended(n):
    if n == 1:
        os._exit(3)
    return n


def under_way(folder):
    """Return the number of concurrent calls, this one included."""
    import time

    mark = Path(folder) / f"{os.getpid()}-{time.perf_counter_ns()}"
    mark.touch()
    time.sleep(0.05)
    found = len(list(Path(folder).iterdir()))
    mark.unlink()
    return found


class Unwelcome(Exception):
    pass


def refused():
    raise Unwelcome("told by the function")


@pytest.mark.parametrize("jobs", [1, 2, 50])
def test_results_are_those_of_a_loop(cluster, jobs):
    tasks = [(float(k), 2.0) for k in range(7)]
    found = dict(find_engine("ray")(divided, tasks, jobs))
    assert {n: r[0] for n, r in found.items()} == {k: k / 2 for k in range(7)}
    assert os.getpid() not in {r[1] for r in found.values()}


def test_nothing_to_do_starts_nothing():
    assert list(find_engine("ray")(divided, [], 2)) == []


def test_errors_come_back_as_they_are(cluster):
    with pytest.raises(ZeroDivisionError):
        list(find_engine("ray")(divided, [(1.0, 2.0), (1.0, 0.0)], 2))
    with pytest.raises(Unwelcome, match="told by the function"):
        list(find_engine("ray")(refused, [()], 2))


def test_names_of_files_mean_the_same_there(cluster, tmp_path, monkeypatch):
    (tmp_path / "near.txt").write_text("here")
    monkeypatch.chdir(tmp_path)
    ((_, (text, _)),) = find_engine("ray")(text_of, [("near.txt",)], 1)
    assert text == "here"


def test_no_more_calls_than_jobs_are_under_way(cluster, tmp_path):
    found = dict(find_engine("ray")(under_way, [(str(tmp_path),)] * 6, 1))
    assert set(found.values()) == {1}


def test_a_lost_worker_is_replaced(cluster, tmp_path):
    tasks = [(str(tmp_path), n) for n in range(4)]
    assert dict(find_engine("ray")(ended_at_first, tasks, 2)) == {n: n * n for n in range(4)}
    assert len(list(tmp_path.iterdir())) == 2


def test_a_worker_that_is_always_lost_is_told(cluster):
    results = find_engine("ray")(ended, [(0,), (1,), (2,)], 2)
    assert {next(results), next(results)} == {(0, 0), (2, 2)}
    with pytest.raises(UsageError, match="the workers of task 1 were lost 4 times"):
        next(results)


def test_a_comparison_is_the_same_bit_for_bit(cluster):
    from agents.comparison.compare import compare

    asked = {
        "drivers": ["consensus"],
        "observations": ["estimate", "truth"],
        "scenarios": ["cars-nlos"],
        "episodes": 12,
        "seconds": 2.0,
        "settle": 1.0,
    }
    here = compare(**asked)
    there = compare(**asked, engine="ray", jobs=2)
    assert here.records == there.records
    assert here.episode_records == there.episode_records
    for ours, theirs in zip(here.rows, there.rows, strict=True):
        for a, b in zip(ours.episodes, theirs.episodes, strict=True):
            assert a.error.tobytes() == b.error.tobytes()


SCRIPT = """
import ray
from test_ray_engine import divided
from agents.jobs import find_engine
engine = find_engine("ray", {address!r})
found = dict(engine(divided, [(1.0, 2.0)] * 3, 2))
print(sorted((n, r[0]) for n, r in found.items()), ray.is_initialized())
print("workers in session", *{{r[2] for r in found.values()}})
"""


HERE_ALONE = """
import sys, types
module = types.ModuleType("here_alone")
exec("def divided(a, b): return a / b, 0, 0", module.__dict__)
sys.modules["here_alone"] = module
"""
"""A module that no other process can import."""


def elsewhere(address, code=SCRIPT):
    """Start a program that uses the engine; return its process and its output."""
    here = Path(__file__).parent
    before = os.environ.get("PYTHONPATH", "")
    search = {"PYTHONPATH": os.pathsep.join([str(here), str(here.parents[1]), before])}
    with subprocess.Popen(
        [sys.executable, "-c", code.format(address=address)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, **search},
    ) as child:
        out, err = child.communicate(timeout=120)
    return child, out, err


def processes_of(session):
    """Return the running processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if fields[3] == str(session) and fields[0] != "Z":
            found.append(stat.parent.name)
    return found


DONE = "[(0, 0.5), (1, 0.5), (2, 0.5)] False\n"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found in /proc")
def test_what_it_starts_it_ends():
    child, out, err = elsewhere(None)
    assert (child.returncode, out) == (0, DONE + f"workers in session {child.pid}\n"), err
    assert processes_of(child.pid) == []


def test_a_cluster_that_runs_is_joined_and_left(cluster):
    child, out, err = elsewhere(cluster.get_runtime_context().gcs_address)
    assert child.returncode == 0, err
    assert out.startswith(DONE)
    assert cluster.cluster_resources()["CPU"] == 2.0


def test_machines_without_the_packages_are_told(cluster):
    code = HERE_ALONE + SCRIPT.replace("from test_ray_engine", "from here_alone")
    child, _, err = elsewhere(cluster.get_runtime_context().gcs_address, code)
    assert child.returncode == 1
    assert "expected the same packages on every machine" in err
    assert "No module named 'here_alone'" in err


def test_an_address_where_nobody_answers_is_refused():
    with pytest.raises(UsageError, match=r"--address: expected a Ray cluster at '127.0.0.1:9'"):
        start_ray(1, "127.0.0.1:9")
    with pytest.raises(UsageError, match="--address: expected --engine ray with it"):
        find_engine("local", "auto")


def test_without_ray_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UsageError, match=r"needs ray: pip install -e '\.\[ray\]'"):
        list(find_engine("ray")(divided, [(1.0, 1.0)], 1))
