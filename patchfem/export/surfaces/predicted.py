"""Computed wear beside the measured one: results of the run, table, CSV and picture."""

from pathlib import Path

import numpy as np

from ...core import Missing, PatchfemError
from ...disk.atomic_write import write_text
from ...formatting import choose_axis_unit
from ...scene.keys.quantities import parse_quantity
from ...surface.compare.compare import Comparison
from ...surface.compare.predicted import PredictedWear, WearHistory, fit_computed_wear
from ...surface.profile import Profile
from ..drawing.charts import make_axis, make_chart, make_line, make_mark
from ..drawing.pictures import draw_charts
from ..read_results import read_variables, reading_errors, require_valid
from .pictures import MAX_POINTS, Picture, depth_axis
from .quantities import QuantityTable, Row, format_quantity, quantity_data
from .worn_runs import PatchRun, read_run

PIECES = ("upper", "lower")
HEADS = ("value", "95 %", "unit")
LABELS = {
    "coefficient": "wear coefficient",
    "patch_centre": "middle of the patch, x in the second trace",
}
COLUMNS = "x_patch [um],measured [um],computed [um],difference [um],noise [um]"


def predict_wear(parts: list, folder: Path, piece: str = "") -> PredictedWear:
    """Fit the computed wear of a run to the wear measured by traces along x.

    Parameters
    ----------
    parts : list of Comparison
        One for each direction.
    folder : Path
        Results folder of the run.
    piece : str
        "upper" or "lower", of which the traces are; "" if both wear alike.

    Raises
    ------
    PatchfemError
        If the run or the traces do not fit together.
    """
    return fit_computed_wear(_choose_part(parts), read_history(folder, piece))


def _choose_part(parts: list) -> Comparison:
    """Return the comparison of the traces that run along the sliding direction."""
    if not isinstance(parts[0].before, Profile):
        raise PatchfemError(
            "compare --predicted: the computed wear can be laid over traces only; write one line of heights of each "
            "scan to a file of its own"
        )
    for part in parts:
        if part.direction != "y":
            return part
    raise PatchfemError(
        "compare --predicted: the computed depth lies along x, the sliding direction, and the traces run along y; give "
        "traces along x"
    )


def read_history(folder: Path, piece: str = "") -> WearHistory:
    """Read the worn depth of a piece over the cycles of a run from its results folder."""
    if not folder.exists():
        raise Missing(f"compare --predicted {folder}: there is no such folder")
    if piece not in ("", *PIECES):
        raise PatchfemError(f"compare --piece {piece}: the piece must be upper or lower")
    run = read_run(folder)
    _require_wear(run, folder)
    wear = run.run.resolved["wear"]
    upper_share = float(wear["upper_share"])
    if not piece and upper_share != 0.5:
        raise PatchfemError(
            f"compare --predicted {folder}: with wear.upper_share = {upper_share:g} the pieces wear differently; say "
            "with --piece upper or --piece lower of which piece the traces are"
        )
    piece_fraction = 1 - upper_share if piece == "lower" else upper_share
    if not piece_fraction > 0:
        raise PatchfemError(
            f"compare --piece {piece}: with wear.upper_share = {upper_share:g} this piece does not wear"
        )
    names = {"worn_depth", "weight", "wear_cycle", "wear_worn_volume"}
    file = folder / "result.nc"
    fields = {name: variable.values for name, variable in read_variables(file, names)[1].items()}
    with reading_errors(file, "results of a run with [wear]"):
        for name in names:
            require_valid(name in fields, f"it contains no {name}; run the scene again")
        volume = fields["worn_depth"] @ fields["weight"]
        require_valid(volume[-1] > 0, "nothing wore off")
        total = fields["wear_worn_volume"] / fields["wear_worn_volume"][-1]
        cycle = np.interp(volume / volume[-1], total, fields["wear_cycle"])
    work, first = np.unique(cycle / cycle[-1], return_index=True)
    return WearHistory(
        x=run.surface.x,
        work=work,
        depth=piece_fraction * fields["worn_depth"][first],
        coefficient=parse_quantity(wear["coefficient"], "wear coefficient"),
        error=_relative_error(run),
        source=str(folder),
        piece=piece or "worn",
    )


def _require_wear(run: PatchRun, folder: Path) -> None:
    """Raise PatchfemError unless the run gives the worn depth of a single trace since the unworn state."""
    name = f"compare --predicted {folder}"
    if not run.has_wear:
        raise PatchfemError(
            f"{name}: this run has no [wear], so it computed no worn depth; add [wear] with coefficient and cycles to "
            "its scene and run it again"
        )
    if "start" in run.run.resolved["wear"]:
        raise PatchfemError(
            f"{name}: this run starts from worn pieces (wear.start); give a run that starts from unworn pieces"
        )
    if run.surface.y is not None:
        raise PatchfemError(
            f"{name}: the patch is in strips, and a trace shows one line; give a run without [contact.strips]"
        )


