"""Checkpoints of a long march on disk, from which it goes on with equal results to the last bit.

`write_state` and `read_state` write and read a state of nested lists, that of a march or of other long computations.
The arrays of the state are those of an .npz archive, and its form is a text in JSON in the same archive.

`store_checkpoints` sets the files of all marches in its context, one per march in the order in which they begin. A march
that ends within MIN_WRITE_INTERVAL writes nothing. A checkpoint holds the arrays of the march and of its record.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_atomically

MIN_WRITE_INTERVAL = 20.0  # least time between two checkpoints [s]
MAX_WRITE_FRACTION = 0.02  # largest fraction of the elapsed time that is spent on writing
RETRY_ADVICE = "run without --resume"
# What a march and its record change besides the arrays of the engine
MARCH_STATE = ("done", "shift", "step", "first_energy", "first_sums")
RECORD_STATE = ("early", "stride", "recent", "energies", "before")
_FILES = ContextVar("checkpoint_files", default=None)


@dataclass
class CheckpointFiles:
    """Checkpoint files of a run, one for each of its marches (time integrations).

    - path_of_march: path_of_march(number) -> Path of the file of a march.
    - key: identifies the scene and its numerical settings.
    - is_resumed: whether existing files are read.
    - n_begun: number of marches that have begun.
    """

    path_of_march: Callable[[int], Path]
    key: str
    is_resumed: bool
    n_begun: int = 0


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
    time = np.linspace(0, request[0] * run.step, 1000)
    arrays = []
    pack((run.system, np.asarray(run.drive.values(time))), arrays)
    for array in arrays:
        digest.update(f"{array.shape} ".encode() + array.tobytes())
    key = digest.hexdigest()
    if files.is_resumed and path.is_file():
        load_checkpoint(path, key, run, record)
    return MarchCheckpoint(path, key)


def convert_to_tuples(value, model):
    """Return nested lists, as read from JSON, as tuples of the same types as those nested in `model`."""
    if isinstance(model, tuple):
        return type(model)(*map(convert_to_tuples, value, model))
    return value


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
    march_state = [getattr(run, name) for name in MARCH_STATE]
    record_state = [getattr(record, name) for name in RECORD_STATE]
    cycles = np.array(record.extremes), np.array(record.phasors)
    write_state(path, key, (run.system, march_state, record_state, cycles))


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
    system, march_state, record_state, cycles = read_state(path, key)
    run.system = convert_to_tuples(system, run.system)
    for name, value in zip(MARCH_STATE, march_state, strict=True):
        setattr(run, name, value)
    for name, value in zip(RECORD_STATE, record_state, strict=True):
        setattr(record, name, value)
    record.extremes, record.phasors = map(list, cycles)
    record.last = record.recent[-1]


def write_state(path: Path, key: str, state) -> None:
    """Write a state to a file, which is replaced as a whole.

    Parameters
    ----------
    path : Path
        File of the state.
    key : str
        Identifies the computation to which the state belongs.
    state : nested lists and tuples
        Numbers, texts, None and arrays.

    Raises
    ------
    Missing
        If the file cannot be written.
    """
    arrays = []
    form = np.array(json.dumps(pack(state, arrays)))
    named = {str(number): array for number, array in enumerate(arrays)}
    with write_atomically(path) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), form=form, **named)
        file.flush()
        os.fsync(file.fileno())


def read_state(path: Path, key: str):
    """Read a state as nested lists.

    Parameters
    ----------
    path : Path
        File of the state.
    key : str
        Key of the computation that continues from the state.

    Raises
    ------
    PatchfemError
        If the state belongs to another computation or cannot be read.
    """
    reason = "belongs to another scene or to another version of patchfem, or a file that the scene names has changed"
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["key"]) == key:
            return _unpack(json.loads(str(arrays["form"])), arrays)
    except Exception as error:  # a damaged archive can raise exceptions of many classes
        reason = f"cannot be read ({error})"
    raise PatchfemError(f"{path.parent.name}: the state saved there {reason}; {RETRY_ADVICE}")


def pack(value, arrays: list[np.ndarray]):
    """Return nested tuples and lists as lists for JSON; an array is appended to `arrays`, and becomes its number there."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if isinstance(value, tuple | list):
        return [pack(part, arrays) for part in value]
    return value


def _unpack(value, arrays):
    """Return the lists that `pack` made, with the arrays of a mapping by the names "0", "1", ..."""
    if isinstance(value, dict):
        return arrays[str(value["array"])]
    if isinstance(value, list):
        return [_unpack(part, arrays) for part in value]
    return value
