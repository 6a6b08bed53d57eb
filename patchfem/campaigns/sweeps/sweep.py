"""Computation of the cases of a sweep in chunks by an executor.

A chunk whose worker dies is repeated in halves.

In: `Work`, numbers of cases and an executor of `executors/`. Out: chunk after chunk from `iterate_chunks`.
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

# Number of failures of a case, the last as the only case of a chunk, after which it is abandoned.
MAX_DEATHS = 3
# Target time of a chunk [s]: long compared with its transfer to a worker, short compared with a
# sweep.
CHUNK_SECONDS = 1.0
MAX_CASES_PER_CHUNK = 4096  # Largest number of cases of a chunk.
MAX_MESH_CASES = 256  # Largest number of cases from which the meshes of a sweep are chosen.


@dataclass(frozen=True, slots=True)
class Work:
    """Common data from which a worker computes any case of a sweep.

    Each worker receives them once.

    All functions are functions of a module or objects that can be pickled.

    Attributes
    ----------
    sweep_scene : SweepScene
    cases : Cases
    extract : callable, optional
        extract(number, model or error, CaseResults, index in them) returns what is kept of a case
        besides its columns.
    keep : callable, optional
        keep(number, Result) is called after each run.
    write : callable, optional
        write(numbers, CaseResults, extras) returns whether they were written to the folder of the
        sweep, so that they need not be sent back.
    estimate : bool
        Whether errors are computed for cases that run one by one.
    meshes : SharedMeshes or None
        Meshes that the cases share, chosen from all of them by `choose_meshes`.
    """

    sweep_scene: SweepScene
    cases: Cases
    extract: Callable | None = None
    keep: Callable | None = None
    write: Callable | None = None
    estimate: bool = True
    meshes: SharedMeshes | None = None


@dataclass(frozen=True, slots=True)
class Died:
    """Marker that an executor returns for a lost chunk, with a short reason."""

    reason: str


def warm_up(work: Work) -> None:
    """Compile and import what the first case needs before the meshes are chosen.

    Errors are ignored, because the run of the case reports them.
    """
    try:
        model = work.sweep_scene.model(work.cases.sets(0))
        if batches.choose_batch(model, len(work.cases)) is None:
            plan.plan(model)
    except Exception:
        return


def compute_chunk(
    work: Work, numbers: Sequence[int], say: Callable | None = None
) -> tuple[CaseResults | None, list]:
    """Compute the results of a chunk of cases.

    Parameters
    ----------
    work : Work
    numbers : sequence of int
        Numbers of the cases.
    say : callable, optional
        Takes a line of text.

    Returns
    -------
    tuple
        CaseResults and a list of what `work.extract` returns for each case; None and [] if
        `work.write` has written them.
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
    return write_or_return(work, numbers, results, extras)


def compute_timed(work: Work, numbers: Sequence[int], say: Callable | None = None) -> tuple:
    """Compute the results of a chunk of cases, and measure the time.

    Parameters
    ----------
    work, numbers, say
        As for `compute_chunk`.

    Returns
    -------
    tuple
        Time [s] without compilation, which no later case needs, and the result of `compute_chunk`.
    """
    begin = perf_counter()
    compile_seconds = compiled.COMPILE_SECONDS[0]
    answer = compute_chunk(work, numbers, say)
    compile_seconds = compiled.COMPILE_SECONDS[0] - compile_seconds
    return perf_counter() - begin - compile_seconds, answer


def write_or_return(
    work: Work, numbers: Sequence[int], results: CaseResults, extras: list
) -> tuple[CaseResults | None, list]:
    """Write the results of a chunk to the folder of the sweep, or return them.

    Parameters
    ----------
    work : Work
    numbers : sequence of int
        Numbers of the cases.
    results : CaseResults
    extras : list
        What `work.extract` returned for each case.

    Returns
    -------
    tuple
        The results and `extras`, or (None, []) if `work.write` has written them.
    """
    if work.write is not None and work.write(numbers, results, extras):
        return None, []
    return results, extras


def _build_similar_models(work: Work, numbers: Sequence[int]) -> SimilarModels | None:
    """Return models of cases that differ only in plain numbers; None if they differ in more.

    It is None as well for pressed patches in motion, and if `work.keep` needs every single run.
    """
    cases = np.asarray(numbers)
    values = work.cases.columns(numbers)
    if work.keep is not None or values is None:
        return None
    try:
        keys = [axis.key for axis in work.cases.axes]
        models = work.sweep_scene.similar_models(keys, values, work.cases.sets, cases)
    except PatchfemError:  # The first case has no model.
        return None
    if models is None or models.first.patch is None:
        return models
    if models.first.kind != "patch":
        return None
    if work.meshes is None:
        return models
    return replace(models, first=work.meshes.with_shared_meshes(models.first))


def _build_case_model(work: Work, number: int):
    """Return the model of a case with the shared meshes, or the error of its scene."""
    try:
        model = work.sweep_scene.model(work.cases.sets(number), work.cases.values(number))
    except PatchfemError as error:
        return error
    return model if work.meshes is None else work.meshes.with_shared_meshes(model)


def choose_meshes(work: Work) -> Work:
    """Choose the meshes that all cases share, and return the work data with these meshes.

    Cases already computed are included.
    """
    if work.meshes is not None:
        return work
    numbers = work.cases.spread_cases(MAX_MESH_CASES)
    models = []
    for number in numbers:
        models.append(_build_case_model(work, number))
        if isinstance(models[-1], Model) and models[-1].patch is None:
            return work
    return replace(work, meshes=SharedMeshes(models, len(numbers) == len(work.cases)))


