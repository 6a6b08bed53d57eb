"""A march that takes long keeps its state on disk from time to time, from which it goes on to the same bits.

`keeping` says where for all marches within it, one file each by the order in which they begin. A march that ends sooner
than the first SECONDS writes nothing. What is kept are the arrays and numbers of the Run, which a fresh one takes over,
and the samples so far.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_atomically

SECONDS = 20.0  # between two states on disk
SHARE = 0.02  # of the time, at most, for writing them
CONSTANT = "periodic", "workspace"  # arrays that a fresh Run makes again, and room for a step
UNSET = ("sets",)  # arrays that a fresh Run has not filled yet
WITHOUT = "run without --resume"
_KEEPER = ContextVar("keeper", default=None)


class Keeper:
    """Where the marches of a run keep their states.

    path: number of a march -> its file; key: of what the run computes; resume: whether files that are there count.
    """

    def __init__(self, path, key: str, resume: bool):
        self.path = path
        self.key = key
        self.resume = resume
        self.begun = 0


@contextmanager
def keeping(keeper: Keeper | None) -> Iterator[None]:
    """Marches within keep their states as `keeper` says; None: they keep nothing."""
    token = _KEEPER.set(keeper)
    try:
        yield
    finally:
        _KEEPER.reset(token)


MOST_KEPT = 400_000  # samples kept outside the last cycles


class Samples:
    """What a march collects: last cycles, samples kept before them, their step numbers, extremes and phasors.

    again: the march has begun a second time, cycle by cycle; marks: of each mark passed the march as it stood, the
    cycles (first step, rows, work) and their extremes before it.
    """

    def __init__(self, last):
        self.last = last
        self.kept = []
        self.kept_at = []
        self.extremes = []
        self.phasors = []
        self.again = False
        self.marks = []

    @property
    def capacity(self) -> int:
        """Samples that may be kept yet before the last cycles."""
        return MOST_KEPT - sum(map(len, self.kept_at))

    def early(self, rows, numbers) -> None:
        """Keep samples from before the last cycles, with the numbers of their steps."""
        self.kept.append(rows)
        self.kept_at.append(numbers)

    def arrays(self) -> dict:
        """All of it as arrays by name."""
        out = _of_cycles("last", self.last, self.extremes)
        if self.kept:
            out |= {"kept": np.concatenate(self.kept), "kept_at": np.concatenate(self.kept_at)}
        for k, (run, cycles, extremes) in enumerate(self.marks):
            out |= _of_run(f"mark{k}.run", run) | _of_cycles(f"mark{k}", cycles, extremes)
        return out | {"phasors": np.array(self.phasors, complex), "again": np.array(self.again)}

    def take(self, found: dict, fresh) -> None:
        """Take over what `arrays` gave; fresh(): a march at its start."""
        cycles, self.extremes = _cycles("last", found)
        self.last.extend(cycles)
        if "kept" in found:
            self.kept = [found["kept"]]
            self.kept_at = [found["kept_at"]]
        self.phasors = found["phasors"].tolist()
        self.again = bool(found["again"])
        while f"mark{len(self.marks)}.first" in found:
            name = f"mark{len(self.marks)}"
            run = fresh()
            _into(run, f"{name}.run", found)
            self.marks.append((run.fork(run.drive), *_cycles(name, found)))


def _of_cycles(name: str, cycles, extremes) -> dict:
    """Cycles (first step, rows, work) and extremes as arrays by name."""
    return {f"{name}.{k}": rows for k, (_, rows, _) in enumerate(cycles)} | {
        f"{name}.first": np.array([one[0] for one in cycles], np.int64),
        f"{name}.work": np.array([one[2] for one in cycles], float),
        f"{name}.extremes": np.array(extremes, float).reshape(-1, 2),
    }


def _cycles(name: str, found: dict) -> tuple:
    """(cycles, extremes) as they were."""
    firsts = found[f"{name}.first"].tolist()
    works = found[f"{name}.work"].tolist()
    return [
        (first, found[f"{name}.{k}"], work) for k, (first, work) in enumerate(zip(firsts, works))
    ], [tuple(one) for one in found[f"{name}.extremes"].tolist()]


class Slot:
    """The file of one march; without a path nothing is kept."""

    def __init__(self, path: Path | None, key: str):
        self.path = path
        self.key = key
        self.next = perf_counter() + SECONDS

    def offer(self, run, samples: Samples) -> None:
        """Write the state between two cycles where it is time to; where there is no room nothing is kept any more."""
        if self.path is None or perf_counter() < self.next or run.outcome is not None:
            return
        begin = perf_counter()
        try:
            save(self.path, self.key, run, samples)
        except Missing:
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self.path = None
        end = perf_counter()
        self.next = end + max(SECONDS, (end - begin) / SHARE)


def slot_of(run, asked: tuple, samples: Samples, fresh) -> Slot:
    """The Slot of a march that begins, which takes over a state that is there.

    run: fresh, as fresh() makes another; asked: numbers that say what is marched. PatchfemError for the state of
    another march.
    """
    keeper = _KEEPER.get()
    if keeper is None:
        return Slot(None, "")
    keeper.begun += 1
    path = keeper.path(keeper.begun)
    key = _key_of(keeper.key, run, asked)
    if keeper.resume and path.is_file():
        load(path, key, run, samples, fresh)
    return Slot(path, key)


def _key_of(key: str, run, asked: tuple) -> str:
    """What the state of a march belongs to: all numbers of the fresh Run, its drive and what is asked."""
    digest = hashlib.sha256(f"{key} {type(run).__name__} {asked}".encode())
    for name, array in _arrays(run, UNSET).items():
        digest.update(f"{name} {array.shape} ".encode() + array.tobytes())
    time = np.linspace(0, asked[0] * run.prop.dt, 1000)
    digest.update(np.asarray(run.drive.values(time)).tobytes())
    return digest.hexdigest()


def _arrays(run, besides=()) -> dict:
    """Arrays of a Run by name, those in its tuples too, but for attributes of these names."""
    out = {}

    def walk(name: str, value) -> None:
        if isinstance(value, np.ndarray):
            out[name] = value
        elif isinstance(value, tuple):
            for k, one in enumerate(value):
                walk(f"{name}.{k}", one)

    for name, value in vars(run).items():
        if name not in CONSTANT and name not in besides:
            walk(name, value)
    return out


def _of_run(name: str, run) -> dict:
    """Arrays and numbers of a Run by name."""
    numbers = {
        each: value for each, value in vars(run).items() if type(value) in (int, float, bool, str)
    }
    return {f"{name}.{each}": array for each, array in _arrays(run).items()} | {
        f"{name}:": np.array(json.dumps(numbers))
    }


def _into(run, name: str, found: dict) -> None:
    """Put what `_of_run` gave into a fresh Run."""
    numbers = json.loads(str(found[f"{name}:"]))
    for each in vars(run):
        if each not in CONSTANT:
            setattr(
                run, each, _taken(getattr(run, each), f"{name}.{each}", found, numbers.get(each))
            )


def save(path: Path, key: str, run, samples: Samples) -> None:
    """Write the state of a march whole to path, under the key of its scene and numerics; Missing where it cannot be."""
    arrays = _of_run("run", run) | samples.arrays()
    need = sum(one.nbytes for one in arrays.values())
    with write_atomically(path, need) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load(path: Path, key: str, run, samples: Samples, fresh) -> None:
    """Put a kept state into a fresh Run and fresh Samples. PatchfemError where it is not theirs or cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
        if str(found["key"]) != key:
            raise PatchfemError(
                f"{path.parent.name}: the state saved there belongs to another scene or to another "
                f"version of patchfem; {WITHOUT}"
            )
        _into(run, "run", found)
        samples.take(found, fresh)
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive has many ways to fail
        raise PatchfemError(
            f"{path.parent.name}: the state saved there cannot be read ({error}); {WITHOUT}"
        ) from None


def _taken(value, name: str, found: dict, number):
    """A value of a fresh Run with what was kept under its name, in place where it fits: others may look at it."""
    if isinstance(value, np.ndarray):
        new = found[name]
        if new.shape != value.shape or new.dtype != value.dtype:
            return new
        if value.flags.writeable:
            value[...] = new
        return value
    if isinstance(value, tuple):
        parts = [_taken(one, f"{name}.{k}", found, None) for k, one in enumerate(value)]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value if number is None or type(value) is not type(number) else number
