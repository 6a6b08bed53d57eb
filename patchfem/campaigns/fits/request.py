"""Fit of keys of a scene to a measurement: the tables of the scene and the file choose the kind of fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

from ...core import PatchfemError
from ...inputs.measured import COLUMN_UNITS, TABLE_FORMAT
from ...inputs.tables import read_text
from ...model.model import build
from ...scene.scene import Scene
from ..rows.checkpoint import SearchCheckpoint
from ..rows.condition_models import FitRequest
from ..rows.fit import (
    UNSTABLE_MEANINGS,
    FittedRows,
    RowsOptions,
    fit_rows,
)
from .curve import DEFAULT_STARTS, HEADER, UNITS, FittedCurve, fit_curve
from .loop import FittedLoop, fit_hysteresis_loop
from .loop_path import LoopOptions
from .problem import parse_ranges
from .wear import FittedCoefficient, fit_wear

DEFAULT_ROW_STARTS = 8  # default number of random starting points of a fit to rows


class Kind(NamedTuple):
    """Kind of fit: what is fitted, what scene that needs, and the options that it has."""

    target: str
    scene: str
    options: tuple[str, ...] = ()


KINDS = {
    "loop": Kind("a loop under a prescribed slide", "a bench", ("hold", "offset", "warm_up")),
    "rows": Kind(
        "rows of a rig", "a rig", ("hold", "starts", "leave_out", "seed", "unstable", "resume")
    ),
    "curve": Kind(
        "frequency and damping of a rig against amplitude",
        "a rig, fitted to a curve of frequency and damping against amplitude",
        ("starts",),
    ),
    "wear": Kind("a worn depth", "one with [wear]"),
}


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
    resume : bool
        For rows: whether the fit in the results folder is continued.
    """

    hold: Sequence = ()
    offset: Sequence = ()
    warm_up: bool = False
    leave_out: str = ""
    starts: int | None = None
    seed: int = 0
    unstable: str = "bound"
    resume: bool = False

    def names_given(self) -> list[str]:
        """Return the names of the fit options that differ from their defaults."""
        return [field.name for field in fields(self) if getattr(self, field.name) != field.default]


@dataclass(frozen=True, slots=True)
class Listener:
    """Callbacks by which a fit reports its progress.

    - say: takes a line of text.
    - progress: takes the completed fraction, from 0 to 1.
    - format_option: takes the name of an option and returns its spelling for the caller.
    """

    say: Callable | None = None
    progress: Callable | None = None
    format_option: Callable = str


def fit_measurement(
    scene: Scene,
    to: str,
    free: Sequence[str],
    options: FitOptions,
    listener: Listener,
    checkpoint: Path | None = None,
) -> FittedLoop | FittedCurve | FittedRows | FittedCoefficient:
    """Fit keys of a scene to a measurement.

    Parameters
    ----------
    scene : Scene
    to : str
        File of the measurement, or a measured depth.
    free : sequence of str
        Free keys with their ranges, "table.key=low..high".
    options : FitOptions
    listener : Listener
    checkpoint : Path, optional
        File with the finished searches of a fit to rows.

    Returns
    -------
    FittedLoop, FittedCurve, FittedRows or FittedCoefficient

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used, and for options that this kind of fit does not have, before anything is computed.
    NotConverged
        If the model cannot be computed at any starting point.
    """
    kind = choose_kind(scene, to)
    check_options(kind, options, listener.format_option)
    if not to:
        raise PatchfemError(
            f"{listener.format_option('to')} MEASURED and {listener.format_option('free')} KEYS are needed"
        )
    if kind == "wear":
        return fit_wear(build(scene), to, free, listener.progress)
    path = Path(to)
    if kind == "curve":
        return fit_curve(scene, path, free, listener.say, options.starts or DEFAULT_STARTS)
    if kind == "loop":
        loop_options = LoopOptions(options.offset, options.warm_up)
        return fit_hysteresis_loop(scene, path, free, options.hold, listener.say, loop_options)

    ranges = parse_ranges(free)
    # an interrupted search continues only with the same inputs
    inputs = (scene.resolved(), free, options.hold, options.leave_out, options.seed)
    content = path.read_bytes() if path.is_file() else ""
    stored = None
    if checkpoint is not None:
        stored = SearchCheckpoint(checkpoint, (*inputs, options.unstable, content), options.resume)
    row_options = RowsOptions(
        hold=options.hold,
        leave_out=options.leave_out,
        starts=options.starts or DEFAULT_ROW_STARTS,
        seed=options.seed,
        unstable=options.unstable,
        checkpoint=stored,
    )
    return fit_rows(FitRequest(scene, ranges, path), row_options, listener.say, listener.progress)


def choose_kind(scene: Scene, to: str) -> str:
    """Return the kind of fit, a key of KINDS, that the tables of a scene and the measured file ask for.

    Raises PatchfemError for a table whose header belongs to no kind of fit.
    """
    if scene.wear is not None:
        return "wear"
    if scene.kind not in ("rig", "linear"):
        return "loop"
    path = Path(to)
    if path.suffix.lower() != ".csv" or not path.is_file():
        return "rows"
    names = read_text(path, "a measured table").names
    columns = {name.lower().removeprefix("decay_") for name in names}
    if columns & (UNITS.keys() - COLUMN_UNITS.keys()):
        return "curve"
    if columns & {*COLUMN_UNITS, "time"}:
        return "rows"
    raise PatchfemError(
        f"{path}:1: a header like `{HEADER}` (of a mode, against its amplitude) or `{TABLE_FORMAT.example}` "
        f"(response to a sine) is needed, not '{','.join(names)[:80]}'"
    )


def check_options(kind: str, options: FitOptions, format_option: Callable) -> None:
    """Check the options of a fit.

    Parameters
    ----------
    kind : str
        Kind of the fit.
    options : FitOptions
    format_option : callable
        Turns the name of an option into the words of a message.

    Raises
    ------
    PatchfemError
        If an option is invalid or belongs to another kind of fit.
    """
    reasons = []
    for name in options.names_given():
        targets = [other.target for other in KINDS.values() if name in other.options]
        if KINDS[kind].target not in targets:
            reasons.append(f"{format_option(name)} applies only to fits to {' or '.join(targets)}")
    if reasons:
        these = "this option" if len(reasons) == 1 else "these options"
        raise PatchfemError(
            f"{'; '.join(reasons)}; this scene is {KINDS[kind].scene}; leave {these} out"
        )
    starts = options.starts
    if starts is not None and (not isinstance(starts, int) or starts < 1):
        raise PatchfemError(f"{format_option('starts')} {starts}: at least one is needed")
    if not isinstance(options.seed, int) or options.seed < 0:
        raise PatchfemError(
            f"{format_option('seed')} {options.seed}: a whole number >= 0 is needed"
        )
    if options.unstable not in UNSTABLE_MEANINGS:
        raise PatchfemError(
            f"{format_option('unstable')} {options.unstable}: one of {', '.join(UNSTABLE_MEANINGS)} is needed"
        )
