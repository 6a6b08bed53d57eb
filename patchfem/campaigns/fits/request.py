"""Fit of keys of a scene to a measurement: the tables of the scene and the file choose the kind of fit."""

from collections.abc import Sequence
from pathlib import Path

from ...core import PatchfemError
from ...inputs.measured import COLUMN_UNITS, TABLE_FORMAT
from ...inputs.tables import read_text
from ...model.model import build
from ...scene.files import UNIVERSAL_EXTENSIONS
from ...scene.scene import Scene
from ..rows.fit import FittedRows, fit_rows
from .curve import CURVE_HEADER, CURVE_UNITS, FittedCurve, fit_curve
from .loop import FittedLoop, fit_hysteresis_loop
from .options import FitOptions
from .problem import Listener, parse_ranges
from .wear import FittedCoefficient, fit_wear

# options of each kind of fit
KINDS = {
    "loop": ("hold",),
    "rows": ("hold", "leave_out", "starts"),
    "curve": ("starts",),
    "wear": (),
}
TARGETS = {
    "hold": "a loop under a prescribed slide or rows of a rig",
    "leave_out": "rows of a rig",
    "starts": "rows of a rig or frequency and damping of a rig against amplitude",
}  # what is fitted with an option


def fit_measurement(
    scene: Scene, to: str, free: Sequence[str], options: FitOptions, listener: Listener
) -> FittedLoop | FittedCurve | FittedRows | FittedCoefficient:
    """Fit keys of a scene to a measurement.

    Parameters
    ----------
    scene : Scene
        Its kind decides which measurements can be fitted.
    to : str
        File of the measurement, or a measured depth.
    free : sequence of str
        Free keys with their ranges, "table.key=low..high".
    options : FitOptions
        Options of the search and of the rows.
    listener : Listener
        Told the progress.

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
    check_options(kind, options)
    if not to:
        raise PatchfemError("--to MEASURED and --free KEYS are needed")
    ranges = parse_ranges(free)
    if kind == "wear":
        return fit_wear(build(scene), to, ranges, listener.progress)
    path = Path(to)
    if kind == "curve":
        return fit_curve(scene, path, ranges, options)
    if kind == "loop":
        return fit_hysteresis_loop(scene, path, ranges, options, listener.say)
    return fit_rows(scene, path, ranges, options, listener)


def choose_kind(scene: Scene, to: str) -> str:
    """Return the kind of fit, a key of KINDS, that the tables of a scene and the measured file ask for.

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
    if columns & (CURVE_UNITS.keys() - COLUMN_UNITS.keys()):
        return "curve"
    if columns.intersection(TABLE_FORMAT.required):
        return "rows"
    raise PatchfemError(
        f"{path}:1: a header like `{CURVE_HEADER}` (of a mode, against its amplitude) or `{TABLE_FORMAT.example}` "
        f"(response to a sine) is needed, not '{','.join(names)[:80]}'; a free decay in records over time "
        f"is fitted as the table that `patchfem import {path} --decay -o decay.csv` writes"
    )


def check_options(kind: str, options: FitOptions) -> None:
    """Raise PatchfemError if an option is invalid or does not belong to this kind of fit, a key of KINDS."""
    for name, target in TARGETS.items():
        if getattr(options, name) and name not in KINDS[kind]:
            raise PatchfemError(
                f"--{name.replace('_', '-')} applies only to fits to {target}; leave this option out"
            )
    starts = options.starts
    if starts is not None and (not isinstance(starts, int) or starts < 1):
        raise PatchfemError(f"--starts {starts}: at least one is needed")
