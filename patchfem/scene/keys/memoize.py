"""What follows from a frozen object alone, made once for each object: scenes of a sweep share most of their tables."""

from collections.abc import Callable
from functools import wraps

MOST = 1024  # objects whose answers are kept


def once(function: Callable) -> Callable:
    """The function of one frozen object and of what can be hashed beside it, which answers from memory where it was
    asked of the same object, not of an equal one: tables compare by all they hold. What it gives must be frozen too."""
    known: dict[tuple, tuple] = {}

    @wraps(function)
    def answered(what, *more):
        found = known.get((id(what), *more))
        if found is None:
            if len(known) >= MOST:
                known.clear()
            # holds the object: its id stays its own
            found = known[id(what), *more] = (
                what,
                function(what, *more),
            )
        return found[1]

    return answered