def _min_chunk_size(work: Work) -> int:
    """Return the smallest number of cases of a chunk, for which a batch pays off.

    The time of fewer cases than a batch needs does not predict the time of many.
    """
    try:
        batch = batches.choose_batch(_build_case_model(work, 0), len(work.cases))
    except Exception:  # The run of the case reports its error.
        return 1
    return batch.together if work.keep is None and batch is not None else 1


class Chunks:
    """Remaining cases, in chunks of neighbours whose size follows from the measured time.

    Parameters
    ----------
    numbers : sequence of int
        Numbers of the cases.
    workers : int
    min_size : int
        Smallest number of cases of a chunk, if there is only one worker.
    """

    def __init__(self, numbers: Sequence[int], workers: int, min_size: int = 1):
        self.min_size = min_size
        self.remaining = deque(numbers)
        self.suspects: deque = deque()
        self.workers = max(workers, 1)
        self.deaths: dict[int, int] = {}
        # This is the time of the last chunk per case; the first value is a guess.
        self.seconds_per_case = CHUNK_SECONDS

    def take(self, *, idle: bool = True) -> list | None:
        """Return the numbers of the next chunk of cases; None if there is none for now.

        idle: whether no chunk is being computed. Only then is a case handed out that was in a chunk
        that died, alone and after all others, because otherwise it would not be known which case
        killed a worker.
        """
        n_remaining = len(self.remaining)
        if not n_remaining:
            return self.suspects.popleft() if self.suspects and idle else None
        max_size = n_remaining
        if self.workers > 1:
            # A chunk has at most half of the remaining cases per worker, so that the last chunks
            # end at the same time.
            max_size = -(-n_remaining // (2 * self.workers))
        size = max(int(CHUNK_SECONDS / max(self.seconds_per_case, 1e-9)), self.min_size)
        size = max(1, min(size, MAX_CASES_PER_CHUNK, max_size))
        return [self.remaining.popleft() for _ in range(size)]

    def record_time(self, numbers: Sequence[int], seconds: float) -> None:
        """Record the time [s] that a chunk took."""
        self.seconds_per_case = seconds / len(numbers)

    def record_death(self, numbers: Sequence[int]) -> list:
        """Return the cases to abandon; split the other cases of a failed chunk into halves.

        A case is abandoned if it was the only one of its chunk and has failed MAX_DEATHS times.
        """
        for number in numbers:
            self.deaths[number] = self.deaths.get(number, 0) + 1
        if len(numbers) == 1 and self.deaths[numbers[0]] >= MAX_DEATHS:
            return list(numbers)
        half = (len(numbers) + 1) // 2
        self.suspects += filter(None, (list(numbers[:half]), list(numbers[half:])))
        return []


def iterate_chunks(
    work: Work, numbers: Sequence[int], executor, say: Callable | None = None
) -> Iterator[tuple]:
    """Compute cases chunk by chunk and yield the results as they arrive.

    Parameters
    ----------
    work : Work
    numbers : sequence of int
        Numbers of the cases.
    executor : object
        Has `workers` and run(work, take, say), which yields (chunk, seconds, result of `compute_chunk` or
        Died) of every chunk that `take` returns until it returns None. If it has begin(work, count,
        say), this is called before the meshes of all cases are chosen, and end() is called at the
        end.
    say : callable, optional
        Takes a line of text.

    Yields
    ------
    tuple
        (numbers, CaseResults or None, extras, seconds) of a chunk; `extras` is None for cases that
        died.
    """
    if not len(numbers):
        return
    try:
        if hasattr(executor, "begin"):
            executor.begin(work, len(numbers), say)
        work = choose_meshes(work)
        # With several workers, only the workers import the code that `_min_chunk_size` needs to run
        # a case.
        min_size = _min_chunk_size(work) if executor.workers == 1 else 1
        chunks = Chunks(work.cases.neighbours(numbers), executor.workers, min_size)
        yield from _iterate_executor_results(chunks, executor.run(work, chunks.take, say))
    finally:
        if hasattr(executor, "end"):
            executor.end()


def _iterate_executor_results(chunks: Chunks, done: Iterator) -> Iterator[tuple]:
    """Yield the results of the chunks that an executor has computed."""
    for chunk, seconds, answer in done:
        if not isinstance(answer, Died):
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
    """Estimator of the remaining time of a sweep from its finished chunks.

    The weight of a chunk halves with every later chunk. total: number of cases.
    """

    def __init__(self, total: int, workers: int):
        self.left = total
        self.workers = max(workers, 1)
        self.chunks = 0
        self.work = 0.0
        self.cases = 0.0

    def __call__(self, count: int, seconds: float) -> float | None:
        """Return the remaining time [s] after a chunk; None if it is not known yet.

        count: cases of the chunk; seconds: time that it took.
        """
        self.left -= count
        self.chunks += 1
        # The first chunk of each worker includes imports and compilation.
        if self.chunks > self.workers:
            self.work = self.work / 2 + seconds
            self.cases = self.cases / 2 + count
        return self.left * self.work / self.cases / self.workers if self.cases else None


def format_duration(seconds: float) -> str:
    """Format a time [s] in seconds, minutes or hours."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
