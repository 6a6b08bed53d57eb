"""A cache of results that depend on one frozen object; scenes of a sweep share most of their tables."""

from collections.abc import Callable
from functools import wraps

MAX_RESULTS = 1024  # results that one function remembers before it forgets all of them


def memoize(function: Callable) -> Callable:
    """Return a function that remembers its results by the identity of its first argument.

    The first argument and the result must be frozen, and the other arguments hashable. Equal tables are not looked for,
    because a comparison of tables takes as long as the functions that are remembered.
    """
    results: dict[tuple, tuple] = {}

    @wraps(function)
    def call(frozen, *others):
        entry = results.get((id(frozen), *others))
        if entry is None:
            if len(results) >= MAX_RESULTS:
                results.clear()
            # The entry keeps the object alive, so that no other object gets its id.
            entry = (frozen, function(frozen, *others))
            results[id(frozen), *others] = entry
        return entry[1]

    return call
