"""A file of named arrays: MATLAB (.mat), NumPy (.npz) or a pickle of a dictionary (.pkl)."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.convert.sources import Get, Record
from agents.errors import UsageError

ALLOWED = {
    ("_codecs", "encode"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    *((f"numpy.{core}.multiarray", name) for core in ("core", "_core")
      for name in ("_reconstruct", "scalar")),
    *((f"numpy.{core}.numeric", "_frombuffer") for core in ("core", "_core")),
}  # fmt: skip
"""Functions that a pickle of arrays may call; any other could run untrusted code."""


class Arrays:
    """Source with arrays as streams and their rows as records.

    A field is a path of indices: ``3``, or ``2.0`` for row[2, 0]. A path that begins with the name
    of an array reads the same row of that array: ``imu_ori.2``. A path with fewer indices than
    axes returns an array.
    """

    def __init__(self, path: Path, time: str) -> None:
        """Read the file.

        Args:
            path: File whose ending is .mat, .npz, .pkl or .pickle.
            time: Column with the time [s]; empty if the mapping gives rates.

        Raises:
            UsageError: The file cannot be read or holds no arrays of numbers.
        """
        try:
            found = _load(path)
        except Exception as error:  # readers raise various errors for damaged files
            raise UsageError(f"{path}: no arrays that can be read ({error})") from error
        self._arrays: dict[str, NDArray[Any]] = {
            name: array
            for name, value in found.items()
            if (array := np.asarray(value)).ndim and array.dtype.kind in "biuf"
        }
        self._time = time
        if not self._arrays:
            raise UsageError(f"{path}: expected arrays of numbers by their names, found none")

    def names(self) -> list[str]:
        """Return the names of the arrays."""
        return list(self._arrays)

    def records(self, names: list[str]) -> Iterator[Record]:
        """Yield rows, array after array."""
        for name in names:
            for k in range(len(self._arrays[name])):
                get = self._getter(name, k)
                yield Record(name, k, float(get(self._time)) if self._time else np.nan, get)

    def close(self) -> None:
        """Do nothing: no file stays open."""

    def _getter(self, name: str, row: int) -> Get:
        def get(path: str) -> Any:
            first, *rest = path.split(".")
            other = first in self._arrays
            try:
                value = self._arrays[first if other else name][row]
                for index in rest if other else (first, *rest):
                    value = value[int(index)]
            except (IndexError, ValueError, TypeError):
                raise KeyError(path) from None
            return value

        return get


def _load(path: Path) -> dict[str, Any]:
    if path.suffix == ".mat":
        from scipy.io import loadmat

        return dict(loadmat(path))
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    if path.suffix in (".pkl", ".pickle"):
        with path.open("rb") as stream:
            found = _ArraysOnly(stream, encoding="latin1").load()
        if isinstance(found, dict):
            return {str(name): value for name, value in found.items()}
        raise ValueError("expected a dictionary")
    raise ValueError("expected .mat, .npz, .pkl or .pickle")


class _ArraysOnly(pickle.Unpickler):
    """Unpickler that only allows arrays and plain containers."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in ALLOWED:
            raise pickle.UnpicklingError(f"holds {module}.{name}, which is no array of numbers")
        return super().find_class(module, name)
