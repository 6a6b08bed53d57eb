"""Computation of the cases of a sweep in chunks by an executor.

If a worker dies, the cases of its chunk are repeated one by one.

In: `WorkerData`, case numbers and an executor of `executors/`. Out: results by chunk from `iterate_chunks`.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ... import compiled
from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels
from ...runs.batch import batches
from ...runs.batch.case_results import CaseResults
from ...runs.batch.meshes import SharedMeshes
from .case_models import SweepScene
from .cases import Cases

# Target time of a chunk [s], which is long compared with its transfer to a worker and short compared
# with a sweep.
TARGET_CHUNK_SECONDS = 1.0
MAX_CASES_PER_CHUNK = 1024  # Largest number of cases in a chunk.
MAX_MESH_CASES = 256  # Largest number of cases that determine the shared meshes of a sweep.


@dataclass(frozen=True, slots=True)
class WorkerData:
    """Data that a worker process needs to compute any case of a sweep.

    Each worker receives the data once. All functions must support pickling.

    Attributes
    ----------
    sweep_scene : SweepScene
        Scene and the settings that all cases share.
    cases : Cases
        Values of the swept keys in each case.
    extract : callable, optional
        extract(number, model or error, results, index) returns additional data of the case at an
        index of the CaseResults.
    keep : callable, optional
        keep(number, Result) is called after each run.
    meshes : SharedMeshes or None
        Meshes common to all cases, from `choose_shared_meshes`.
    """

    sweep_scene: SweepScene
    cases: Cases
    extract: Callable | None = None
    keep: Callable | None = None
    meshes: SharedMeshes | None = None


@dataclass(frozen=True, slots=True)
class WorkerDeath:
    """Result of a chunk whose worker process died, with the reason."""

    reason: str


def compute_chunk(
    work: WorkerData,
    numbers: Sequence[int],
    say: Callable | None = None,
) -> tuple[float, tuple[CaseResults, list]]:
    """Compute the results of a chunk of cases.

    Parameters
    ----------
    work : WorkerData
        What a worker needs to compute any case.
    numbers : sequence of int
        Numbers of the cases.
    say : callable, optional
        Called with a line of text.

    Returns
    -------
    tuple
        Elapsed time [s] without compilation, and a tuple of CaseResults and a list of the data that
        `work.extract` returns for each case.
    """
    # Cases that differ in numbers alone share what the numbers do not change. The batch numbers its cases from 0.
    begin = perf_counter() - compiled.COMPILE_SECONDS[0]
    models = _build_similar_models(work, numbers)
    if models is None:
        models = [_build_case_model(work, number) for number in numbers]
    keep = work.keep and (lambda case, result: work.keep(numbers[case], result))
    results = batches.solve_models(models, keep, say, True, len(work.cases))
    extras = []
    if work.extract is not None:
        for case, (number, model) in enumerate(zip(numbers, models)):
            extras.append(work.extract(number, model, results, case))
    seconds = perf_counter() - compiled.COMPILE_SECONDS[0] - begin
    return seconds, (results, extras)


def _build_similar_models(work: WorkerData, numbers: Sequence[int]) -> SimilarModels | None:
    """Return the models of cases that differ only in numbers that no check depends on; None for other cases.

    It is also None for patches in motion, and if `work.keep` is called with the result of each run.
    """
    columns = work.cases.make_columns(numbers)
    if work.keep is not None or any(column.dtype.kind != "f" for column in columns):
        return None
    try:
        models = work.sweep_scene.make_similar_models(
            [axis.key for axis in work.cases.axes],
            np.array(columns).T,
            work.cases.assignments,
            np.asarray(numbers),
        )
    except PatchfemError:  # The first case has no model.
        return None
    if models is None or models.first.patch is None:
        return models
    if models.first.kind != "patch":
        return None
    if work.meshes is None:
        return models
    return replace(models, first=work.meshes.with_shared_meshes(models.first))


def _build_case_model(work: WorkerData, number: int):
    """Return the model of a case, by its number, with the shared meshes, or the error of its scene.

    `work` is the data of the sweep.
    """
    try:
        model = work.sweep_scene.build_model(work.cases.assignments(number))
    except PatchfemError as error:
        return error
    return model if work.meshes is None else work.meshes.with_shared_meshes(model)


def choose_shared_meshes(work: WorkerData) -> WorkerData:
    """Return the data of a sweep, `work`, with meshes that are chosen for all its cases together.

    All cases of the sweep count, also those that are already computed. Without a patch the data are unchanged.
    """
    if work.meshes is not None:
        return work
    numbers = work.cases.spread_case_numbers(MAX_MESH_CASES)
    models = []
    for number in numbers:
        models.append(_build_case_model(work, number))
        if isinstance(models[-1], Model) and models[-1].patch is None:
            return work
    return replace(work, meshes=SharedMeshes(models, len(numbers) == len(work.cases)))


def _find_min_chunk_size(work: WorkerData) -> int:
    """Return the smallest number of cases per chunk.

    It is 1, or more for cases that one call of a kernel computes together; the time of a smaller chunk would not
    predict that of a large one. `work` is the data of the sweep.
    """
    model = _build_case_model(work, 0)
    if work.keep is not None or not isinstance(
        model, Model
    ):  # The run of the case reports its error.
        return 1
    return batches.MIN_CHUNK_CASES if batches.find_group(model, len(work.cases)) else 1


class ChunkQueue:
    """Queue of the remaining cases, in chunks whose size is adapted to the measured time.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of the cases.
    workers : int
        Number of workers that take chunks.
    min_size : int
        Smallest number of cases per chunk, used with a single worker.
    """

    def __init__(self, numbers: Sequence[int], workers: int, min_size: int = 1):
        self.min_size = min_size
        self.remaining = deque(numbers)
        self.suspects: deque[int] = deque()
        self.repeated: set[int] = set()
        self.workers = max(workers, 1)
        # Elapsed time per case of the last chunk, with a guess before the first chunk.
        self.seconds_per_case = TARGET_CHUNK_SECONDS

    def take_chunk(self, *, is_idle: bool = True) -> list | None:
        """Return the case numbers of the next chunk; None if none is available at present.

        Cases of failed chunks are repeated last and one by one, only if `is_idle`, that is, if no other chunk is being
        computed, so that a case that kills its worker then has done it itself.
        """
        n_remaining = len(self.remaining)
        if not n_remaining:
            if not (self.suspects and is_idle):
                return None
            self.repeated.add(self.suspects[0])
            return [self.suspects.popleft()]
        max_size = n_remaining
        if self.workers > 1:
            # A chunk has at most half of the remaining cases per worker, so that all workers finish
            # at about the same time.
            max_size = -(-n_remaining // (2 * self.workers))
        size = max(int(TARGET_CHUNK_SECONDS / max(self.seconds_per_case, 1e-9)), self.min_size)
        size = max(1, min(size, MAX_CASES_PER_CHUNK, max_size))
        return [self.remaining.popleft() for _ in range(size)]

    def record_death(self, numbers: Sequence[int]) -> list[int]:
        """Record that the worker of a chunk died, and return the cases to abandon.

        `numbers` are those of the chunk. A chunk of several cases is queued to be repeated case by case.
        """
        if self.repeated.issuperset(numbers):
            return list(numbers)
        self.suspects += numbers
        return []


def iterate_chunks(
    work: WorkerData, numbers: Sequence[int], executor, say: Callable | None = None
) -> Iterator[tuple]:
    """Compute cases chunk by chunk, and yield the results as they arrive.

    Parameters
    ----------
    work : WorkerData
        What a worker needs to compute any case.
    numbers : sequence of int
        Numbers of the cases.
    executor : object
        Has the attribute `workers` and the method run(work, next_chunk, say), which yields (chunk,
        seconds, result of `compute_chunk` or WorkerDeath) until `next_chunk` returns None.
    say : callable, optional
        Called with a line of text.

    Yields
    ------
    tuple
        (numbers, CaseResults, extras) of a chunk; `extras` is None for a case that is abandoned,
        because it ends its worker.
    """
    if not len(numbers):
        return
    work = choose_shared_meshes(work)
    # With several workers, this process does not import the code that runs a case, which
    # `_find_min_chunk_size` needs.
    min_size = _find_min_chunk_size(work) if executor.workers == 1 else 1
    chunks = ChunkQueue(work.cases.sort_by_pieces(numbers), executor.workers, min_size)
    for chunk, seconds, answer in executor.run(work, chunks.take_chunk, say):
        if not isinstance(answer, WorkerDeath):
            chunks.seconds_per_case = seconds / len(chunk)
            yield chunk, *answer
        elif abandoned := chunks.record_death(chunk):
            failed = CaseResults.blank(1)
            failed.fail(0, f"{answer.reason}, also when the case was computed alone")
            yield abandoned, failed, None
