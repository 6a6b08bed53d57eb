"""The table [accuracy] of a scene."""

from typing import Annotated, Literal

from pydantic import BeforeValidator

from .types import Positive, Share, Speed, Table, key, number, whole


def _still_summed(value: object) -> object:
    """An engine of the sum over bonds; ValueError for the one that 0.4 had besides."""
    if value == "exponential":
        raise ValueError("'exponential' was removed, because it supported only order 0, 1 and 2 of reading 'report' "
                         "and made a whole run at most 1.4 times faster; use 'merged'")  # fmt: skip
    return value


Summing = Annotated[Literal["auto", "direct", "truncated", "merged", "recursion"], BeforeValidator(_still_summed)]


class Accuracy(Table):
    """The tolerance, from which every numerical choice follows, and parameters that fix single choices."""

    tolerance: key(number(gt=0, lt=1), "largest relative error wanted in any measure; the numerical settings "
                   "follow from it") = 1e-3
    method: key(Literal["auto", "exact", "march", "duhamel", "newmark", "euler", "harmonic"],
                "solver of the motion; default: chosen from the scene") = "auto"
    steps_per_cycle: key(whole(4, 10_000_000) | None, "time steps per cycle; default: set by the tolerance") = None
    quadrature: key(Summing, "method of the sum over bonds; default: the cheapest within the tolerance") = "auto"
    tail: key(Share | None, "share of the bonds that quadrature 'truncated' leaves out; default: set by the "
                            "tolerance") = None
    merge: key(Share | None, "width, in bond lengths, within which bonds are merged; default: set by the "
                             "tolerance") = None
    harmonics: key(whole(1, 10_000) | None, "number of harmonics in the harmonic balance; default: set by the "
                                            "tolerance") = None
    shear_modes: key(whole(1, 10_000) | None, "number of shear modes of the pieces; default: set by the "
                                              "tolerance") = None
    convergence: key(Literal["force", "velocity", "displacement"] | None, "quantity whose change ends the iteration of "
                     "method 'duhamel'") = None
    convergence_tolerance: key(Positive | None, "relative change at which the iteration of method 'duhamel' "
                               "ends") = None
    stick_speed: key(Speed | None, "speed below which method 'newmark' treats the interface as stuck") = None
