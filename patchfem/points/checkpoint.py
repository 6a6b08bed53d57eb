"""Checkpoints of a long march on disk, from which it goes on with equal results to the last bit.

`store_checkpoints` sets the files of all marches in its context, one per march in the order in which they begin. A march
that ends within MIN_WRITE_INTERVAL writes nothing. A checkpoint holds the arrays of the march and of its record.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from itertools import count
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
# What a march and its record change besides the arrays of the engine
MARCH_STATE = ("done", "shift", "step", "first_energy", "first_sums", "work_sums")
RECORD_STATE = ("energies", "before", "extremes", "phasors")
PARTS = ("early", "recent")  # lists of the samples of a record
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


def open_checkpoint(run, record, request: tuple[int, ...]) -> MarchCheckpoint:
    """Open the checkpoint file of a new march; if the file exists, the march goes on from it.

    Parameters
    ----------
    run : time_march.March
        March at its start.
    record : time_march.Record
        Its record, empty.
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
    for array in map(np.asarray, list_leaves(run.system)):
        digest.update(f"{array.shape} ".encode() + array.tobytes())
    time = np.linspace(0, request[0] * run.step, 1000)
    digest.update(np.asarray(run.drive.values(time)).tobytes())
    key = digest.hexdigest()
    if files.is_resumed and path.is_file():
        load_checkpoint(path, key, run, record)
    return MarchCheckpoint(path, key)


def list_leaves(tree) -> list[np.ndarray | float]:
    """Return the arrays and numbers of nested tuples in order."""
    if isinstance(tree, tuple):
        return [leaf for part in tree for leaf in list_leaves(part)]
    return [tree]


def replace_leaves(tree, leaves: Iterator[np.ndarray]):
    """Return nested tuples with other arrays; numbers keep their types."""
    if isinstance(tree, tuple):
        return type(tree)(*(replace_leaves(part, leaves) for part in tree))
    leaf = next(leaves)
    return leaf if isinstance(tree, np.ndarray) else type(tree)(leaf)


def save_checkpoint(path: Path, key: str, run, record) -> None:
    """Write the checkpoint of a march.

    Parameters
    ----------
    path : Path
        File, which is replaced as a whole.
    key : str
        Identifies the march.
    run : time_march.March
        March at its present state.
    record : time_march.Record
        Its record.

    Raises
    ------
    Missing
        If the file cannot be written.
    """
    arrays = {f"system_{k}": leaf for k, leaf in enumerate(list_leaves(run.system))}
    for owner, names in ((run, MARCH_STATE), (record, RECORD_STATE)):
        arrays |= {name: np.asarray(getattr(owner, name)) for name in names}
    for name in PARTS:
        arrays |= {f"{name}_{k}": part for k, part in enumerate(getattr(record, name))}
    with write_atomically(path) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load_checkpoint(path: Path, key: str, run, record) -> None:
    """Load a checkpoint file into a new march and its record.

    Parameters
    ----------
    path : Path
        Checkpoint file.
    key : str
        Identifies the march.
    run : time_march.March
        March at its start; overwritten.
    record : time_march.Record
        Its record; overwritten.

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

        run.system = replace_leaves(run.system, (arrays[f"system_{k}"] for k in count()))
        for name in MARCH_STATE:
            value = arrays[name]
            setattr(run, name, value if value.ndim else value.item())
        for name in RECORD_STATE:
            is_list = isinstance(getattr(record, name), list)
            setattr(record, name, list(arrays[name]) if is_list else arrays[name])
        for name in PARTS:
            n_parts = sum(key.startswith(f"{name}_") for key in arrays)
            setattr(record, name, [arrays[f"{name}_{k}"] for k in range(n_parts)])
        record.last = record.recent[-1]
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive can raise exceptions of many classes
        raise PatchfemError(
            f"{folder}: the state saved there cannot be read ({error}); {RETRY_ADVICE}"
        ) from None
