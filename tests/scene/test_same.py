"""Answers that are made once for an object."""

import gc

from patchfem.scene import memoize
from patchfem.scene.keys.memoize import MAX_CACHED_RESULTS


class Held:
    """A thing that is told apart by what it is, though it equals any other."""

    def __init__(self, number: int):
        self.number = number

    def __eq__(self, other) -> bool:
        return True

    __hash__ = None


def test_exact_asked_once_of_an_object_and_again_of_an_equal_one():
    asked = []
    number = memoize(lambda what, *more: asked.append(what) or (what.number, *more))
    one = Held(1)
    other = Held(2)
    assert [number(one), number(one), number(other)] == [(1,), (1,), (2,)]
    assert [number(one, "a"), number(one)] == [(1, "a"), (1,)]
    assert len(asked) == 3


def test_always_an_object_that_is_gone_answers_for_no_other():
    """A new object may have the id of one that is gone; those that are remembered are held."""
    number = memoize(lambda what: what.number)
    for k in range(2 * MAX_CACHED_RESULTS + 5):
        assert number(Held(k)) == k
        if k % 500 == 0:
            # these are young; all that a long session holds would be gone through for nothing
            gc.collect(1)
