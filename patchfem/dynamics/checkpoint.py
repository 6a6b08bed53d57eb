"""Checkpoint files of a long time integration (march), which resumes with bitwise equal results.

`store_checkpoints` sets the files of all marches in its context, one per march in the order in
which they begin. A march that ends within MIN_WRITE_INTERVAL writes nothing. A checkpoint holds the
arrays and numbers of the `march.Run`, which are copied into a new Run, and the samples so far.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..core import Missing, PatchfemError
from ..disk.atomic_write import write_atomically

# Smallest time between two checkpoints [s]; a shorter part of a march is quickly repeated.
MIN_WRITE_INTERVAL = 20.0
# Largest fraction of the elapsed time that is spent on writing checkpoints.
MAX_WRITE_FRACTION = 0.02
# Largest number of samples from before the last cycles in a checkpoint, which limits the file size.
MAX_EARLY_SAMPLES = 400_000
# Attributes of a Run that a checkpoint omits, because a new Run computes
# them or each step overwrites them.
UNSTORED_ATTRIBUTES = "periodic", "workspace"
# Attributes of a Run that are empty at the start of a march and therefore do not identify it.
UNFILLED_ATTRIBUTES = ("sets",)
RETRY_ADVICE = "run without --resume"
_FILES = ContextVar("checkpoint_files", default=None)


class CheckpointFiles:
    """Checkpoint files of a run, one for each of its marches (time integrations).

    Parameters
    ----------
    path_of_march : callable
        path_of_march(number) -> Path of the file of a march.
    key : str
        Identifies the scene and its numerical settings.
    is_resumed : bool
        Whether existing files are read.
    """

    def __init__(self, path_of_march, key: str, is_resumed: bool):
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


class MarchedCycle(NamedTuple):
    """Samples and friction work of one marched cycle, or of a fraction of a cycle.

    - first_step: number of the first step of the cycle
    - rows: (steps + 1, width) samples
    - work: friction work [J]
    """

    first_step: int
    rows: np.ndarray
    work: float


class MarchSamples:
    """Samples that a march has collected so far; they are stored with its checkpoint.

    - last: the last cycles, each of them (number of the first step, rows, work [J])
    - early_rows, early_numbers: blocks of samples from before the last cycles, and the numbers of
      their steps
    - extremes: smallest and largest output [m] of every cycle
    - phasors: phasor [m] of every cycle
    - is_restarted: whether the march was started a second time, cycle by cycle
    - marks: for each mark already reached, the march at that time, the cycles before it and their
      extremes
    """

    def __init__(self, last):
        self.last = last
        self.early_rows = []
        self.early_numbers = []
        self.extremes = []
        self.phasors = []
        self.is_restarted = False
        self.marks = []

    @property
    def capacity(self) -> int:
        """Number of further samples that can be kept from the time before the last cycles."""
        return MAX_EARLY_SAMPLES - sum(map(len, self.early_numbers))

    def keep_early(self, rows, numbers) -> None:
        """Keep samples from the time before the last cycles, with the numbers of their steps."""
        self.early_rows.append(rows)
        self.early_numbers.append(numbers)

    def to_arrays(self) -> dict:
        """Return all samples of the march as named arrays, for storage in a checkpoint."""
        out = _cycles_to_arrays("last", self.last, self.extremes)
        if self.early_rows:
            out |= {
                "kept": np.concatenate(self.early_rows),
                "kept_at": np.concatenate(self.early_numbers),
            }
        for k, (run, cycles, extremes) in enumerate(self.marks):
            out |= _run_to_arrays(f"mark{k}.run", run) | _cycles_to_arrays(
                f"mark{k}", cycles, extremes
            )
        return out | {
            "phasors": np.array(self.phasors, complex),
            "again": np.array(self.is_restarted),
        }

    def restore(self, arrays: dict, start_march) -> None:
        """Restore the samples of a march from the arrays that `to_arrays` returned.

        start_march: function that returns a new march at its start.

        """
        cycles, self.extremes = _cycles_from_arrays("last", arrays)
        self.last.extend(cycles)
        if "kept" in arrays:
            self.early_rows = [arrays["kept"]]
            self.early_numbers = [arrays["kept_at"]]
        self.phasors = arrays["phasors"].tolist()
        self.is_restarted = bool(arrays["again"])
        while f"mark{len(self.marks)}.first" in arrays:
            name = f"mark{len(self.marks)}"
            run = start_march()
            _restore_run(run, f"{name}.run", arrays)
            self.marks.append((run.fork(run.drive), *_cycles_from_arrays(name, arrays)))


def _cycles_to_arrays(name: str, cycles, extremes) -> dict:
    """Return marched cycles and their extremes as a dictionary of named arrays."""
    return {f"{name}.{k}": cycle.rows for k, cycle in enumerate(cycles)} | {
        f"{name}.first": np.array([cycle.first_step for cycle in cycles], np.int64),
        f"{name}.work": np.array([cycle.work for cycle in cycles], float),
        f"{name}.extremes": np.array(extremes, float).reshape(-1, 2),
    }


def _cycles_from_arrays(name: str, arrays: dict) -> tuple:
    """Rebuild marched cycles and their extremes from the arrays that `_cycles_to_arrays` returned."""
    firsts = arrays[f"{name}.first"].tolist()
    works = arrays[f"{name}.work"].tolist()
    cycles = []
    for k, (first_step, work) in enumerate(zip(firsts, works)):
        cycles.append(MarchedCycle(first_step, arrays[f"{name}.{k}"], work))
    return cycles, [tuple(pair) for pair in arrays[f"{name}.extremes"].tolist()]


class MarchCheckpoint:
    """Writer of the checkpoint file of one march; it writes nothing if its path is None."""

    def __init__(self, path: Path | None, key: str):
        self.path = path
        self.key = key
        self.next_write = perf_counter() + MIN_WRITE_INTERVAL

    def write_if_due(self, run, samples: MarchSamples) -> None:
        """Write a checkpoint between two cycles if the minimum interval since the last one has passed.

        A failure to write, as on a full disk, ends the checkpoints of this march.

        """
        if self.path is None or perf_counter() < self.next_write or run.outcome is not None:
            return
        start = perf_counter()
        try:
            save_checkpoint(self.path, self.key, run, samples)
        except Missing:
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            self.path = None
        end = perf_counter()
        self.next_write = end + max(MIN_WRITE_INTERVAL, (end - start) / MAX_WRITE_FRACTION)


def open_checkpoint(run, request: tuple, samples: MarchSamples, start_march) -> MarchCheckpoint:
    """Open the checkpoint file of a new march; if the file exists, resume the march from it.

    Parameters
    ----------
    run : march.Run
        The march at its start.
    request : tuple
        Numbers that identify what is marched; the first one is the number of steps.
    samples : MarchSamples
    start_march : callable
        start_march() -> a second march at its start.

    Returns
    -------
    MarchCheckpoint

    Raises
    ------
    PatchfemError
        If the file belongs to another march.
    """
    files = _FILES.get()
    if files is None:
        return MarchCheckpoint(None, "")
    files.n_begun += 1
    path = files.path_of_march(files.n_begun)
    key = _make_key(files.key, run, request)
    if files.is_resumed and path.is_file():
        load_checkpoint(path, key, run, samples, start_march)
    return MarchCheckpoint(path, key)


def _make_key(key: str, run, request: tuple) -> str:
    """Return a hash of the start state, drive signal and request, which identifies a march's checkpoint."""
    digest = hashlib.sha256(f"{key} {type(run).__name__} {request}".encode())
    for name, array in _collect_arrays(run, UNFILLED_ATTRIBUTES).items():
        digest.update(f"{name} {array.shape} ".encode() + array.tobytes())
    time = np.linspace(0, request[0] * run.prop.dt, 1000)
    digest.update(np.asarray(run.drive.values(time)).tobytes())
    return digest.hexdigest()


