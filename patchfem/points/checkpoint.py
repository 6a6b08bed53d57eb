"""Checkpoints of a long march on disk, from which it goes on with equal results to the last bit.

`store_checkpoints` sets the files of all marches in its context, one per march in the order in which they begin. A march
that ends within MIN_WRITE_INTERVAL writes nothing. A checkpoint holds the arrays of the march and of its record.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_atomically

MIN_WRITE_INTERVAL = 20.0  # least time between two checkpoints [s]
MAX_WRITE_FRACTION = 0.02  # largest fraction of the elapsed time that is spent on writing
# Largest number of samples from before the last cycles, which limits memory and file size
MAX_EARLY_SAMPLES = 400_000
RETRY_ADVICE = "run without --resume"
BLOCKS = ("numbers", "rows", "sums")  # lists of arrays of a record
CYCLES = ("extremes", "phasors")  # lists of numbers of its cycles
_FILES = ContextVar("checkpoint_files", default=None)


class CheckpointFiles:
    """Checkpoint files of a run, one for each of its marches.

    Parameters
    ----------
    path_of_march : callable
        path_of_march(number) -> Path of the file of a march.
    key : str
        Identifies the scene and its numerical settings.
    is_resumed : bool
        Whether existing files are read.
    """

    def __init__(self, path_of_march: Callable[[int], Path], key: str, is_resumed: bool):
        self.path_of_march = path_of_march
        self.key = key
        self.is_resumed = is_resumed
        self.n_begun = 0


@contextmanager
def store_checkpoints(files: CheckpointFiles | None) -> Iterator[None]:
    """Set the checkpoint files for the marches in this context; None switches checkpoints off."""
    token = _FILES.set(files)
    try:
        yield
    finally:
        _FILES.reset(token)


class MarchCheckpoint:
    """Writer of the checkpoint file of one march; it writes nothing if its path is None."""

    def __init__(self, path: Path | None, key: str):
        self.path = path
        self.key = key
        self.next_write = perf_counter() + MIN_WRITE_INTERVAL

    def write_if_due(self, run, record) -> None:
        """Write a checkpoint if the least interval since the last one has passed.

        A failure to write, as on a full disk, ends the checkpoints of this march.
        """
        if self.path is None or perf_counter() < self.next_write or run.outcome is not None:
            return
        start = perf_counter()
        try:
            save_checkpoint(self.path, self.key, run, record)
        except Missing:
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self.path = None
        end = perf_counter()
        self.next_write = end + max(MIN_WRITE_INTERVAL, (end - start) / MAX_WRITE_FRACTION)


def open_checkpoint(run, record, request: tuple) -> MarchCheckpoint:
    """Open the checkpoint file of a new march; if the file exists, the march goes on from it.

    Parameters
    ----------
    run : time_march.March
        March at its start.
    record : time_march.Record
    request : tuple
        Numbers that identify what is marched; the first one is the number of steps.

    Raises
    ------
    PatchfemError
        If the file belongs to another march or cannot be read.
    """
    files = _FILES.get()
    if files is None:
        return MarchCheckpoint(None, "")
    files.n_begun += 1
    path = files.path_of_march(files.n_begun)
    digest = hashlib.sha256(f"{files.key} {request}".encode())
    for name, array in flatten(run.system).items():
        digest.update(f"{name} {array.shape} ".encode() + array.tobytes())
    time = np.linspace(0, request[0] * run.step, 1000)
    digest.update(np.asarray(run.drive.values(time)).tobytes())
    key = digest.hexdigest()
    if files.is_resumed and path.is_file():
        load_checkpoint(path, key, run, record)
    return MarchCheckpoint(path, key)


def flatten(value, name: str = "") -> dict[str, np.ndarray]:
    """Return the arrays of nested tuples by name; numbers are left out."""
    if isinstance(value, np.ndarray):
        return {name: value}
    arrays = {}
    if isinstance(value, tuple):
        for number, part in enumerate(value):
            arrays |= flatten(part, f"{name}.{number}")
    return arrays


def rebuild(value, arrays: dict, name: str = ""):
    """Return a copy of nested tuples in which each array is replaced by the stored one of the same name.

    Parameters
    ----------
    value : tuple
        Nested tuples of the same form.
    arrays : mapping
        Stored arrays by name, as `flatten` names them.
    name : str
        Name of the value in the file.
    """
    if isinstance(value, np.ndarray):
        return arrays[name]
    if isinstance(value, tuple):
        return type(value)(
            *(rebuild(part, arrays, f"{name}.{number}") for number, part in enumerate(value))
        )
    return value


def save_checkpoint(path: Path, key: str, run, record) -> None:
    """Write the checkpoint of a march.

    Parameters
    ----------
    path : Path
    key : str
        Identifies the march.
    run : time_march.March
    record : time_march.Record

    Raises
    ------
    Missing
        If the file cannot be written.
    """
    arrays = {f"system{name}": array for name, array in flatten(run.system).items()}
    for name in BLOCKS:
        for number, block in enumerate(getattr(record, name)):
            arrays[f"{name}.{number}"] = block
    for name in CYCLES:
        arrays[name] = np.array(getattr(record, name))
    for number, (_, samples, sums) in enumerate(record.recent):
        arrays |= {f"samples.{number}": samples, f"energies.{number}": sums}
    arrays |= {"totals": record.totals, "works": run.work_sums, "lists": run.first_sums}
    if record.before is not None:
        arrays["before"] = record.before
    firsts = [first for first, _, _ in record.recent]
    numbers = {"done": run.done, "firsts": firsts, "energy": run.first_energy}
    n_bytes = sum(array.nbytes for array in arrays.values())
    with write_atomically(path, n_bytes) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), march=np.array(json.dumps(numbers)), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load_checkpoint(path: Path, key: str, run, record) -> None:
    """Load a checkpoint file into a new march and its record.

    Parameters
    ----------
    path, key, run, record
        As in `save_checkpoint`; `run` and `record` are overwritten.

    Raises
    ------
    PatchfemError
        If the file belongs to another march or cannot be read.
    """
    folder = path.parent.name
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["key"]) != key:
            raise PatchfemError(
                f"{folder}: the state saved there belongs to another scene or to another version of patchfem; "
                f"{RETRY_ADVICE}"
            )
        numbers = json.loads(str(arrays["march"]))
        run.system = rebuild(run.system, arrays, "system")
        run.done = numbers["done"]
        run.first_energy = numbers["energy"]
        run.work_sums = arrays["works"]
        for name in CYCLES:
            setattr(record, name, list(arrays[name]))
        for name in BLOCKS:
            blocks = []
            while f"{name}.{len(blocks)}" in arrays:
                blocks.append(arrays[f"{name}.{len(blocks)}"])
            setattr(record, name, blocks)
        record.totals = arrays["totals"]
        record.recent = [
            (first, arrays[f"samples.{number}"], arrays[f"energies.{number}"])
            for number, first in enumerate(numbers["firsts"])
        ]
        record.last = record.recent[-1]
        record.before = arrays.get("before")
        run.first_sums = arrays["lists"]
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive can raise exceptions of many classes
        raise PatchfemError(
            f"{folder}: the state saved there cannot be read ({error}); {RETRY_ADVICE}"
        ) from None
