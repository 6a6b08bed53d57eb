"""Machine code stored in files gives the same bits as numba; code that cannot run without numba is refused."""

import json
import subprocess
import sys
from enum import IntEnum
from math import exp, tan
from typing import NamedTuple

import numpy as np
import pytest
from scene_texts import PLASTIC, POINT, STRUCTURE

import patchfem as pf
from patchfem.kernel_cache import jit, machine


class Inner(NamedTuple):
    """Argument tuple that is nested in another one."""

    places: np.ndarray
    scale: float


class Outer(NamedTuple):
    """Argument tuple with arrays of two layouts, a count and a nested tuple."""

    first: np.ndarray
    inner: Inner
    count: int
    grid: np.ndarray


class Column(IntEnum):
    """Columns of a table of floats."""

    FORCE = 0
    SLIDE = 1


def weighted_sum(first, outer, step, out):
    """Write weighted sums that call the C library into `out`; return a count and a total."""
    total = 0.0
    for i in range(outer.count):
        total += exp(-outer.inner.places[i] * outer.inner.scale) * tan(outer.first[i])
        for j in range(outer.grid.shape[1]):
            total += outer.grid[i, j] * step
        out[i] = total
    return outer.count + first, total


def fill(out, value):
    """Fill an array with a value and return nothing."""
    for i in range(out.size):
        out[i] = value


def double_positive(value):
    """Return twice the value, or raise ValueError if it is negative."""
    if value < 0:
        raise ValueError("negative")
    return value * 2


def allocated_size(count):
    """Return the size of a newly allocated array."""
    return np.zeros(count).size


def make_arguments():
    """Return arguments of `weighted_sum` with a grid whose rows and columns are not contiguous."""
    rng = np.random.default_rng(3)
    grid = rng.normal(size=(9, 14))[::2, 1::3]  # neither rows nor columns are contiguous
    return 3, Outer(rng.normal(size=5), Inner(rng.normal(size=7), 0.7), 5, grid), 1e-3, np.zeros(5)


def store_code(path, function, arguments) -> bool:
    """Compile a function into a file, and return whether it can be stored."""
    return machine.compile_function(path, function, arguments, jit.compile_unoptimised) is not None


def compile_and_reload(path, function, *arguments):
    """Return the result of numba, and the function read back from its file or None."""
    made = jit.njit(error_model="numpy", _nrt=function is allocated_size)(function)
    answer = made(*arguments)
    return answer, machine.load_file(path) if store_code(path, made, arguments) else None


def pack_arguments(*arguments) -> bytes:
    """Return the arguments as the machine words of a call."""
    return b"".join(machine.convert_argument(one)[1] for one in arguments)


@pytest.fixture(scope="module")
def stored_sum(tmp_path_factory):
    """Return path, arguments, result and both versions of the stored function `weighted_sum`."""
    path = tmp_path_factory.mktemp("code") / "weighed.code"
    given = make_arguments()
    made = jit.njit(error_model="numpy", _nrt=False)(weighted_sum)
    answer = made(*given)
    assert store_code(path, made, given)
    return path, given, answer, machine.load_file(path), made


def test_exact_stored_code_gives_same_bits(stored_sum):
    """The function read from its file returns the same bits as numba's, also for other arguments."""
    _, (first, outer, step, out), answer, code, numba_sum = stored_sum
    result = np.zeros(5)
    assert code(pack_arguments(first, outer, step, result)) == answer == (8, out[-1])
    assert np.array_equal(result, out) and out[-1] != 0
    # arguments other than those of the first call
    other = outer._replace(count=2, inner=Inner(-outer.inner.places, 1.5))
    assert (
        code(pack_arguments(-1, other, 2.0, result))
        == numba_sum(-1, other, 2.0, np.zeros(5))
        == (1, result[1])
    )
    assert result[1] == pytest.approx(weighted_sum(-1, other, 2.0, out)[1], rel=1e-13)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[:-1],
        lambda text: text[:40],
        lambda text: b"",
        lambda text: b"{}\n" + text,
        lambda text: text[:-9] + bytes([text[-9] ^ 1]) + text[-8:],
        lambda text: text.replace(b'"name"', b'"game"'),
    ],
    ids=["cut", "cut early", "empty", "no head", "one bit", "no name"],
)
def test_refuses_damaged_code_file(stored_sum, tmp_path, damage):
    """A damaged or missing code file is not loaded."""
    text = stored_sum[0].read_bytes()
    (tmp_path / "a.code").write_bytes(damage(text))
    assert machine.load_file(tmp_path / "a.code") is None
    assert machine.load_file(tmp_path / "none.code") is None