def _collect_arrays(run, omitted=()) -> dict:
    """Collect the arrays of a march, including those in nested tuples, in a dictionary by name.

    omitted: names of attributes to leave out.

    """
    out = {}

    def collect(name: str, value) -> None:
        if isinstance(value, np.ndarray):
            out[name] = value
        elif isinstance(value, tuple):
            for k, part in enumerate(value):
                collect(f"{name}.{k}", part)

    for name, value in vars(run).items():
        if name not in UNSTORED_ATTRIBUTES and name not in omitted:
            collect(name, value)
    return out


def _run_to_arrays(prefix: str, run) -> dict:
    """Return the arrays and scalar attributes of a march as named arrays, for a checkpoint."""
    numbers = {
        name: value for name, value in vars(run).items() if type(value) in (int, float, bool, str)
    }
    arrays = {f"{prefix}.{name}": array for name, array in _collect_arrays(run).items()}
    return arrays | {f"{prefix}:": np.array(json.dumps(numbers))}


def _restore_run(run, prefix: str, arrays: dict) -> None:
    """Restore the state of a march from the checkpoint arrays that `_run_to_arrays` returned."""
    numbers = json.loads(str(arrays[f"{prefix}:"]))
    for name, value in list(vars(run).items()):
        if name not in UNSTORED_ATTRIBUTES:
            restored = _restore_value(value, f"{prefix}.{name}", arrays, numbers.get(name))
            setattr(run, name, restored)


