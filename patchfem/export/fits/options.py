"""Options of a fit from the command line or Python."""

from collections.abc import Sequence
from dataclasses import dataclass, fields


@dataclass(frozen=True, slots=True)
class FitOptions:
    """Options of a fit, besides the keys that are fitted.

    Each kind of fit refuses the options that it does not have.

    Attributes
    ----------
    hold : sequence of str
        Rows to predict without fitting them, such as "frequency=135 Hz,150 Hz"; for a loop or rows.
    offset : sequence of str
        For a loop: offsets to fit as well, "force" (a constant force over the whole record) or "displacement" (distance
        of the first row from the stress-free position).
    warm_up : bool
        For a loop: whether the whole cycles of the record are computed once, as a run-in, before the fitted cycles.
    leave_out : str
        For rows: a column; each of its values is left out in turn.
    starts : int or None
        For rows or a curve of frequency and damping against amplitude: number of random starting points inside the
        ranges; the best result is used. By default 8, or 6 for a curve.
    seed : int
        For rows: seed of the starting points.
    unstable : str
        For rows: treatment of those with the flag U (unstable), "bound", "out" or "read".
    placebo : sequence of str
        For rows: values such as "structure.mode.yaw.frequency=110 Hz,138 Hz", for each of which the whole fit is
        repeated.
    resume : bool
        For rows: whether the fit in the results folder is continued.
    from_patch : bool
        Whether the patch of the scene is replaced by laws of a single point, fitted to the patch's own loops, instead of
        a fit to a measurement.
    amplitudes : str
        Amplitudes of the slide for `from_patch`, such as "0.1 um..10 um:25". `patchfem.fit` takes values in m as well.
    """

    hold: Sequence = ()
    offset: Sequence = ()
    warm_up: bool = False
    leave_out: str = ""
    starts: int | None = None
    seed: int = 0
    unstable: str = "bound"
    placebo: Sequence = ()
    resume: bool = False
    from_patch: bool = False
    amplitudes: str | Sequence = ""

    def names_given(self) -> list:
        """Return the names of the fit options that differ from their defaults."""
        return [field.name for field in fields(self) if getattr(self, field.name) != field.default]
