"""The table [accuracy] of a scene."""

from typing import Annotated, Literal

from pydantic import BeforeValidator

from . import removed
from .types import Share, Table, key, number, whole


def _still_summed(value: object) -> object:
    """An engine of the sum over bonds; ValueError for the one that 0.4 had besides."""
    if value == "exponential":
        raise ValueError("'exponential' was removed: this method supported only the orders 0, 1 and 2 of reading "
                         "'report', and a run with it was at most 1.4 times faster; use 'merged'")  # fmt: skip
    return value


Summing = Annotated[Literal["auto", "direct", "truncated", "merged", "recursion"], BeforeValidator(_still_summed)]


def _still_a_method(value: object) -> object:
    """Return a method; ValueError for one that was removed."""
    if isinstance(value, str) and value in removed.METHODS:
        raise ValueError(removed.METHODS[value])
    return value


Method = Annotated[Literal["auto", "exact", "march", "harmonic"], BeforeValidator(_still_a_method)]


class Accuracy(Table):
    """The tolerance determines the numerical settings; a key that is given fixes its own setting in place of the
    tolerance."""

    tolerance: key(number(gt=0, lt=1), "largest relative error that is allowed in any measure; the numerical settings "
                   "follow from this tolerance") = 1e-3
    method: key(Method, "method that computes the motion; default: the program chooses a method for the "
                        "scene") = "auto"
    steps_per_cycle: key(whole(4, 10_000_000) | None, "time steps per cycle; default: set by the tolerance") = None
    quadrature: key(Summing, "method that computes the sum over bonds; default: the fastest method that meets the "
                    "tolerance") = "auto"
    tail: key(Share | None, "fraction of the bonds that `quadrature` 'truncated' neglects; default: set by the "
              "tolerance") = None
    merge: key(Share | None, "width, in bond lengths, within which bonds are merged; default: set by "
               "the tolerance") = None
    harmonics: key(whole(1, 10_000) | None, "number of harmonics in the harmonic balance; default: set by the "
                                            "tolerance") = None
    shear_modes: key(whole(1, 10_000) | None, "number of shear modes of the pieces; default: set by the "
                                              "tolerance") = None
