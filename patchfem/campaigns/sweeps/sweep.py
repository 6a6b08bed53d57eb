"""The cases of a sweep answered in chunks by an executor, with what died on the way tried again."""

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
from ...runs.batch.meshes import Shared
from .case_models import Asked
from .cases import Cases

TRIES = 3  # deaths, the last of them alone, after which a case is given up
SPAN = 1.0  # seconds that a chunk is to take: long beside its way to a worker, short beside a sweep
MOST = 4096  # cases of a chunk
LOOKED = 256  # cases that the meshes of a sweep are chosen by


@dataclass(frozen=True, slots=True)
class Work:
    """What every worker needs to answer any case; it is sent to each once.

    tell(number, model or error, Answers, place in them): what is made of an answer beside its columns; keep(number,
    Result): called after each run; write(numbers, Answers, told) -> whether they were written where the sweep is kept,
    so that nobody carries them further. All are functions of a module, or objects that travel. estimate: False leaves
    out the errors of cases that run one by one. meshes: those that the cases share, made from all of them by
    `with_meshes`.
    """

    asked: Asked
    cases: Cases
    tell: Callable | None = None
    keep: Callable | None = None
    write: Callable | None = None
    estimate: bool = True
    meshes: Shared | None = None


@dataclass(frozen=True, slots=True)
class Died:
    """What an executor gives for a chunk that did not come back, with the reason in a few words."""

    reason: str


def warmed(work: Work) -> None:
    """Bring up what the first case of a work needs, though its meshes are not chosen yet; what is wrong with it is told
    by its own run."""
    try:
        batches.batch_of(
            model := work.asked.model(work.cases.sets(0)), len(work.cases)
        ) or plan.plan(model)
    except Exception:
        return


def answer(
    work: Work, numbers: Sequence[int], say: Callable | None = None
) -> tuple[CaseResults | None, list]:
    """Answers of some cases, and of each what `work.tell` makes of it; None and nothing where `work.write` has written
    them. This is what a worker does with a chunk."""
    models = _alike(work, numbers) or [_model(work, number) for number in numbers]
    keep = work.keep and (lambda case, result: work.keep(numbers[case], result))
    found = batches.answers(models, keep, say, work.estimate, len(work.cases))
    told = (
        []
        if work.tell is None
        else [
            work.tell(number, model, found, case)
            for case, (number, model) in enumerate(zip(numbers, models))
        ]
    )
    return handed(work, numbers, found, told)


def timed(work: Work, numbers: Sequence[int], say: Callable | None = None) -> tuple:
    """(seconds, what `answer` gives), without the time in which compiled code was made: no later case takes it."""
    begin, made = perf_counter(), compiled.SPENT[0]
    found = answer(work, numbers, say)
    return perf_counter() - begin - (compiled.SPENT[0] - made), found


def handed(
    work: Work, numbers: Sequence[int], found: CaseResults, told: list
) -> tuple[CaseResults | None, list]:
    """What a worker hands on of its answers: nothing of those that `work.write` has written."""
    return (
        (None, []) if work.write is not None and work.write(numbers, found, told) else (found, told)
    )


def _alike(work: Work, numbers: Sequence[int]) -> SimilarModels | None:
    """The models of cases that differ in plain numbers alone; None of others, and of patches that move."""
    cases, values = np.asarray(numbers), work.cases.columns(numbers)
    if work.keep is not None or values is None:
        return None
    try:
        found = work.asked.alike(
            [axis.key for axis in work.cases.axes], values, work.cases.sets, cases
        )
    except PatchfemError:  # the first of them has no model
        return None
    if found is None or found.first.patch is None:
        return found
    if found.first.kind != "patch":
        return None
    return found if work.meshes is None else replace(found, first=work.meshes.given(found.first))


def _model(work: Work, number: int):
    try:
        model = work.asked.model(work.cases.sets(number), work.cases.values(number))
    except PatchfemError as error:
        return error
    return model if work.meshes is None else work.meshes.given(model)


def with_meshes(work: Work) -> Work:
    """The work with the meshes that its cases share, whichever of them are still to be done."""
    if work.meshes is not None:
        return work
    numbers, models = work.cases.spread(LOOKED), []
    for number in numbers:
        models.append(_model(work, number))
        if isinstance(models[-1], Model) and models[-1].patch is None:
            return work
    return replace(work, meshes=Shared(models, len(numbers) == len(work.cases)))