def save_checkpoint(path: Path, key: str, run, samples: MarchSamples) -> None:
    """Write the checkpoint of a march atomically.

    Parameters
    ----------
    path : Path
    key : str
        Identifies the scene and its numerical settings.
    run : march.Run
    samples : MarchSamples

    Raises
    ------
    Missing
        If the file cannot be written.
    """
    arrays = _run_to_arrays("run", run) | samples.to_arrays()
    n_bytes = sum(array.nbytes for array in arrays.values())
    with write_atomically(path, n_bytes) as partial, open(partial, "wb") as file:
        np.savez(file, key=np.array(key), **arrays)
        file.flush()
        os.fsync(file.fileno())


def load_checkpoint(path: Path, key: str, run, samples: MarchSamples, start_march) -> None:
    """Load a checkpoint file into a new march and its sample collection.

    Parameters
    ----------
    path, key, run, samples
        See `save_checkpoint`; `run` and `samples` are overwritten.
    start_march : callable
        start_march() -> a second march at its start.

    Raises
    ------
    PatchfemError
        If the file belongs to another march or cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["key"]) != key:
            raise PatchfemError(
                f"{path.parent.name}: the state saved there belongs to another scene or to another "
                f"version of patchfem; {RETRY_ADVICE}"
            )
        _restore_run(run, "run", arrays)
        samples.restore(arrays, start_march)
    except PatchfemError:
        raise
    except Exception as error:  # a damaged archive can raise exceptions of many classes
        raise PatchfemError(
            f"{path.parent.name}: the state saved there cannot be read ({error}); {RETRY_ADVICE}"
        ) from None


def _restore_value(value, name: str, arrays: dict, number):
    """Return the value of a march attribute that is stored in the arrays of a checkpoint.

    An array of equal shape is overwritten in place, because other objects may refer to it.
    """
    if isinstance(value, np.ndarray):
        stored = arrays[name]
        if stored.shape != value.shape or stored.dtype != value.dtype:
            return stored
        if value.flags.writeable:
            value[...] = stored
        return value
    if isinstance(value, tuple):
        parts = [_restore_value(part, f"{name}.{k}", arrays, None) for k, part in enumerate(value)]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value if number is None or type(value) is not type(number) else number
