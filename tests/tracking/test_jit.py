"""Cache of compiled code on disk."""

import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba import config, typeof
from numba.core.errors import TypingError

from tracking.kernels.addresses import by_reference
from tracking.kernels.jit import kernel, small_kernel, type_of

KERNEL = """
from tracking.kernels.jit import kernel


@kernel
def double(x):
    return 2 * x
"""


def run(folder, call, module="_double_kernels"):
    done = subprocess.run(
        [sys.executable, "-c", f"from {module} import *; print({call})"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_code_under_another_number_is_not_taken_for_what_it_is_not(tmp_path):
    """Processes that compile at the same time for other types can leave such a cache."""
    (tmp_path / "_double_kernels.py").write_text(KERNEL)
    assert run(tmp_path, "double(1), double(1.5)") == "2 3.0"
    first, second = sorted((tmp_path / "__pycache__").glob("*.nbc"))
    kept = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(kept)
    assert run(tmp_path, "double(1), double(1.5)") == "2 3.0"
    # The code compiled in its place is found the next time.
    compiled = "double(1), double(1.5), sum(double.stats.cache_hits.values())"
    assert run(tmp_path, compiled) == "2 3.0 2"


def results(folder, call="double(1)"):
    """Return the result of a call in a process of its own, and the number of cache hits."""
    return run(folder, f"{call}, sum(double.stats.cache_hits.values())")


@pytest.fixture
def folder(tmp_path):
    """Write a kernel that calls a kernel of another file, which uses a constant of a third."""
    (tmp_path / "sizes.py").write_text("FACTOR = 2\nOTHER = 1\n")
    (tmp_path / "_times_kernels.py").write_text(
        "from sizes import FACTOR\nfrom tracking.kernels.jit import kernel\n\n\n"
        "@kernel\ndef times(x):\n    return FACTOR * x\n"
    )
    (tmp_path / "_double_kernels.py").write_text(
        "from _times_kernels import times\nfrom tracking.kernels.jit import kernel\n\n\n"
        "@kernel\ndef double(x):\n    return times(x)\n"
    )
    return tmp_path


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_a_changed_constant_of_any_file_compiles_again(folder):
    assert results(folder) == "2 0"
    assert results(folder) == "2 1"
    (folder / "sizes.py").write_text("FACTOR = 3\nOTHER = 1\n")
    assert results(folder) == "3 0"


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_a_changed_kernel_of_another_file_compiles_its_callers_again(folder):
    assert results(folder) == "2 0"
    text = (folder / "_times_kernels.py").read_text()
    (folder / "_times_kernels.py").write_text(text.replace("FACTOR * x", "FACTOR * x + 1"))
    assert results(folder) == "3 0"


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_what_is_not_compiled_in_compiles_nothing_again(folder):
    """Change other constants, comments, docstrings, lines above, times of files."""
    assert results(folder) == "2 0"
    (folder / "sizes.py").write_text("FACTOR = 2\nOTHER = 5\n")
    for name in ("_times_kernels.py", "_double_kernels.py"):
        text = (folder / name).read_text()
        text = text.replace("):\n", '):\n    """What it does."""\n')
        (folder / name).write_text("# A comment.\n" + text)
    assert results(folder) == "2 1"


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize("damage", ["moved class", "cut index", "cut data", "no data"])
def test_a_cache_that_cannot_be_read_is_replaced(folder, damage):
    assert results(folder) == "2 0"
    pattern = "*.nbc" if "data" in damage else "*.nbi"
    for path in (folder / "__pycache__").glob(pattern):
        if damage == "no data":
            path.unlink()
        elif damage == "moved class":
            # A pickle of a name that no longer exists.
            for cached in (folder / "__pycache__").glob("*.nbc"):
                cached.write_bytes(b"cnumba\nwas_here_once\n.")
        else:
            path.write_bytes(path.read_bytes()[:-20])
    assert results(folder) == "2 0"
    assert results(folder) == "2 1"


RECORDS = """
import numpy as np

from tracking.kernels.jit import small_kernel


@small_kernel
def last_field(record):
    return record.b


@small_kernel
def last_field_later(record):
    return last_field(record)


first = np.array([(1.0, 2.0)], [("a", "f8"), ("b", "f8")])[0]
second = np.array([(1.0, 2.0, 3.0)], [("a", "f8"), ("c", "f8"), ("b", "f8")])[0]
"""


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_functions_of_different_records_have_different_names_in_all_processes(tmp_path):
    """One process compiles for one record, a second for the other, a third calls both."""
    (tmp_path / "_record_kernels.py").write_text(RECORDS)

    def call(expression):
        return run(tmp_path, expression, "_record_kernels")

    assert call("last_field_later(first)") == "2.0"
    assert call("last_field_later(second)") == "3.0"
    assert call("last_field_later(first), last_field_later(second)") == "2.0 3.0"


class Pair(NamedTuple):
    a: object
    b: object


def of_types():
    plain = np.zeros((3, 4))
    fixed = plain.copy()
    fixed.flags.writeable = False
    record = np.dtype([("x", np.float64), ("n", np.int8)])
    aligned = np.dtype([("x", np.float64), ("n", np.int8)], align=True)
    arrays = [
        plain, plain.T, plain[:, ::2], plain[0], plain[:1, :1], fixed, plain.astype(np.float32),
        np.zeros(3, record), np.zeros(3, aligned), np.zeros(24, np.uint8)[1:17].view(np.float64),
    ]  # fmt: skip
    numbers = [True, 1, -1, 1 << 30, -(1 << 31), 1 << 40, (1 << 62) + 1, (1 << 63) + 1, 1.5]
    numbers += [np.float64(1.0), np.float32(1.0), np.int64(3), np.bool_(True), None]
    rest = [(plain, 1), (plain, 1 << 40), Pair(plain, fixed), Pair(fixed, plain), ("a", plain), ()]
    return [*arrays, *numbers, *rest]


def test_remembered_types_are_those_of_numba():
    for _ in range(2):
        for value in of_types():
            assert type_of(value) == typeof(value), value


@kernel
def scaled(x, h):
    return 2.0 * x[h]


@small_kernel
def plus_one(x, h):
    return scaled(x, h) + 1.0


@kernel
def both(x):
    worst = -1
    for h in range(2):
        worst = h
    return plus_one(x, 0) + plus_one(x, worst)


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_a_kernel_is_compiled_once_for_constants_and_variables():
    assert both(np.array([1.0, 2.0])) == 8.0
    assert len(scaled.signatures) == 1
    assert len(plus_one.signatures) <= 1  # none if the caller comes from the disk


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_a_kernel_is_called_and_a_small_one_is_linked_in():
    """If this fails with another numba, the parts that `compile_units` overrides have changed."""
    both(np.zeros(2))
    (unit,) = (compiled.library for compiled in both.overloads.values())
    assert [called.key[0][1] for called in unit.calls] == ["scaled"]
    defined = " ".join(unit.defined_names())
    assert "both" in defined
    assert "scaled" not in defined


@kernel
def sum_of(s):
    a = s.a
    total = 0.0
    for k in range(a.shape[0]):
        total += a[k] * s.b[0]
    s.b[1] = total
    return total


@kernel
def sum_by_reference(s):
    return sum_of(by_reference(s))


def test_tuples_by_reference_are_read_and_written_as_they_are():
    s = Pair(np.arange(4.0), np.array([2.0, 0.0]))
    assert sum_by_reference(s) == sum_of(s) == s.b[1] == 12.0


@kernel
def missing_field(s):
    return by_reference(s).c


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_a_field_that_there_is_not_is_a_typing_error():
    with pytest.raises(TypingError, match="Unknown attribute 'c'"):
        missing_field(Pair(np.zeros(1), np.zeros(1)))
