"""`memoize`: results that are computed once per object."""

import gc

from patchfem.scene import memoize
from patchfem.scene.keys.memoize import MAX_CACHED_RESULTS


class NumberedObject:
    """Object that compares equal to any other and can only be distinguished by its identity."""

    def __init__(self, number: int):
        self.number = number

    def __eq__(self, other) -> bool:
        return True

    __hash__ = None


def test_exact_memoized_function_is_called_once_per_object():
    """A memoised function is called once per object and set of arguments, and again for an equal object."""
    calls = []
    number = memoize(lambda what, *more: calls.append(what) or (what.number, *more))
    first = NumberedObject(1)
    second = NumberedObject(2)
    assert [number(first), number(first), number(second)] == [(1,), (1,), (2,)]
    assert [number(first, "a"), number(first)] == [(1, "a"), (1,)]
    assert len(calls) == 3


def test_always_deleted_objects_are_not_confused():
    """A new object with the id of a deleted one gets its own result, since cached objects are kept alive."""
    number = memoize(lambda what: what.number)
    for k in range(2 * MAX_CACHED_RESULTS + 5):
        assert number(NumberedObject(k)) == k
        if k % 500 == 0:
            # only young objects are collected, which is fast in a long session
            gc.collect(1)
