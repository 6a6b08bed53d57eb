"""Fit of keys of a scene to a measurement: the tables of the scene and the file choose the kind of fit."""

from collections.abc import Sequence
from pathlib import Path

from ...core import PatchfemError
from ...inputs.measured import RESPONSE_COLUMN_UNITS, RESPONSE_TABLE_FORMAT
from ...inputs.tables import read_text
from ...scene.assignments import Range
from ...scene.keys.tables import UNIVERSAL_EXTENSIONS
from ...scene.scene import Scene
from .curve import CURVE_HEADER, CURVE_UNITS, CurveComparison
from .loop import LoopComparison
from .options import FitOptions
from .problem import DEFAULT_OPTIONS, SILENT_LISTENER, FittedKeys, Listener, fit_keys
from .rows import RowsComparison
from .wear import DepthComparison

# Kinds of measurements
COMPARISONS = {
    "loop": LoopComparison,
    "curve": CurveComparison,
    "rows": RowsComparison,
    "wear": DepthComparison,
}


def fit_measurement(
    scene: Scene,
    to: str | Path,
    ranges: Sequence[Range],
    options: FitOptions = DEFAULT_OPTIONS,
    listener: Listener = SILENT_LISTENER,
) -> FittedKeys:
    """Fit keys of a scene to a measurement.

    Parameters
    ----------
    scene : Scene
        Its kind decides which measurements can be fitted.
    to : str or Path
        File of the measurement, or a measured depth.
    ranges : sequence of Range
        Free keys with their ranges.
    options : FitOptions
        Options of the search and of the rows.
    listener : Listener
        Told the progress.

    Returns
    -------
    FittedKeys

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used, and for options that this kind of fit does not have, before anything is computed.
    NotConverged
        If the model cannot be computed at any starting point.
    """
    kind = choose_kind(scene, str(to))
    check_options(kind, options)
    if not to or not ranges:
        raise PatchfemError("--to MEASURED and --free KEYS are needed")
    comparison = COMPARISONS[kind](scene, to, ranges)
    return fit_keys(comparison, options, listener)


def choose_kind(scene: Scene, to: str) -> str:
    """Return the kind of fit, "wear", "loop", "rows" or "curve", that the scene and the measured file ask for.

    Raises PatchfemError for a table whose header belongs to no kind of fit.
    """
    if scene.wear is not None:
        return "wear"
    if scene.kind not in ("rig", "linear"):
        return "loop"
    path = Path(to)
    if not path.is_file():
        return "rows"
    names = []
    if path.suffix.lower() not in (".mat", *UNIVERSAL_EXTENSIONS):
        names = read_text(path, "a measured table").names
    columns = {name.lower().removeprefix("decay_") for name in names}
    if columns & (CURVE_UNITS.keys() - RESPONSE_COLUMN_UNITS.keys()):
        return "curve"
    if columns.intersection(RESPONSE_TABLE_FORMAT.required):
        return "rows"
    raise PatchfemError(
        f"{path}:1: a header like `{CURVE_HEADER}` (of a mode, against its amplitude) or `{RESPONSE_TABLE_FORMAT.example}` "
        f"(response to a sine) is needed, not '{','.join(names)[:80]}'; a free decay in records over time "
        f"is fitted as the table that `patchfem import {path} --decay -o decay.csv` writes"
    )


def check_options(kind: str, options: FitOptions) -> None:
    """Raise PatchfemError if an option is invalid or does not belong to `kind` of fit: a worn depth has no rows."""
    for name in ("hold", "leave_out", "starts"):
        if getattr(options, name) and kind == "wear":
            raise PatchfemError(
                f"--{name.replace('_', '-')} applies only to fits to rows of a table, not to a worn depth; leave this "
                "option out"
            )
    starts = options.starts
    if starts is not None and (not isinstance(starts, int) or starts < 1):
        raise PatchfemError(f"--starts {starts}: at least one is needed")
