"""The table [accuracy] of a scene."""

from typing import Annotated, Literal

from pydantic import BeforeValidator

from .types import Positive, Share, Speed, Table, key, number, whole


def _still_summed(value: object) -> object:
    """An engine of the sum over bonds; ValueError for the one that 0.4 had besides."""
    if value == "exponential":
        raise ValueError("'exponential' is gone: it served order 0, 1 and 2 of reading 'report' alone and was at most "
                         "1.4 times faster than the list over a whole run; use 'merged'")  # fmt: skip
    return value


Summing = Annotated[Literal["auto", "direct", "truncated", "merged", "recursion"], BeforeValidator(_still_summed)]


class Accuracy(Table):
    """The tolerance from which every numerical choice follows, and the knobs that pin one."""

    tolerance: key(number(gt=0, lt=1), "relative error that every measure is to keep to; every numerical choice "
                   "follows from it") = 1e-3
    method: key(Literal["auto", "exact", "march", "duhamel", "newmark", "euler", "harmonic"],
                "engine of the motion; chosen by what the scene names unless given") = "auto"
    steps_per_cycle: key(whole(4, 10_000_000) | None, "time steps per cycle; by the tolerance unless given") = None
    quadrature: key(Summing, "engine of the sum over bonds; the cheapest within the tolerance unless given") = "auto"
    tail: key(Share | None, "share of the bonds that the truncated sum leaves out; by the tolerance unless "
              "given") = None
    merge: key(Share | None, "width, in bond lengths, within which bonds are merged; by the tolerance unless "
               "given") = None
    harmonics: key(whole(1, 10_000) | None, "number of harmonics of the balance; by the tolerance unless given") = None
    shear_modes: key(whole(1, 10_000) | None, "number of shear modes of the pieces; by the tolerance unless "
                     "given") = None
    convergence: key(Literal["force", "velocity", "displacement"] | None, "quantity whose change ends the iteration of "
                     "the method duhamel") = None
    convergence_tolerance: key(Positive | None, "relative change at which the iteration of the method duhamel "
                               "ends") = None
    stick_speed: key(Speed | None, "speed below which the method newmark takes the interface as stuck") = None
