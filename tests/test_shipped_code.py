"""Code compiled ahead of time for processor levels, by other processes and in wheels."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from numba import config

from tracking.kernels.processors import LEVELS, fitting_levels, has_wide_registers

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
ROOT = Path(__file__).resolve().parent.parent
MODULE = """
from tracking.kernels import compile_units
from tracking.kernels.jit import kernel

@kernel
def inner(x):
    return 2.0 * x

@kernel
def outer(x):
    return inner(x) + 1.0

def count():
    return compile_units._UnitCompiler.n_compiled
"""


def run(folder, call, **env):
    done = subprocess.run(
        [sys.executable, "-c", f"import shipped; print({call})"],
        cwd=folder,
        env={**os.environ, **env},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "shipped.py").write_text(MODULE)
    return tmp_path


def ship(folder, level):
    """Keep only the code compiled for a level, next to the module."""
    run(folder, "shipped.outer(1.0)", NUMBA_CPU_NAME=level, NUMBA_CPU_FEATURES="")
    target = folder / "__compiled__" / level
    target.mkdir(parents=True, exist_ok=True)
    for file in (folder / "__pycache__").glob("*.nb?"):
        file.rename(target / file.name)
    shutil.rmtree(folder / "__pycache__")


def test_code_for_a_kind_of_processor_is_used_as_it_is(folder):
    ship(folder, fitting_levels()[0])
    assert run(folder, "(shipped.outer(1.0), shipped.count())") == "(3.0, 0)"
    # Also in every place that it is copied to.
    shutil.copytree(folder / "__compiled__", folder / "elsewhere" / "__compiled__")
    shutil.copy(folder / "shipped.py", folder / "elsewhere")
    assert run(folder / "elsewhere", "(shipped.outer(1.0), shipped.count())") == "(3.0, 0)"


def test_code_of_another_text_or_for_another_processor_is_not_used(folder):
    ship(folder, fitting_levels()[0])
    other = folder / "__compiled__" / fitting_levels()[0]
    other.rename(other.with_name("x86-64-v9"))
    assert run(folder, "(shipped.outer(1.0), shipped.count())") == "(3.0, 2)"
    shutil.rmtree(folder / "__pycache__")
    (folder / "__compiled__" / "x86-64-v9").rename(other)
    (folder / "shipped.py").write_text(MODULE.replace("2.0", "4.0"))
    assert run(folder, "(shipped.outer(1.0), shipped.count())") == "(5.0, 2)"


def test_processes_that_compile_side_by_side_agree_on_names(folder, tmp_path):
    """A caller of a kernel runs with that kernel's code from another process."""
    caches = [tmp_path / "a", tmp_path / "b"]
    for cache, warm in zip(caches, ("shipped.outer(1.0)", "shipped.inner(1.0)"), strict=True):
        run(folder, warm, NUMBA_CACHE_DIR=str(cache))
    for file in caches[1].rglob("*inner*"):
        shutil.copy(file, next(caches[0].rglob("*inner*")).parent)
    found = run(folder, "(shipped.outer(1.0), shipped.count())", NUMBA_CACHE_DIR=str(caches[0]))
    assert found == "(3.0, 0)"


def test_levels_are_those_of_this_processor_the_best_first():
    names = list(LEVELS)
    fitting = [level for level in fitting_levels() if level in names]
    assert fitting == names[len(names) - len(fitting) :]


@pytest.mark.parametrize(
    ("name", "features", "wide"),
    [("x86-64-v4", "", True), ("x86-64-v3", "", False), ("znver4", "+avx2,+avx512f", True)],
)
def test_vectors_are_as_wide_as_the_processor_that_is_compiled_for(
    monkeypatch, name, features, wide
):
    monkeypatch.setattr(config, "CPU_NAME", name)
    monkeypatch.setattr(config, "CPU_FEATURES", features)
    assert has_wide_registers() is wide


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_a_wheel_in_an_empty_environment_compiles_nothing(tmp_path):
    """The smallest filter, for the best processor level of this machine."""
    left_out = (".*", "__pycache__", "__compiled__", "build", "dist", "tests")
    shutil.copytree(ROOT, tmp_path / "source", ignore=shutil.ignore_patterns(*left_out))
    packages = sysconfig.get_path("purelib")
    (tmp_path / "source" / ".venv").symlink_to(Path(sys.prefix), target_is_directory=True)
    env = {
        k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "PYTEST", "PYTHONPATH"))
    }
    given = {"capture_output": True, "text": True, "check": False, "env": env}
    wanted = [f"LEVELS={fitting_levels()[0]}", "WARM=--filter paper-ekf"]
    # Use the environment as it is: nothing may be installed.
    made = subprocess.run(
        ["make", "-o", ".venv/.dev", "wheel", *wanted], cwd=tmp_path / "source", **given
    )
    assert made.returncode == 0, made.stdout + made.stderr
    (wheel,) = (tmp_path / "source" / "dist").glob("*.whl")
    assert "none-any" not in wheel.name
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "empty"], check=True)
    (site,) = (tmp_path / "empty").rglob("site-packages")
    zipfile.ZipFile(wheel).extractall(site)
    (site / "others.pth").write_text(f"import sys; sys.path.append({packages!r})\n")
    code = (
        "import tracking; from tracking.kernels import compile_units;"
        "from agents.warm_up import parts_of, warm_up;"
        "found = warm_up(parts_of('track', ('paper-ekf',)));"
        "print(tracking.__file__, found.compiled, compile_units._UnitCompiler.n_compiled)"
    )
    env["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
    (python,) = (tmp_path / "empty").glob("*/python")
    done = subprocess.run([python, "-c", code], cwd=tmp_path, **given)
    assert done.returncode == 0, done.stderr
    file, *rest = done.stdout.split()
    assert Path(file).is_relative_to(tmp_path / "empty")
    assert rest == ["()", "0"]


def test_compiling_that_takes_seconds_is_announced_once(folder):
    """A few kernels give no message."""
    many = "@kernel\ndef f{0}(x):\n    return x + {0}.0\n\n"
    (folder / "shipped.py").write_text(MODULE + "".join(many.format(k) for k in range(8)))
    for calls, times in (
        ("shipped.outer(1.0)", 0),
        ("[getattr(shipped, f'f{k}')(1.0) for k in range(8)]", 1),
    ):
        done = subprocess.run(
            [sys.executable, "-c", f"import shipped; {calls}"],
            cwd=folder, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stderr.count("`relpos warmup` does it ahead") == times
