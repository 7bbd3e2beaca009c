"""The decorator of every compiled kernel.

Numba keeps compiled code on disk and compiles a function anew when *its* file changes. A
kernel that calls kernels of other files has their code compiled in, so here it is compiled
anew when any kernel file of its package or of this one changes.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

from numba import config, njit, typeof

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function with numba, without the interpreter, and keep the result on disk.

    It holds no lock of the interpreter, so several threads can run kernels at a time. It makes no
    arrays, only views of those it is given: so nobody counts who holds which, which costs atomic
    operations wherever an array is named.
    """
    return _compile(function)


def allocating_kernel(function: Function) -> Function:
    """A kernel that makes arrays of its own: what runs now and then, not for every measurement.

    It counts who holds them. So it must not take an array that a plain kernel returns, which
    nobody has counted.
    """
    return _compile(function, nrt=True)


def small_kernel(function: Function) -> Function:
    """A kernel whose code is put in place of every call: calls with many arrays are not free."""
    return _compile(function, inline=True)


def bind(kernel: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """A kernel that is called again and again with the same arguments: arrays filled anew.

    Finding out the types of many arrays takes longer than most kernels do. Here that is done
    once, and the compiled code is then called without a look at them.

    Args:
        kernel: To call.
        arguments: Everything it takes.
    """
    if config.DISABLE_JIT:
        return partial(kernel, *arguments)
    compiled: Any = kernel
    entry = compiled.compile(tuple(typeof(argument) for argument in arguments))
    return partial(entry, *arguments)


def _compile(function: Function, *, inline: bool = False, nrt: bool = False) -> Function:
    compiled = njit(
        cache=True,
        nogil=True,
        error_model="numpy",
        forceinline=inline,
        _nrt=nrt,
    )(function)
    if not config.DISABLE_JIT:
        package = function.__module__.partition(".")[0]
        # A kernel of a script has no package, only its own file, whose stamp numba has.
        parents = Path(inspect.getfile(function)).parents
        folder = next((p for p in parents if p.name == package), Path(__file__).parent)
        index = compiled._cache._cache_file
        index._source_stamp = (index._source_stamp, _stamp(folder))
        index._load_index = _tolerant(index._load_index)
        index.load, index.save = _labelled(index)
    return compiled  # type: ignore[no-any-return]


def _tolerant(load: Callable[[], Any]) -> Callable[[], Any]:
    """An index that names classes which have moved since is as good as none."""

    def load_or_start_anew() -> Any:
        try:
            return load()
        except (AttributeError, ImportError):
            return {}

    return load_or_start_anew


def _labelled(index: Any) -> tuple[Callable[[Any], Any], Callable[[Any, Any], None]]:
    """How an index loads and saves code that says what it was compiled from, and for which types.

    Its files are numbered. Where several processes compile at a time, one can find under a number
    what another has saved for other types, or what is left from before a change.
    """
    load, save = index.load, index.save

    def load_own(key: Any) -> Any:
        found = load(key)
        is_own = found is not None and found[0] == (index._source_stamp, key)
        return found[1] if is_own else None

    def save_labelled(key: Any, data: Any) -> None:
        save(key, ((index._source_stamp, key), data))

    return load_own, save_labelled


@cache
def _stamp(folder: Path) -> tuple[int, int]:
    """Changes when a kernel file under the folder or this one's does: newest time, and a sum."""
    folders = {folder, Path(__file__).parent}
    stats = [path.stat() for f in sorted(folders) for path in sorted(f.rglob("_*_kernels.py"))]
    return max(s.st_mtime_ns for s in stats), sum(s.st_mtime_ns + s.st_size for s in stats)
