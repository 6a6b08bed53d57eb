"""Machine code in files of its own: the same bits as through numba, and nothing for what could not run without it."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from enum import IntEnum
from math import exp, tan
from threading import Barrier
from time import sleep
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

from patchfem.compiled import KernelModule, jit, load, machine


class Inner(NamedTuple):
    places: np.ndarray
    scale: float


class Outer(NamedTuple):
    first: np.ndarray
    inner: Inner
    count: int
    grid: np.ndarray


class Column(IntEnum):
    FORCE = 0
    SLIDE = 1


def weighed(first, outer, step, out):
    """Sums with calls of the C library in them; writes, counts and returns one of each kind."""
    total = 0.0
    for i in range(outer.count):
        total += exp(-outer.inner.places[i] * outer.inner.scale) * tan(outer.first[i])
        for j in range(outer.grid.shape[1]):
            total += outer.grid[i, j] * step
        out[i] = total
    return outer.count + first, (total, outer.inner.places.size)


def filled(out, value):
    for i in range(out.size):
        out[i] = value


def refusing(value):
    if value < 0:
        raise ValueError("negative")
    return value * 2


def above(value, out):
    out[0] = value
    return value > 1


def lengthened(count):
    return np.zeros(count).size


def some_arguments():
    rng = np.random.default_rng(3)
    grid = rng.normal(size=(9, 14))[::2, 1::3]  # neither rows nor columns lie together
    return 3, Outer(rng.normal(size=5), Inner(rng.normal(size=7), 0.7), 5, grid), 1e-3, np.zeros(5)


def kept(path, function, *arguments):
    """(what numba answers, the function read back from its file or None)."""
    made = njit(error_model="numpy", _nrt=function is lengthened)(function)
    answer = made(*arguments)
    return answer, machine.load_file(path) if machine.store_code(path, made, arguments) else None


def words_of(*arguments) -> bytes:
    words = machine.ArgumentConverter()
    return b"".join(words.convert(one)[1] for one in arguments)


@pytest.fixture(scope="module")
def weighing(tmp_path_factory):
    path = tmp_path_factory.mktemp("code") / "weighed.code"
    given = some_arguments()
    made = njit(error_model="numpy", _nrt=False)(weighed)
    answer = made(*given)
    assert machine.store_code(path, made, given)
    return path, given, answer, machine.load_file(path), made


def test_exact_the_same_bits_from_the_file(weighing):
    _, (first, outer, step, out), answer, code, made = weighing
    mine = np.zeros(5)
    assert code(words_of(first, outer, step, mine)) == answer == (8, (answer[1][0], 7))
    assert np.array_equal(mine, out) and answer[1][0] == out[-1] != 0
    # other words, not those of the first call
    other = outer._replace(count=2, inner=Inner(-outer.inner.places, 1.5))
    assert (
        code(words_of(-1, other, 2.0, mine))
        == made(-1, other, 2.0, np.zeros(5))
        == (1, (mine[1], 7))
    )
    assert mine[1] == pytest.approx(weighed(-1, other, 2.0, out)[1][0], rel=1e-13)


def test_exact_tuples_are_taken_by_their_address(weighing, tmp_path):
    """Numbers, arrays of each layout and a tuple inside are read where they lie, those of each call; a function inside
    is given the address as well."""
    _, (first, outer, step, _), answer, _, made = weighing
    within = jit.njit(error_model="numpy", _nrt=False)(weighed)

    @jit.njit(error_model="numpy", _nrt=False)
    def called(first, outer, step, out):
        return within(first, outer, step, out)

    for function in (within, called):
        code = machine.compile_and_store(
            tmp_path / "a.code", function, (first, outer, step, np.zeros(5)), jit.compile_optimised
        )
        mine = np.zeros(5)
        assert code(words_of(first, outer, step, mine)) == (8, (mine[-1], 7))
        assert mine[-1] == pytest.approx(answer[1][0], rel=1e-14)
        other = outer._replace(
            first=2 * outer.first, count=2, inner=Inner(-outer.inner.places, 1.5)
        )
        theirs = np.zeros(5)
        assert code(words_of(-1, other, 2.0, mine))[0] == made(-1, other, 2.0, theirs)[0] == 1
        assert mine[:2] == pytest.approx(theirs[:2], rel=1e-14)
    [taken] = within.overloads.values()  # for `called`
    assert taken.signature.args[1].tuple_type.fields == Outer._fields


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[:-1],
        lambda text: text[:40],
        lambda text: b"",
        lambda text: b"{}\n" + text,
        lambda text: text[:-9] + bytes([text[-9] ^ 1]) + text[-8:],
        lambda text: text.replace(b'"tan"', b'"tam"'),
        lambda text: text.replace(b'"tan"', b'"PyErr_Clear"'),
    ],
    ids=["cut", "cut early", "empty", "no head", "one bit", "no such function", "Python's"],
)
def test_refuses_a_damaged_file(weighing, tmp_path, damage):
    text = weighing[0].read_bytes()
    assert json.loads(text.partition(b"\n")[0])["calls"] == ["tan"]
    (tmp_path / "a.code").write_bytes(damage(text))
    assert machine.load_file(tmp_path / "a.code") is None
    assert machine.load_file(tmp_path / "none.code") is None


def test_exact_nothing_returned_and_what_was_raised(tmp_path):
    out = np.zeros(3)
    answer, code = kept(tmp_path / "filled.code", filled, out, 2.5)
    other = np.zeros(4)
    assert code(words_of(other, -1.5)) is answer is None and other.tolist() == [-1.5] * 4
    answer, code = kept(tmp_path / "refusing.code", refusing, 2.0)
    assert answer == code(words_of(2.0)) == 4.0
    with pytest.raises(RuntimeError, match="status"):
        code(words_of(-1.0))


def test_exact_yes_and_no(tmp_path):
    out = np.zeros(1)
    answer, code = kept(tmp_path / "above.code", above, 2.0, out)
    assert answer is True is code(words_of(3.0, out))
    assert code(words_of(1.0, out)) is False
    assert out[0] == 1


def test_refuses_what_numba_alone_can_run(tmp_path):
    assert kept(tmp_path / "a.code", lengthened, 3) == (3, None)  # it allocates
    for unfit in (True, "text", 1j, [1.0], None, np.float32(1), (1.0, None)):
        with pytest.raises(machine.UnsupportedError):
            machine.ArgumentConverter().convert(unfit)
    made = njit(refusing)
    made(1.0)
    # nowhere to write to
    assert not machine.store_code(tmp_path / "none" / "folder" / "a.code", made, (1.0,))
    assert not machine.store_code(tmp_path / "a.code", made, (1,))  # never compiled for these
    assert not list(tmp_path.iterdir())


def test_always_kinds_tell_types_apart():
    words = machine.ArgumentConverter()
    grid = np.zeros((4, 4))
    still = np.zeros(4)
    still.flags.writeable = False
    kinds = [
        words.convert(one)[0]
        for one in (
            1.0,
            1,
            grid,
            grid.T,
            grid[::2, ::2],
            grid[0],
            grid.astype(np.float32),
            still,
            (1.0, 1),
            (1, 1),
            Inner(grid[0], 1.0),
            (),
        )
    ]
    assert kinds[3] == "<f82C"[:-1] + "F" and len(set(kinds)) == len(kinds)
    assert words.convert(np.float64(1.0)) == words.convert(1.0) and words.convert(
        np.int64(7)
    ) == words.convert(7)


def test_always_a_tuple_is_remembered_as_itself(weighing):
    """Tuples come and go at the same addresses; one that is remembered is kept alive, so none is taken for another."""
    _, (first, outer, step, _), _, code, made = weighing
    words = machine.ArgumentConverter()
    mine = np.zeros(5)
    for k in range(20):
        other = outer._replace(inner=Inner(outer.inner.places * k, 0.1 * k))
        row = b"".join(words.convert(one)[1] for one in (first, other, step, mine))
        assert code(row) == made(first, other, step, np.zeros(5))
    assert len(words.known_tuples) <= machine.MAX_CACHED_TUPLES


def test_exact_constants_are_read_without_the_module(tmp_path):
    path = tmp_path / "some_kernels.py"
    path.write_text(
        '"""Text."""\nimport nothing_there\nSTILL, MOVES = 0, 1\nNAME = "a"\nFAR = 1e-3\n'
        "WIDE = -FAR * (2 + MOVES)\nHALF = 2.0 ** -(MOVES - 2 * STILL) / +1\nPLACES = (MOVES, (NAME, -2))\n"
        "LEFT, RIGHT = range(MOVES + 1)\nUP, = range(STILL + 5, 6)\n"
        "OTHER = len(NAME)\nWORSE = [missing.remove() for missing in NAME]\n"
    )
    brought = []
    module = KernelModule("patchfem.some_kernels", path, lambda: brought.append(1))
    assert (module.STILL, module.MOVES, module.NAME, module.FAR, module.WIDE) == (
        0,
        1,
        "a",
        1e-3,
        -3e-3,
    )
    assert (module.HALF, module.PLACES) == (0.5, (1, ("a", -2)))
    assert (module.LEFT, module.RIGHT, module.UP) == (0, 1, 5)
    assert not brought
    with pytest.raises(AttributeError):
        module.OTHER  # noqa: B018
    assert brought


MOTIONS = """
import json, sys
import patchfem as pf
from patchfem import compiled
compiled.MAX_PYTHON_SECONDS = -1.0
rig = '[normal]\\nload = "40 N"\\n[friction]\\nlaw = "LAW"\\nstatic = 0.3\\nMORE\\n' \\
    '[structure]\\nmoving_mass = "1 kg"\\n' \\
    '[[structure.mode]]\\nname = "a"\\nfrequency = "100 Hz"\\ndamping = 0.01\\nslide = 1.0\\n' \\
    '[drive]\\nkind = "base"\\nfrequency = "90 Hz"\\nacceleration = "5 g"\\ncycles = 2\\n'