def _least(work: Work) -> int:
    """Fewest cases of a chunk: as many as the batch of the first is worth, since a few of them say nothing of how long
    many take."""
    try:
        batch = batches.batch_of(_model(work, 0), len(work.cases))
    except Exception:  # what is wrong with the case is told by its own run
        return 1
    return batch.together if work.keep is None and batch is not None else 1


class Chunks:
    """The cases that are still to be handed out, neighbours together, in chunks as long as cases have been found to
    take, and of `least` cases."""

    def __init__(self, numbers: Sequence[int], workers: int, least: int = 1):
        self.least = least
        self.left, self.suspect, self.workers = deque(numbers), deque(), max(workers, 1)
        self.deaths: dict[int, int] = {}
        self.each = SPAN  # seconds of a case, by the last chunk

    def take(self, idle: bool = True) -> list | None:
        """The next chunk; None where nothing is left for now.

        idle: whether cases that died may be handed out, by themselves and after all others; not while cases are on
        their way of which nobody could tell which one killed a worker.
        """
        if not self.left:
            return self.suspect.popleft() if self.suspect and idle else None
        fair = -(-len(self.left) // (2 * self.workers))  # so that the last chunks end together
        fair = fair if self.workers > 1 else len(self.left)
        count = max(1, min(max(int(SPAN / max(self.each, 1e-9)), self.least), MOST, fair))
        return [self.left.popleft() for _ in range(min(count, len(self.left)))]

    def done(self, numbers: Sequence[int], seconds: float) -> None:
        """Note how long a chunk took."""
        self.each = seconds / len(numbers)

    def died(self, numbers: Sequence[int]) -> list:
        """Hand the cases of a dead chunk out again, half of them at a time; a case that was alone and has been tried
        often enough comes back."""
        for number in numbers:
            self.deaths[number] = self.deaths.get(number, 0) + 1
        if len(numbers) == 1 and self.deaths[numbers[0]] >= TRIES:
            return list(numbers)
        half = (len(numbers) + 1) // 2
        self.suspect += [part for part in (list(numbers[:half]), list(numbers[half:])) if part]
        return []


def solved(
    work: Work, numbers: Sequence[int], executor, say: Callable | None = None
) -> Iterator[tuple]:
    """(numbers, Answers or None, told, seconds) of chunk after chunk as they come in, as `answer` gives them; told is
    None of cases that died.

    executor: has `workers` and run(work, take, say), which gives (chunk, seconds, what `answer` gives or Died) of
    every chunk that `take` hands out until it hands out none; where it has begin(work, count, say), that is told of the
    work before the meshes of all cases are chosen, and end() after all.
    """
    if not len(numbers):
        return
    try:
        if hasattr(executor, "begin"):
            executor.begin(work, len(numbers), say)
        work = with_meshes(work)
        # others import what runs a case in their workers
        chunks = Chunks(
            work.cases.neighbours(numbers),
            executor.workers,
            _least(work) if executor.workers == 1 else 1,
        )
        yield from _handed(chunks, executor.run(work, chunks.take, say))
    finally:
        if hasattr(executor, "end"):
            executor.end()


def _handed(chunks: Chunks, done: Iterator) -> Iterator[tuple]:
    """What `solved` gives, of the chunks that an executor has done."""
    for chunk, seconds, found in done:
        if isinstance(found, Died):
            lost = chunks.died(chunk)
            if lost:
                failed = CaseResults.blank(len(lost))
                for case, number in enumerate(lost):
                    failed.fail(case, f"{found.reason}, {chunks.deaths[number]} times")
                yield lost, failed, None, seconds
            continue
        chunks.done(chunk, seconds)
        yield chunk, *found, seconds


class Clock:
    """How long what is left of `total` cases will take, by the work of the chunks before, the last of them first."""

    def __init__(self, total: int, workers: int):
        self.left, self.workers, self.chunks, self.work, self.cases = (
            total,
            max(workers, 1),
            0,
            0.0,
            0.0,
        )

    def __call__(self, count: int, seconds: float) -> float | None:
        """Seconds left after a chunk of `count` cases that took so many; None while nobody knows."""
        self.left, self.chunks = self.left - count, self.chunks + 1
        if self.chunks > self.workers:  # the first chunk of each brings what all of them run by
            self.work, self.cases = self.work / 2 + seconds, self.cases / 2 + count
        return self.left * self.work / self.cases / self.workers if self.cases else None


def lasting(seconds: float) -> str:
    """A time in the unit that reads best."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
