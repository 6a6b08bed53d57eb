"""Checkpoints of a long march on disk, from which it continues with bitwise equal results.

`keeping` sets the files of all marches in its context, one per march in the order in which they begin. A march that
ends within SECONDS writes nothing. A checkpoint holds the arrays and numbers of the Run, which are copied into a new
Run, and the samples so far.
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

SECONDS = 20.0  # smallest time [s] between two checkpoints
SHARE = 0.02  # largest fraction of the computing time that writing checkpoints may take
# arrays that are not stored, as a new Run computes them or a step overwrites them
CONSTANT = "periodic", "workspace"
UNSET = ("sets",)  # arrays that a new Run has not filled yet, so they do not identify it
WITHOUT = "run without --resume"
_KEEPER = ContextVar("keeper", default=None)


class Keeper:
    """Files in which the marches of a run store their checkpoints.

    path: function from the number of a march to its file; key: identifies the scene and numerics; resume: whether
    existing files are read.
    """

    def __init__(self, path, key: str, resume: bool):
        self.path = path
        self.key = key
        self.resume = resume
        self.begun = 0


@contextmanager
def keeping(keeper: Keeper | None) -> Iterator[None]:
    """Let the marches in this context store checkpoints by `keeper`; None: they store nothing."""
    token = _KEEPER.set(keeper)
    try:
        yield
    finally:
        _KEEPER.reset(token)


MOST_KEPT = 400_000  # largest number of samples that are kept from before the last cycles


class Samples:
    """Samples that a march has collected so far, which are stored with its checkpoint.

    - last: the last cycles (first step, rows, work)
    - kept, kept_at: blocks of samples from before the last cycles, and their step numbers
    - extremes, phasors: smallest and largest output, and phasor, of every cycle
    - again: whether the march was started a second time, cycle by cycle
    - marks: for each mark passed, the march at that time, the cycles before it and their extremes
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
        """Number of samples from before the last cycles that may still be kept."""
        return MOST_KEPT - sum(map(len, self.kept_at))

    def early(self, rows, numbers) -> None:
        """Keep samples from before the last cycles, with their step numbers."""
        self.kept.append(rows)
        self.kept_at.append(numbers)

    def arrays(self) -> dict:
        """Return all samples as arrays by name."""
        out = _of_cycles("last", self.last, self.extremes)
        if self.kept:
            out |= {"kept": np.concatenate(self.kept), "kept_at": np.concatenate(self.kept_at)}
        for k, (run, cycles, extremes) in enumerate(self.marks):
            out |= _of_run(f"mark{k}.run", run) | _of_cycles(f"mark{k}", cycles, extremes)
        return out | {"phasors": np.array(self.phasors, complex), "again": np.array(self.again)}

    def take(self, found: dict, fresh) -> None:
        """Restore the samples from their `arrays`; fresh() returns a march at its start."""
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
    """Return cycles (first step, rows, work) and their extremes as arrays by name."""
    return {f"{name}.{k}": rows for k, (_, rows, _) in enumerate(cycles)} | {
        f"{name}.first": np.array([one[0] for one in cycles], np.int64),
        f"{name}.work": np.array([one[2] for one in cycles], float),
        f"{name}.extremes": np.array(extremes, float).reshape(-1, 2),
    }


def _cycles(name: str, found: dict) -> tuple:
    """Return the cycles and extremes that `_of_cycles` stored."""
    firsts = found[f"{name}.first"].tolist()
    works = found[f"{name}.work"].tolist()
    return [
        (first, found[f"{name}.{k}"], work) for k, (first, work) in enumerate(zip(firsts, works))
    ], [tuple(one) for one in found[f"{name}.extremes"].tolist()]


class Slot:
    """Checkpoint file of one march; without a path nothing is stored."""

    def __init__(self, path: Path | None, key: str):
        self.path = path
        self.key = key
        self.next = perf_counter() + SECONDS

    def offer(self, run, samples: Samples) -> None:
        """Write a checkpoint between two cycles if it is due; a full disk ends the checkpoints."""
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
    """Return the Slot of a march that begins; an existing checkpoint is loaded into the march.

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
    """Return a digest of the new Run, its drive and its request, which identifies a checkpoint."""
    digest = hashlib.sha256(f"{key} {type(run).__name__} {asked}".encode())
    for name, array in _arrays(run, UNSET).items():
        digest.update(f"{name} {array.shape} ".encode() + array.tobytes())
    time = np.linspace(0, asked[0] * run.prop.dt, 1000)
    digest.update(np.asarray(run.drive.values(time)).tobytes())
    return digest.hexdigest()


def _arrays(run, besides=()) -> dict:
    """Return the arrays of a Run and of its tuples by name, without the attributes `besides`."""
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
    """Return the arrays and numbers of a Run by name."""
    numbers = {
        each: value for each, value in vars(run).items() if type(value) in (int, float, bool, str)
    }
    return {f"{name}.{each}": array for each, array in _arrays(run).items()} | {
        f"{name}:": np.array(json.dumps(numbers))
    }


def _into(run, name: str, found: dict) -> None:
    """Copy the arrays and numbers of `_of_run` into a new Run."""
    numbers = json.loads(str(found[f"{name}:"]))
    for each in vars(run):
        if each not in CONSTANT:
            setattr(
                run, each, _taken(getattr(run, each), f"{name}.{each}", found, numbers.get(each))
            )


def save(path: Path, key: str, run, samples: Samples) -> None:
    """Write the checkpoint of a march atomically; raise Missing if it cannot be written.

    key: identifies its scene and numerics.
    """
    arrays = _of_run("run", run) | samples.arrays()
    need = sum(one.nbytes for one in arrays.values())
    with write_atomically(path, need) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load(path: Path, key: str, run, samples: Samples, fresh) -> None:
    """Load a checkpoint into a new Run and its Samples.

    PatchfemError is raised if the file belongs to another march or cannot be read.
    """
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
    """Return the stored value of an attribute; an array of equal shape is overwritten in place.

    Other objects may refer to the array of the new Run.
    """
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
