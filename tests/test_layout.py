"""Sizes and descriptions of folders, and import cycles."""

import re
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("tracking", "relpos_env", "agents", "hardware_bridge")
MOST_FILES = 15


def folders():
    for package in PACKAGES:
        for folder in [ROOT / package, *(ROOT / package).rglob("*")]:
            if folder.is_dir() and any(folder.glob("*.py")):
                yield folder


@pytest.mark.parametrize("folder", list(folders()), ids=lambda f: f.relative_to(ROOT).as_posix())
def test_a_folder_has_few_files_and_says_what_it_is(folder):
    modules = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
    assert len(modules) <= MOST_FILES
    text = (folder / "__init__.py").read_text()
    assert text.startswith('"""')


def test_no_modules_import_each_other():
    """Imports for type checkers count as well."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    waiting = {m: set(graph.find_modules_directly_imported_by(m)) for m in graph.modules}
    while waiting:
        free = {m for m, needs in waiting.items() if not needs & waiting.keys()}
        assert free, f"cycle among {sorted(waiting)}"
        waiting = {m: needs for m, needs in waiting.items() if m not in free}


def test_packages_tell_type_checkers_that_they_are_typed():
    for package in PACKAGES:
        assert (ROOT / package / "py.typed").exists()


def test_unit_tests_of_tracking_import_no_other_package():
    others = re.compile(
        r"^\s*(?:from|import) (?:agents|relpos_env|hardware_bridge|benchmarks)\b", re.M
    )
    for path in (ROOT / "tests" / "tracking").rglob("*.py"):
        assert not others.search(path.read_text(encoding="utf-8")), path