def _relative_error(run: PatchRun) -> float:
    """Return the largest relative numerical error of the worn volume and the worn depth."""
    errors = [0.0]
    for name in ("worn_volume", "worn_depth_max"):
        measure = run.measure(name)
        if measure is not None and measure["error"] is not None and measure["value"] > 0:
            errors.append(measure["error"] / measure["value"])
    return max(errors)


def predicted_table(predicted: PredictedWear) -> QuantityTable:
    """Return the table of the fitted wear coefficient and position."""
    rows = []
    for name, quantity in _fit_values(predicted).items():
        unit = ("m^2/N", 1.0) if name == "coefficient" else None
        rows.append(Row(LABELS[name], quantity, unit, meaning=quantity.text))
    name = f"computed wear of {predicted.history.source}"
    if predicted.is_mirrored:
        name += ", x of the patch against x of the traces"
    return QuantityTable((name, *HEADS), rows)


def _fit_values(predicted: PredictedWear) -> dict:
    """Return the fitted wear coefficient and the position of the patch centre."""
    return {"coefficient": predicted.coefficient, "patch_centre": predicted.centre}


def predicted_data(predicted: PredictedWear) -> dict:
    """Return the fitted wear as a dict in SI units."""
    out = {name: quantity_data(quantity) for name, quantity in _fit_values(predicted).items()}
    difference = predicted.difference
    out |= {
        "difference_rms": predicted.difference_rms,
        "sentence": predicted.sentence,
        "run": predicted.history.source,
        "piece": predicted.history.piece,
        "run_coefficient": predicted.history.coefficient,
        "proportional_coefficient": predicted.proportional,
        "extrapolated": predicted.is_extrapolated,
        "mirrored": predicted.is_mirrored,
        "largest_difference": None,
        "notes": list(predicted.notes),
    }
    if difference is not None:
        out["largest_difference"] = {
            "from": difference.start,
            "to": difference.end,
            "value": difference.depth,
            "computed": difference.computed,
        }
    return out


def write_csv(path: Path, predicted: PredictedWear) -> None:
    """Write measured and computed depth along the patch as text in micrometres."""
    x, measured, computed, noise = predicted.depths
    table = np.column_stack([x, measured, computed, predicted.depths.difference, noise]) * 1e6
    rows = [",".join(f"{number:.6g}" for number in row) for row in table]
    write_text(path, "\n".join([COLUMNS, *rows, ""]))


def predicted_picture(predicted: PredictedWear) -> Picture:
    """Draw the computed and the measured depth in one chart, and their difference in another."""
    place, measured, computed, noise = predicted.depths
    along, mm = choose_axis_unit(place, "m")
    up, um = choose_axis_unit(measured, "m")
    x = place * mm
    low = (measured - 2 * noise) * um
    high = (measured + 2 * noise) * um
    difference = predicted.depths.difference * um
    axis = make_axis("x of the patch", along) | {"range": [x[0], x[-1]]}
    depths = np.concatenate([measured, computed])
    marks = [
        make_mark("band", "soft", "measured, 95 % noise", x=x, low=low, high=high),
        make_line(x, measured * um, "soft", "measured", max_points=MAX_POINTS, width=1.0),
        make_line(x, computed * um, "accent", "computed", max_points=MAX_POINTS, width=1.6),
    ]
    below = [
        make_line(
            x, difference, "warm", "measured less computed", max_points=MAX_POINTS, width=1.0
        ),
        make_line(x[[0, -1]], [0.0, 0.0], "soft", width=0.8),
    ]
    part = predicted.difference
    if part is not None:
        ends = {"left": part.start * mm, "right": part.end * mm}
        below.append(make_mark("span", "soft", "largest difference", **ends))
    coefficient = format_quantity(predicted.coefficient, ("m^2/N", 1.0)).long
    return Picture(
        draw_charts(
            [
                make_chart("Worn depth", axis, depth_axis(up, depths, um), marks),
                make_chart("Difference", axis, make_axis("difference", up), below),
            ],
            height=3.4,
        ),
        "Left: worn depth of the measured traces and of the run with the fitted wear coefficient, over x of the patch "
        "(0 in its middle). Right: measured less computed depth; above zero, more wore off than computed.",
        f"Computed wear over the measured one: wear coefficient {coefficient}",
    )
