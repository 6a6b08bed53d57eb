"""The table [accuracy] of a scene."""

from typing import Annotated, Literal

from pydantic import BeforeValidator

from .types import Positive, Share, Speed, Table, number, whole


def _still_summed(value: object) -> object:
    """An engine of the sum over bonds; ValueError for the one that 0.4 had besides."""
    if value == "exponential":
        raise ValueError("'exponential' is gone: it served order 0, 1 and 2 of reading 'report' alone and was at most "
                         "1.4 times faster than the list over a whole run; use 'merged'")  # fmt: skip
    return value


Summing = Annotated[Literal["auto", "direct", "truncated", "merged", "recursion"], BeforeValidator(_still_summed)]


class Accuracy(Table):
    """The tolerance from which every numerical choice follows, and the knobs that pin one."""

    tolerance: number(gt=0, lt=1) = 1e-3
    method: Literal["auto", "exact", "march", "duhamel", "newmark", "euler", "harmonic"] = "auto"
    steps_per_cycle: whole(4, 10_000_000) | None = None
    quadrature: Summing = "auto"
    tail: Share | None = None
    merge: Share | None = None
    harmonics: whole(1, 10_000) | None = None
    shear_modes: whole(1, 10_000) | None = None
    convergence: Literal["force", "velocity", "displacement"] | None = None
    convergence_tolerance: Positive | None = None
    stick_speed: Speed | None = None
