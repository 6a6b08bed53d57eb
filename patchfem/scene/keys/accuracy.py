"""The table [accuracy] of a scene."""

from typing import Literal

from .types import Fraction, Table, key, number, optional, quantity, whole_number


class Accuracy(Table):
    """Tolerance and numerical settings. A setting that is not given follows from the tolerance."""

    tolerance: key(
        number(gt=0, lt=1),
        "largest relative error that is allowed in any measure; the numerical settings follow from this tolerance",
    ) = 1e-3
    max_seconds: optional(
        number(gt=0),
        "CPU time [s] in which a run may be repeated with finer meshes or smaller time steps until its main measures meet "
        "the tolerance; default: 60",
    )
    max_memory: optional(
        quantity("size of memory", gt=0),
        "memory that a run may need: it is not repeated with a finer mesh that needs more, and is refused if it needs more "
        'itself; default: "2 GB", above which a run only says before it starts what needs more',
    )
    method: key(
        Literal["auto", "exact", "march", "harmonic"],
        "method that computes the motion; default: the program chooses a method for the scene",
    ) = "auto"
    steps_per_cycle: optional(
        # More would take days for a single cycle
        whole_number(4, 10_000_000),
        "time steps per cycle; default: set by the tolerance",
    )
    quadrature: key(
        Literal["auto", "direct", "truncated", "merged", "recursion"],
        "method that computes the sum over bonds; default: the fastest method that meets the tolerance",
    ) = "auto"
    tail: optional(
        Fraction,
        "fraction of the bonds that `quadrature` 'truncated' neglects; default: set by the tolerance",
    )
    merge: optional(
        Fraction,
        "width, in bond lengths, within which bonds are merged; default: set by the tolerance",
    )
    shear_modes: optional(
        # More make the dense matrices too large
        whole_number(1, 10_000),
        "number of shear modes of the pieces; default: set by the tolerance",
    )