@pytest.mark.parametrize("text", [b"", b"define void @a() { of a later version }", b"\xff"])
def test_refuses_portable_code_that_llvm_cannot_read(tmp_path, text):
    """Portable code without a header, or in a language that this version of LLVM does not know, is not loaded."""
    header = {"name": "a", "results": "", "is_tuple": False, "is_vectorised": False}
    assert machine.compile_for_this_cpu(tmp_path / "a.code", text) is None
    if text:
        portable = machine.join_file(header, text)
        assert machine.compile_for_this_cpu(tmp_path / "a.code", portable) is None
    assert not list(tmp_path.iterdir())


def test_exact_none_and_exceptions_are_passed_on(tmp_path):
    """A stored function without a return value returns None, and one that raises ends in RuntimeError."""
    out = np.zeros(3)
    answer, code = compile_and_reload(tmp_path / "filled.code", fill, out, 2.5)
    other = np.zeros(4)
    assert code(pack_arguments(other, -1.5)) is answer is None and other.tolist() == [-1.5] * 4
    answer, code = compile_and_reload(tmp_path / "refusing.code", double_positive, 2.0)
    assert answer == code(pack_arguments(2.0)) == 4.0
    with pytest.raises(RuntimeError, match="status"):
        code(pack_arguments(-1.0))


def test_refuses_code_that_needs_numba(tmp_path):
    """Functions that allocate and arguments of unsupported types are not stored."""
    assert compile_and_reload(tmp_path / "a.code", allocated_size, 3) == (
        3,
        None,
    )  # the function allocates memory
    for unsupported in (True, "text", 1j, [1.0], None, np.float32(1), (1.0, None)):
        with pytest.raises(machine.UnsupportedError):
            machine.convert_argument(unsupported)
    assert not list(tmp_path.iterdir())
    # The folder does not exist, but the function is compiled and loaded.
    assert store_code(tmp_path / "none/folder/a.code", jit.njit()(double_positive), (1.0,))
    assert not list(tmp_path.iterdir())


def test_always_argument_kinds_distinguish_types():
    """Arguments that differ in type, layout, precision or writability have different kinds."""
    grid = np.zeros((4, 4))
    read_only = np.zeros(4)
    read_only.flags.writeable = False
    kinds = [
        machine.convert_argument(one)[0]
        for one in (
            1.0,
            1,
            grid,
            grid.T,
            grid[::2, ::2],
            grid[0],
            grid.astype(np.float32),
            read_only,
            (1.0, 1),
            (1, 1),
            Inner(grid[0], 1.0),
            (),
        )
    ]
    assert len(set(kinds)) == len(kinds)
    for number, other in ((np.float64(1.0), 1.0), (np.int64(7), 7)):
        assert machine.convert_argument(number) == machine.convert_argument(other)


MEASURES = ("slip_amplitude", "friction_work")
MOTIONS = f"""
import json, sys
import patchfem as pf
found = pf.run(sys.argv[1], **{{"drive.cycles": 1}})
print(json.dumps([found.measures[name].value for name in {MEASURES}]))
"""


def test_exact_motions_agree_without_compilation(monkeypatch):
    """With NUMBA_DISABLE_JIT=1, where Python checks every index, a motion agrees with compiled code within 1e-8.

    Round-off changes the lengths of the steps, whose tolerance is larger.
    """
    scene = POINT + PLASTIC + STRUCTURE
    measures = pf.run(scene, **{"drive.cycles": 1}).measures
    compiled = [measures[name].value for name in MEASURES]
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    done = subprocess.run(
        [sys.executable, "-c", MOTIONS, scene], capture_output=True, text=True, check=True
    )
    assert all(compiled)
    np.testing.assert_allclose(json.loads(done.stdout), compiled, rtol=1e-8)


def sum_with_enum_indices(table):
    """Return a sum over a table that is indexed by members of an enumeration."""
    total = 0.5 if Column.SLIDE > 0.5 else 0.0
    for i in range(Column.FORCE, Column.SLIDE + 1):
        table[Column.SLIDE, i] = Column.SLIDE
        total += table[i, Column.SLIDE]
    return total


def test_exact_integer_enum_members_are_integers_in_kernels():
    """Members of an IntEnum can be compared with floats and stored in arrays of floats in a kernel.

    Numba alone rejects both.
    """
    compiled_table, table = np.zeros((2, 2, 2))
    result = jit.njit()(sum_with_enum_indices)(compiled_table)
    assert result == sum_with_enum_indices(table) == 1.5
    np.testing.assert_array_equal(compiled_table, table)
