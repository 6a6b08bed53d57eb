"""Cache of results that depend on one frozen object, because scenes of a sweep share tables."""

from collections.abc import Callable
from functools import wraps
from typing import Any


def memoize(function: Callable[..., Any]) -> Callable[..., Any]:
    """Cache the results of a function by the identity of its first argument.

    The first argument and the result must be frozen, and the other arguments hashable. Equal tables are not looked for,
    because a comparison of tables takes as long as the functions that are remembered.
    """
    results: dict[tuple, tuple] = {}

    @wraps(function)
    def call_cached(frozen, *others):
        """Return the cached result for this very object `frozen` and equal other arguments."""
        entry = results.get((id(frozen), *others))
        if entry is None:
            # Number of results of one function at which its cache is emptied.
            if len(results) >= 1024:
                results.clear()
            # The entry keeps the object alive; otherwise another object could get the same id.
            entry = (frozen, function(frozen, *others))
            results[id(frozen), *others] = entry
        return entry[1]

    return call_cached
