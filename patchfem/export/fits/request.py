"""Request for a fit from the command line or Python: options, kind of fit, results folder."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...campaigns.fits.curve import DEFAULT_STARTS, HEADER, UNITS, fit_curve
from ...campaigns.fits.loop import fit_hysteresis_loop
from ...campaigns.fits.loop_path import LoopOptions
from ...campaigns.fits.patch import check_amplitudes, fit_patch
from ...campaigns.fits.problem import parse_ranges
from ...campaigns.fits.wear import fit_wear
from ...campaigns.rows.condition_models import FitRequest
from ...campaigns.rows.fit import RowsOptions, fit_rows
from ...campaigns.rows.search import UNSTABLE, SearchSettings
from ...core import PatchfemError
from ...inputs.cells import read_text
from ...inputs.measured import COLUMN_UNITS, TABLE_FORMAT
from ...model.model import build
from ...scene import axes
from ...scene.scene import Scene
from ..results import STARTS, Folder
from .curve import describe_curve_fit
from .files import FitFiles, write_fit
from .loop import describe_loop_fit
from .options import FitOptions
from .patch import describe_patch_fit
from .rows import SearchCheckpoint, describe_rows_fit
from .wear import describe_wear_fit

DEFAULT_ROW_STARTS = 8  # default number of random starting points of a fit to rows
LOOP_OPTIONS = ("offset", "warm_up")
ROW_OPTIONS = ("leave_out", "seed", "unstable", "placebo", "resume")
OPTIONS_BY_KIND = {
    "loop": ("hold", *LOOP_OPTIONS),
    "rows": ("hold", "starts", *ROW_OPTIONS),
    "curve": ("starts",),
    "patch": ("from_patch", "amplitudes"),
    "wear": (),
}
KINDS = {
    "loop": "a bench",
    "rows": "a rig",
    "wear": "one with [wear]",
    "curve": "a rig, fitted to a curve of frequency and damping against amplitude",
    "patch": "fitted to its own patch",
}
_LOOP_FITS = "fits to a loop under a prescribed slide"
_ROW_FITS = "fits to rows of a rig"
FITS_BY_OPTION = {
    "hold": f"{_LOOP_FITS} or to rows of a rig",
    "starts": f"{_ROW_FITS} or to its curve of frequency and damping against amplitude",
    "amplitudes": "fits with --from-patch",
    **dict.fromkeys(LOOP_OPTIONS, _LOOP_FITS),
    **dict.fromkeys(ROW_OPTIONS, _ROW_FITS),
}


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


def fit_into(
    scene: Scene,
    to: str,
    free: Sequence[str],
    options: FitOptions,
    target: Path,
    listener: Listener = Listener(),
) -> FitFiles:
    """Fit keys of a scene to a measurement, and write the results folder.

    Parameters
    ----------
    scene : Scene
    to : str
        File of the measurement, or a measured depth; "" with `options.from_patch`.
    free : sequence of str
        Free keys with their ranges, "table.key=low..high".
    options : FitOptions
    target : Path
        Results folder, which is claimed before the work.
    listener : Listener

    Returns
    -------
    FitFiles

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used and for options that this kind of fit does not have, before
        anything is computed.
    """
    format_option = listener.format_option
    kind = "patch" if options.from_patch else choose_kind(scene, to)
    _check_options(kind, options, format_option)
    if options.from_patch == bool(to) or (options.from_patch and free):
        raise PatchfemError(
            f"{format_option('to')} MEASURED and {format_option('free')} KEYS are needed, or "
            f"{format_option('from_patch')} alone, which fits lumped laws to the scene's own patch"
        )
    lengths = None
    if options.amplitudes:
        lengths = axes.read_lengths(options.amplitudes, format_option("amplitudes"))
    slides = check_amplitudes(lengths)
    with Folder(target, options.resume) as folder:
        if folder.dropped and listener.say is not None:
            listener.say(folder.dropped)
        if kind == "patch":
            files = describe_patch_fit(fit_patch(scene, slides), folder.target)
        elif kind == "rows":
            files = _fit_rows(scene, Path(to), free, options, folder, listener)
        elif kind == "curve":
            starts = options.starts or DEFAULT_STARTS
            fit = fit_curve(scene, Path(to), free, listener.say, starts)
            files = describe_curve_fit(fit, folder.target)
        elif kind == "loop":
            loop_options = LoopOptions(options.offset, options.warm_up)
            fit = fit_hysteresis_loop(
                scene, Path(to), free, options.hold, listener.say, loop_options
            )
            files = describe_loop_fit(fit, folder.target)
        else:
            coefficient = fit_wear(build(scene), to, free, listener.progress)
            files = describe_wear_fit(coefficient, scene)
        write_fit(files, folder)
    return files


def choose_kind(scene: Scene, to: str) -> str:
    """Choose the kind of fit from the tables of a scene and the measured file."""
    if scene.wear is not None:
        return "wear"
    if scene.kind not in ("rig", "linear"):
        return "loop"
    path = Path(to)
    if path.suffix.lower() != ".csv" or not path.is_file():
        return "rows"
    head = read_text(path, "a measured table").split("\n", 1)[0]
    names = (cell.partition("[")[0].strip().lower() for cell in head.split(","))
    columns = {name.removeprefix("decay_") for name in names}
    if columns & (UNITS.keys() - COLUMN_UNITS.keys()):
        return "curve"
    if columns & {*COLUMN_UNITS, "time"}:
        return "rows"
    raise PatchfemError(
        f"{path}:1: a header like `{HEADER}` (of a mode, against its amplitude) or `{TABLE_FORMAT.example}` "
        f"(response to a sine) is needed, not '{head.strip()[:80]}'"
    )


def _check_options(kind: str, options: FitOptions, format_option: Callable) -> None:
    """Raise PatchfemError for fit options that are invalid or belong to another kind of fit."""
    others = [name for name in options.names_given() if name not in OPTIONS_BY_KIND[kind]]
    if others:
        belong = "; ".join(
            f"{format_option(name)} applies only to {FITS_BY_OPTION[name]}" for name in others
        )
        these = "this option" if len(others) == 1 else "these options"
        raise PatchfemError(f"{belong}; this scene is {KINDS[kind]}; leave {these} out")
    starts = options.starts
    seed = options.seed
    if starts is not None and (not isinstance(starts, int) or starts < 1):
        raise PatchfemError(f"{format_option('starts')} {starts}: at least one is needed")
    if not isinstance(seed, int) or seed < 0:
        raise PatchfemError(f"{format_option('seed')} {seed}: a whole number >= 0 is needed")
    if options.unstable not in UNSTABLE:
        raise PatchfemError(
            f"{format_option('unstable')} {options.unstable}: one of {', '.join(UNSTABLE)} is needed"
        )


def _fit_rows(
    scene: Scene,
    path: Path,
    free: Sequence[str],
    options: FitOptions,
    folder: Folder,
    listener: Listener,
) -> FitFiles:
    """Fit a rig to a table of measured responses.

    Finished searches are stored in the folder, so that an interrupted fit can be continued.
    """
    ranges = parse_ranges(free)
    question = (
        scene.resolved(),
        free,
        options.hold,
        options.leave_out,
        options.placebo,
        options.seed,
        options.unstable,
        path.read_bytes() if path.is_file() else "",
    )
    checkpoint = SearchCheckpoint(folder.path / STARTS, question, options.resume)
    starts = options.starts or DEFAULT_ROW_STARTS
    search = SearchSettings(starts, options.seed, options.unstable, checkpoint)
    row_options = RowsOptions(options.hold, options.leave_out, options.placebo, search)
    fit = fit_rows(FitRequest(scene, ranges, path), row_options, listener.say, listener.progress)
    return describe_rows_fit(fit, folder.target)
