"""Check that everything imports with the lowest versions that pyproject.toml admits.

Without an argument it prints those versions, one per line. With ``import`` it imports every
module; modules that lack the package of an extra are skipped.
"""

import re
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

ROOT = Path(__file__).parent.parent
PACKAGES = ("tracking", "relpos_env", "agents", "hardware_bridge")


def lowest() -> list[str]:
    """Return ``name==version`` of each dependency outside the extras."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return [re.sub(r">=([\w.]+).*", r"==\1", each) for each in project["dependencies"]]


def missing_extras() -> set[str]:
    """Import all modules, and return the missing packages of extras.

    Raises:
        ImportError: A module cannot be imported, or lacks a package outside the extras.
    """
    ours = {each.partition("==")[0].replace("-", "_") for each in lowest()} | set(PACKAGES)
    missing = set()
    paths = [str(ROOT / name) for name in PACKAGES]
    for path, package in zip(paths, PACKAGES, strict=True):
        for module in walk_packages([path], f"{package}."):
            if "__main__" in module.name:
                continue
            try:
                import_module(module.name)
            except ModuleNotFoundError as error:
                name = (error.name or "").partition(".")[0]
                if not name or name in ours:
                    raise
                missing.add(name)
    return missing


if __name__ == "__main__":
    if sys.argv[1:] == ["import"]:
        sys.path.insert(0, str(ROOT))
        print("imported; not there:", ", ".join(sorted(missing_extras())))
    else:
        print("\n".join(lowest()))
