"""Computation of the cases of a sweep in chunks by an executor.

If a worker dies, the cases of its chunk are repeated one by one.

In: `WorkerData`, case numbers and an executor of `executors/`. Out: results by chunk from `iterate_chunks`.
"""

from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import cost_model
from ...core import PatchfemError
from ...model.model import Model
from ...model.similar_models import SimilarModels
from ...runs.batch import batches
from ...runs.batch.case_results import CaseResults
from .case_models import SweepScene
from .cases import Cases

# Target CPU time of a chunk [s], long compared with its transfer and its file, which a busy machine delays as well, and
# short compared with a sweep.
TARGET_CHUNK_SECONDS = 1.0
MAX_CASES_TRIED = 3  # Cases that are tried until one is valid, which shows the plain keys.


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
    plain_keys : tuple of str
        Swept keys whose numbers no check depends on, from `find_plain_keys`; cases that differ only in them have similar
        models.
    group : hashable or None
        Key of the engine that computes similar cases together, from `batches.find_group`.
    """

    sweep_scene: SweepScene
    cases: Cases
    extract: Callable | None = None
    keep: Callable | None = None
    plain_keys: tuple[str, ...] = ()
    group: Hashable | None = None

    @property
    def has_blocks(self) -> bool:
        """Whether the cases are static patches that are solved together in fixed blocks."""
        return bool(self.plain_keys) and self.group == batches.STATIC_GROUP


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
        CPU time [s] without compilation, and a tuple of CaseResults and a list of the data that
        `work.extract` returns for each case.
    """
    # The cases are computed in groups, of which each may have its own engine. A batch numbers its cases from 0.
    begin = cost_model.measure_cpu_time()
    numbers = np.asarray(numbers, int)
    results = CaseResults.blank(len(numbers))
    extras = [None] * len(numbers)
    # Cases whose results are kept are single runs, and so the only group.
    keep = work.keep and (lambda case, result: work.keep(int(numbers[case]), result))
    for places, models in _group_models(work, numbers):
        part = batches.solve_models(models, keep, say, len(work.cases))
        results.insert(places, part)
        for case, place in enumerate(places.tolist()) if work.extract is not None else ():
            # The title and the effects of similar models are the same.
            model = models.first if isinstance(models, SimilarModels) else models[case]
            extras[place] = work.extract(int(numbers[place]), model, part, case)
    seconds = cost_model.measure_cpu_time() - begin
    return seconds, (results, extras if work.extract is not None else [])


def _group_models(
    work: WorkerData, numbers: np.ndarray
) -> Iterator[tuple[np.ndarray, Sequence[Model | PatchfemError]]]:
    """Yield the places in `numbers` of the cases of each group, and their models, or the errors of their scenes.

    Cases of a group differ in plain numbers alone, so that their models are similar; all other cases are the last group.
    `work` is the data of the sweep.
    """
    cases = work.cases
    is_single = np.ones(len(numbers), bool)
    keys = work.plain_keys
    columns = dict(zip([axis.key for axis in cases.axes], cases.make_columns(numbers)))
    for places in cases.split_into_groups(numbers, keys) if keys else ():
        # Smallest number of cases whose models are derived from one of them.
        if len(places) < 2:
            continue

        # the case in the middle is the base, or else one at an end, if its scene is valid
        base = None
        for place in places[[len(places) // 2, 0, -1]].tolist():
            sets = cases.assignments(int(numbers[place]))
            base = base or work.sweep_scene.build_similar_base(keys, sets)
        if base is None or (base.model.patch is not None and base.model.kind != "patch"):
            continue

        # cases whose numbers are not plain go to the last group
        values = np.array([columns[key][places] for key in keys]).T
        is_plain = base.plain_numbers.are_plain(values)
        places = places[is_plain]
        is_single[places] = False
        group = values[is_plain], cases.assignments, numbers[places]
        yield places, SimilarModels(base.plain_numbers, base.model, *group)

    places = np.flatnonzero(is_single)
    if places.size:
        yield places, [_build_case_model(work, int(number)) for number in numbers[places]]


def _build_case_model(work: WorkerData, number: int):
    """Return the model of the case `number` of the sweep `work`, or the PatchfemError that its invalid scene raises."""
    try:
        return work.sweep_scene.build_model(work.cases.assignments(number))
    except PatchfemError as error:
        return error


def prepare_work(work: WorkerData) -> WorkerData:
    """Return the data of a sweep, `work`, with what all its cases determine together: plain keys and engine.

    All cases of the sweep count, also those that are already computed.
    """
    if work.keep is not None:
        return work
    cases = work.cases
    keys = [axis.key for axis in cases.axes]
    for number in cases.spread_case_numbers(MAX_CASES_TRIED):
        first = _build_case_model(work, number)
        if isinstance(first, Model):
            plain_keys = work.sweep_scene.find_plain_keys(keys, cases.assignments(number))
            group = batches.find_group(first, len(cases))
            return replace(work, plain_keys=plain_keys, group=group)
    return work  # the run of each case reports its error


def _list_blocks(work: WorkerData, numbers: Sequence[int]) -> list[list[int]]:
    """Return the blocks of a sweep of static patches that contain some of the given cases.

    A block is a range of the cases of a group. It does not depend on the cases that are already computed, nor on the number
    of workers, so that an interrupted sweep ends with the same numbers.
    """
    is_requested = np.zeros(len(work.cases), bool)
    is_requested[np.asarray(numbers, int)] = True
    blocks = []
    for group in work.cases.split_into_groups(range(len(work.cases)), work.plain_keys):
        for block in np.array_split(group, -(-len(group) // batches.static.CASES_PER_BLOCK)):
            if is_requested[block].any():
                blocks.append(block.tolist())
    return blocks


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
    blocks : sequence of list of int
        Chunks with given cases, which come first.
    """

    def __init__(
        self,
        numbers: Sequence[int],
        workers: int,
        min_size: int = 1,
        blocks: Sequence[list[int]] = (),
    ):
        self.min_size = min_size
        self.remaining = deque(numbers)
        self.blocks = deque(blocks)
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
        if self.blocks:
            return self.blocks.popleft()
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
        # Largest number of cases in a chunk.
        size = max(1, min(size, 4096, max_size))
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
    work = prepare_work(work)
    if work.has_blocks:
        chunks = ChunkQueue((), executor.workers, blocks=_list_blocks(work, numbers))
    else:
        # The time of a small chunk would not predict that of a large one whose cases a kernel computes together.
        min_size = batches.MIN_CHUNK_CASES if work.group and executor.workers == 1 else 1
        order = np.concatenate(work.cases.split_into_groups(numbers, work.plain_keys))
        chunks = ChunkQueue(np.asarray(numbers)[order].tolist(), executor.workers, min_size)
    for chunk, seconds, answer in executor.run(work, chunks.take_chunk, say):
        if not isinstance(answer, WorkerDeath):
            chunks.seconds_per_case = seconds / len(chunk)
            yield chunk, *answer
        elif abandoned := chunks.record_death(chunk):
            failed = CaseResults.blank(1)
            failed.fail(0, f"{answer.reason}, also when the case was computed alone")
            yield abandoned, failed, None