out = []
for law, more in (("coulomb", ""), ("elastic-plastic", 'bond_length = "2 um"'), ("nonlocal", 'bond_length = "5 um"')):
    found = pf.run(rig.replace("LAW", law).replace("MORE", more))
    out.append([found.measures[name].value for name in ("slip_amplitude", "friction_work")])
print(json.dumps([out, "numba" in sys.modules]))
"""


def test_always_threads_that_call_first_at_once_bring_code_once(monkeypatch):
    """Two that loaded the same function at once ended the process in 1 of 2 first sweeps of Iwan cases."""
    entry = kernels_of_its_own("dynamics.events.series_kernels").find_highest_power
    brought = []
    at_once = Barrier(2)

    def slow(path):
        brought.append(path)
        sleep(0.05)
        return lambda words: 7.0

    monkeypatch.setattr(machine, "load_file", slow)

    def call(_):
        at_once.wait()
        return entry(1.5)

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(call, range(2))) == [7.0, 7.0]
    assert len(brought) == 1


def kernels_of_its_own(module: str) -> KernelModule:
    """The kernel module of which nothing has been called yet."""
    known = load(module)
    return KernelModule(known.__name__, known._source, known._importer)


def test_exact_without_compiled_code_the_same_motions(monkeypatch):
    """Numba's own switch makes every kernel the Python that it is written in, and no index leaves its array."""
    answers = []
    for switch in "0", "1":
        monkeypatch.setenv("NUMBA_DISABLE_JIT", switch)
        done = subprocess.run(
            [sys.executable, "-c", MOTIONS], capture_output=True, text=True, timeout=300, check=True
        )
        answers.append(json.loads(done.stdout))
    (compiled, _), (plain, numba) = answers
    assert numba and all(np.ravel(compiled))
    np.testing.assert_allclose(plain, compiled, rtol=1e-9)


def compare_members(table):
    total = 0.5 if Column.SLIDE > 0.5 else 0.0
    for i in range(Column.FORCE, Column.SLIDE + 1):
        table[Column.SLIDE, i] = Column.SLIDE
        total += table[i, Column.SLIDE]
    return total


def test_members_of_an_integer_enum_are_integers_in_kernels():
    """Kernels compare members with floats and store them in arrays of floats, which numba alone rejects."""
    compiled_table, table = np.zeros((2, 2, 2))
    result = jit.njit(cache=False)(compare_members).get_standalone()(compiled_table)
    assert result == compare_members(table) == 1.5
    np.testing.assert_array_equal(compiled_table, table)
