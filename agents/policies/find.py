"""Search for the two files of a policy, and safe reading of untrusted files."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from agents.policies.errors import PolicyError

SHIPPED = Path(__file__).with_name("shipped")
"""Folder of the package's policies, which are found by name."""
PICKLES = (".zip", ".pkl", ".pickle", ".pt", ".pth", ".ckpt", ".joblib", ".npy", ".npz")
"""Suffixes of trainers' files, which may execute code when they are loaded."""
UNSAFE = "may execute code when it is loaded and is not opened; use `relpos export`"
MOST_NETWORK = 50 << 20
"""[byte] Maximum size of a network."""
MOST_CARD = 1 << 20
"""[byte] Maximum size of a card."""


def shipped_names() -> list[str]:
    """Return the names of the policies of the package."""
    return sorted(path.stem for path in SHIPPED.glob("*.onnx"))


def find_policy(name_or_path: str | Path) -> tuple[Path, Path]:
    """Return the paths of the network and the card of a policy.

    Args:
        name_or_path: One of the two files, a folder with one policy, or the name of a shipped one.

    Raises:
        PolicyError: There is no such policy, or a file of another type.
    """
    if str(name_or_path) in shipped_names():
        return _pair(SHIPPED / f"{name_or_path}.onnx")
    path = Path(name_or_path)
    suffix = path.suffix.lower()
    if suffix in PICKLES:
        raise PolicyError(path, UNSAFE)
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError as error:
        names = ", ".join(shipped_names()) or "none"
        reason = f"no such file or folder, and no policy of that name (there are: {names})"
        raise PolicyError(path, reason) from error
    except (OSError, ValueError) as error:
        raise PolicyError(path, f"cannot be read ({_why(error)})") from error
    if stat.S_ISDIR(mode):
        return _pair(_only_one(path))
    if suffix not in (".onnx", ".json"):
        raise PolicyError(path, "expected a file .onnx or .json, a folder or a name")
    return _pair(path)


def read_bounded(path: Path, most: int) -> bytes:
    """Return the content of a regular file.

    Raises:
        PolicyError: Not a regular file, not readable, or larger than `most` bytes.
    """
    try:
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        number = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
        with open(number, "rb") as file:
            if not stat.S_ISREG(os.fstat(number).st_mode):
                raise PolicyError(path, "expected an ordinary file")
            data = file.read(most + 1)
    except FileNotFoundError as error:
        raise PolicyError(path, "no such file; a policy is name.onnx and name.json") from error
    except (OSError, ValueError) as error:
        raise PolicyError(path, f"cannot be read ({_why(error)})") from error
    if len(data) > most:
        raise PolicyError(path, f"expected at most {most >> 20} MiB")
    return data


def _only_one(folder: Path) -> Path:
    try:
        names = sorted(p.name for p in folder.iterdir() if p.suffix == ".onnx")
    except OSError as error:
        raise PolicyError(folder, f"cannot be read ({_why(error)})") from error
    if len(names) != 1:
        found = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
        raise PolicyError(folder, f"expected one policy in the folder, got {found or 'none'}")
    return folder / names[0]


def _pair(path: Path) -> tuple[Path, Path]:
    return path.with_suffix(".onnx"), path.with_suffix(".json")


def _why(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
