"""Computation of the cases of a sweep in chunks by an executor.

If a worker dies, its chunk is split into halves and repeated.

In: `WorkerData`, case numbers and an executor of `executors/`. Out: results by chunk from `iterate_chunks`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ... import compiled
from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels
from ...runs import plan
from ...runs.batch import batches
from ...runs.batch.case_results import CaseResults
from ...runs.batch.meshes import SharedMeshes
from .case_models import SweepScene
from .cases import Cases

# Number of failures after which a case is abandoned; in the last one it is alone in its chunk.
MAX_DEATHS = 3
# Target time of a chunk [s], which is long compared with its transfer to a worker and short compared
# with a sweep.
CHUNK_SECONDS = 1.0
MAX_CASES_PER_CHUNK = 1024  # Largest number of cases in a chunk.
MAX_MESH_CASES = 256  # Largest number of cases that determine the shared meshes of a sweep.


@dataclass(frozen=True, slots=True)
class WorkerData:
    """Data that a worker process needs to compute any case of a sweep.

    Each worker receives the data once. All functions must support pickling.

    Attributes
    ----------
    sweep_scene : SweepScene
    cases : Cases
    extract : callable, optional
        extract(number, model or error, results, index) returns additional data of the case at an
        index of the CaseResults.
    keep : callable, optional
        keep(number, Result) is called after each run.
    write : callable, optional
        write(numbers, results, extras) returns whether it has written the CaseResults to the
        folder of the sweep, so that they are not sent back.
    estimate : bool
        Whether to estimate the errors of cases that are computed one by one.
    meshes : SharedMeshes or None
        Meshes common to all cases, from `choose_shared_meshes`.
    """

    sweep_scene: SweepScene
    cases: Cases
    extract: Callable | None = None
    keep: Callable | None = None
    write: Callable | None = None
    estimate: bool = True
    meshes: SharedMeshes | None = None


@dataclass(frozen=True, slots=True)
class WorkerDeath:
    """Result of a chunk whose worker process died, with the reason."""

    reason: str


def compile_for_first_case(work: WorkerData) -> None:
    """Compile and import in advance the code that the first case of a sweep needs.

    This happens while the meshes are chosen. Errors are ignored here and reported by the run.
    """
    try:
        model = work.sweep_scene.build_model(work.cases.assignments(0))
        if batches.choose_batch(model, len(work.cases)) is None:
            plan.plan(model)
    except Exception:
        return


def compute_chunk(
    work: WorkerData, numbers: Sequence[int], say: Callable | None = None
) -> tuple[CaseResults | None, list]:
    """Compute the results of a chunk of cases.

    Parameters
    ----------
    work : WorkerData
    numbers : sequence of int
        Numbers of the cases.
    say : callable, optional
        Called with a line of text.

    Returns
    -------
    tuple
        CaseResults and a list of the data that `work.extract` returns for each case; None and []
        if `work.write` has written them.
    """
    models = _build_similar_models(work, numbers)
    if models is None:
        models = [_build_case_model(work, number) for number in numbers]
    keep = work.keep and (lambda case, result: work.keep(numbers[case], result))
    results = batches.solve_models(models, keep, say, work.estimate, len(work.cases))
    extras = []
    if work.extract is not None:
        for case, (number, model) in enumerate(zip(numbers, models)):
            extras.append(work.extract(number, model, results, case))
    return output_results(work, numbers, results, extras)


def compute_chunk_with_time(
    work: WorkerData, numbers: Sequence[int], say: Callable | None = None
) -> tuple:
    """Compute the results of a chunk of cases, and measure the elapsed time.

    Parameters
    ----------
    work, numbers, say
        As for `compute_chunk`.

    Returns
    -------
    tuple
        Elapsed time [s] without compilation, and the result of `compute_chunk`.
    """
    begin = perf_counter()
    compile_seconds = compiled.COMPILE_SECONDS[0]
    answer = compute_chunk(work, numbers, say)
    compile_seconds = compiled.COMPILE_SECONDS[0] - compile_seconds
    return perf_counter() - begin - compile_seconds, answer


def output_results(
    work: WorkerData, numbers: Sequence[int], results: CaseResults, extras: list
) -> tuple[CaseResults | None, list]:
    """Write the results of a chunk to the folder of the sweep if possible, otherwise return them.

    Parameters
    ----------
    work : WorkerData
    numbers : sequence of int
        Numbers of the cases.
    results : CaseResults
    extras : list
        Data that `work.extract` returned for each case.

    Returns
    -------
    tuple
        The results and `extras`, or (None, []) if `work.write` has written them.
    """
    if work.write is not None and work.write(numbers, results, extras):
        return None, []
    return results, extras


def _build_similar_models(work: WorkerData, numbers: Sequence[int]) -> SimilarModels | None:
    """Return the models of cases that differ only in plain numbers; None if this is not possible.

    It is also None for patches in motion, and if `work.keep` is called with the result of each run.
    """
    cases = np.asarray(numbers)
    values = work.cases.value_matrix(numbers)
    if work.keep is not None or values is None:
        return None
    try:
        keys = [axis.key for axis in work.cases.axes]
        models = work.sweep_scene.make_similar_models(keys, values, work.cases.assignments, cases)
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
    """Return the model of a case with the shared meshes, or the validation error of its scene."""
    try:
        model = work.sweep_scene.build_model(
            work.cases.assignments(number), work.cases.values(number)
        )
    except PatchfemError as error:
        return error
    return model if work.meshes is None else work.meshes.with_shared_meshes(model)


def choose_shared_meshes(work: WorkerData) -> WorkerData:
    """Return the data of a sweep with meshes that are chosen for all its cases.

    Cases that are already computed are included in this choice.
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
    """Return the smallest number of cases per chunk for which a batch is efficient.

    The time of a smaller chunk does not predict the time of a large one.
    """
    try:
        batch = batches.choose_batch(_build_case_model(work, 0), len(work.cases))
    except Exception:  # The run of the case reports its error.
        return 1
    return batch.min_chunk_cases if work.keep is None and batch is not None else 1


