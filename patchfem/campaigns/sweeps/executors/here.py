"""Chunks answered in this process, one after the other."""

from collections.abc import Callable, Iterator
from time import perf_counter

from ..sweep import Work, answer


class Here:
    """The executor of this process."""

    workers = 1

    def run(self, work: Work, take: Callable, say: Callable | None = None) -> Iterator[tuple]:
        """(chunk, seconds, what `answer` gives) of each chunk that `take` hands out."""
        while (chunk := take()) is not None:
            begin = perf_counter()
            found = answer(work, chunk, say)
            yield chunk, perf_counter() - begin, found
