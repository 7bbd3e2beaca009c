"""Engines give the results of a loop."""

import os

import pytest

from agents.errors import UsageError
from agents.jobs import check_jobs, find_engine

LOCAL = ["local"]
"""Local engine; the Ray engine has a test file of its own."""


def divided(a, b):
    return a / b, os.getpid()


def ended(_):
    os._exit(3)


@pytest.mark.parametrize("name", LOCAL)
@pytest.mark.parametrize("jobs", [1, 2, 50])
def test_results_are_those_of_a_loop(name, jobs):
    tasks = [(float(k), 2.0) for k in range(3)]
    found = dict(find_engine(name)(divided, tasks, jobs))
    assert {n: r[0] for n, r in found.items()} == {0: 0.0, 1: 0.5, 2: 1.0}
    assert list(find_engine(name)(divided, [], jobs)) == []


@pytest.mark.parametrize("name", LOCAL)
def test_errors_come_back(name):
    with pytest.raises(ZeroDivisionError):
        list(find_engine(name)(divided, [(1.0, 2.0), (1.0, 0.0)], 2))


def test_a_process_that_ends_is_told():
    with pytest.raises(UsageError, match="--jobs: a process was ended from outside"):
        list(find_engine("local")(ended, [(0,), (1,)], 2))


def test_one_job_is_done_here():
    ((_, (_, process)),) = find_engine("local")(divided, [(1.0, 1.0)], 8)
    assert process == os.getpid()


def test_what_there_is_not_is_refused():
    with pytest.raises(UsageError, match="--engine: expected one of local, ray, got 'moon'"):
        find_engine("moon")
    with pytest.raises(UsageError, match="--jobs: expected 1 to 1024, got 0"):
        check_jobs(0)