class ChunkQueue:
    """Queue of the remaining cases, in chunks whose size is adapted to the measured time.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of the cases.
    workers : int
    min_size : int
        Smallest number of cases per chunk, used with a single worker.
    """

    def __init__(self, numbers: Sequence[int], workers: int, min_size: int = 1):
        self.min_size = min_size
        self.remaining = deque(numbers)
        self.suspects: deque = deque()
        self.workers = max(workers, 1)
        self.deaths: dict[int, int] = {}
        # Elapsed time per case of the last chunk, with a guess before the first chunk.
        self.seconds_per_case = CHUNK_SECONDS

    def take_chunk(self, *, is_idle: bool = True) -> list | None:
        """Return the case numbers of the next chunk; None if none is available at present.

        Cases of failed chunks are returned last, and only if `is_idle`, that is, if no other chunk
        is being computed. This identifies the case that kills a worker.
        """
        n_remaining = len(self.remaining)
        if not n_remaining:
            return self.suspects.popleft() if self.suspects and is_idle else None
        max_size = n_remaining
        if self.workers > 1:
            # A chunk has at most half of the remaining cases per worker, so that all workers finish
            # at about the same time.
            max_size = -(-n_remaining // (2 * self.workers))
        size = max(int(CHUNK_SECONDS / max(self.seconds_per_case, 1e-9)), self.min_size)
        size = max(1, min(size, MAX_CASES_PER_CHUNK, max_size))
        return [self.remaining.popleft() for _ in range(size)]

    def record_time(self, numbers: Sequence[int], seconds: float) -> None:
        """Record the elapsed time [s] of a chunk."""
        self.seconds_per_case = seconds / len(numbers)

    def record_death(self, numbers: Sequence[int]) -> list:
        """Record the failure of a chunk: return the cases to abandon, and requeue the others in halves.

        A case is abandoned if it was alone in its chunk and has failed MAX_DEATHS times.
        """
        for number in numbers:
            self.deaths[number] = self.deaths.get(number, 0) + 1
        if len(numbers) == 1 and self.deaths[numbers[0]] >= MAX_DEATHS:
            return list(numbers)
        half = (len(numbers) + 1) // 2
        self.suspects += filter(None, (list(numbers[:half]), list(numbers[half:])))
        return []


def iterate_chunks(
    work: WorkerData, numbers: Sequence[int], executor, say: Callable | None = None
) -> Iterator[tuple]:
    """Compute cases chunk by chunk, and yield the results as they arrive.

    Parameters
    ----------
    work : WorkerData
    numbers : sequence of int
        Numbers of the cases.
    executor : object
        Has the attribute `workers` and the method run(work, next_chunk, say), which yields (chunk,
        seconds, result of `compute_chunk` or WorkerDeath) until `next_chunk` returns None. The optional
        method begin(work, count, say) is called before the shared meshes are chosen, and the optional
        method end() at the end.
    say : callable, optional
        Called with a line of text.

    Yields
    ------
    tuple
        (numbers, CaseResults or None, extras, seconds) of a chunk; `extras` is None for abandoned
        cases.
    """
    if not len(numbers):
        return
    try:
        if hasattr(executor, "begin"):
            executor.begin(work, len(numbers), say)
        work = choose_shared_meshes(work)
        # With several workers, this process does not import the code that runs a case, which
        # `_find_min_chunk_size` needs.
        min_size = _find_min_chunk_size(work) if executor.workers == 1 else 1
        chunks = ChunkQueue(work.cases.sort_by_pieces(numbers), executor.workers, min_size)
        yield from _process_executor_results(chunks, executor.run(work, chunks.take_chunk, say))
    finally:
        if hasattr(executor, "end"):
            executor.end()


def _process_executor_results(chunks: ChunkQueue, done: Iterator) -> Iterator[tuple]:
    """Yield the results of finished chunks, and requeue the cases of failed chunks."""
    for chunk, seconds, answer in done:
        if not isinstance(answer, WorkerDeath):
            chunks.record_time(chunk, seconds)
            yield chunk, *answer, seconds
            continue
        abandoned = chunks.record_death(chunk)
        if abandoned:
            failed = CaseResults.blank(len(abandoned))
            for case, number in enumerate(abandoned):
                failed.fail(case, f"{answer.reason}, {chunks.deaths[number]} times")
            yield abandoned, failed, None, seconds


class RemainingTime:
    """Estimator of the remaining time of a sweep from the times of its finished chunks.

    The weight of a chunk is halved by every later chunk. `total` is the number of cases.
    """

    def __init__(self, total: int, workers: int):
        self.n_remaining = total
        self.workers = max(workers, 1)
        self.chunks = 0
        self.work = 0.0
        self.cases = 0.0

    def __call__(self, count: int, seconds: float) -> float | None:
        """Return the remaining time [s] after a finished chunk; None if it is still unknown.

        count: number of cases of the chunk; seconds: its elapsed time.
        """
        self.n_remaining -= count
        self.chunks += 1
        # The first chunk of each worker is ignored, because it includes imports and compilation.
        if self.chunks > self.workers:
            self.work = self.work / 2 + seconds
            self.cases = self.cases / 2 + count
        return self.n_remaining * self.work / self.cases / self.workers if self.cases else None


def format_duration(seconds: float) -> str:
    """Format a duration [s] in seconds, minutes or hours."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
