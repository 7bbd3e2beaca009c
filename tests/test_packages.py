"""Imports are cheap, examples run, and links between documents resolve."""

import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HEAVY = (
    "torch",
    "pygame",
    "matplotlib",
    "stable_baselines3",
    "serial",
    "rich",
    "ray",
    "filterpy",
    "onnx",
    "onnxruntime",
    "mcap",
    "rerun",
)


@pytest.mark.parametrize(
    "module", ["tracking", "relpos_env", "relpos_env.formation_v0", "agents", "agents.cli.main",
               "hardware_bridge"]
)  # fmt: skip
def test_imports_nothing_heavy(module):
    code = f"import sys, {module}; print([m for m in {HEAVY!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("package", ["tracking", "relpos_env", "agents", "hardware_bridge"])
def test_every_exported_name_exists_and_is_in_the_reference(package):
    exported = import_module(package)
    page = (ROOT / "docs" / "reference" / "api.md").read_text()
    for name in exported.__all__:
        if name == "FormationVecEnv" and find_spec("stable_baselines3") is None:
            continue
        thing = getattr(exported, name)
        shown = getattr(thing, "__name__", name)
        shown = "formation_v0.parallel_env" if name == "formation_v0" else shown
        assert f"{shown}\n" in page or f".{name}\n" in page, name
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = exported.no_such_name


@pytest.mark.parametrize("script", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.name)
def test_examples_run(script, tmp_path):
    if script.stem == "train_with_sb3" and find_spec("stable_baselines3") is None:
        pytest.skip("stable-baselines3 is not installed")
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def test_no_file_is_long():
    for package in ("tracking", "relpos_env", "agents", "hardware_bridge"):
        for path in (ROOT / package).rglob("*.py"):
            assert len(path.read_text().splitlines()) <= 300, path


def test_links_between_documents_resolve():
    import re

    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), (page.name, target)


def test_another_package_called_agents_is_named(tmp_path):
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").write_text("")
    code = "import sys; sys.path.insert(0, '.'); from hardware_bridge.command import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 2
    assert str(tmp_path / "agents") in done.stderr
    assert "Traceback" not in done.stderr


def test_the_entry_point_runs_the_command_line():
    code = (
        "import sys; from hardware_bridge.command import main; sys.argv = ['relpos', '-h']; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "Track and evaluate" in done.stdout
