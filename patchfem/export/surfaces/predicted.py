"""Computed wear of a run beside a measured one: results of the run, sentence, quantities and curves."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length, format_number
from ...scene.keys.quantities import parse_quantity
from ...surface.compare.records import Comparison
from ...surface.quantity import HALF_WIDTH_95
from ...wear import predicted
from ...wear.predicted import MeasuredDepth, PredictedWear, WearHistory
from ..answer import Answer, Quantity, Remarks
from ..rows import make_variables
from . import sentences
from .patches import read_patch, worn_depths
from .variables import make_band

# Smallest relative difference of the proportional coefficient that is reported.
MIN_COEFFICIENT_DIFFERENCE = 0.01
# Number of independent blocks of a difference of depths below which it is a smooth pattern, not scatter
MIN_SCATTER_BLOCKS = 10.0
# Smallest rms of a smooth difference, relative to the mean depth and to its noise, that shows another shape
MIN_SHAPE_MISFIT_FRACTION = 0.1
MIN_SHAPE_MISFIT_DEVIATIONS = 2.0
PROPOSAL_FACTOR = 1.2  # ratio of the wear coefficient that a note proposes to the fitted one


def add_predicted(answer: Answer, comparison: Comparison, folder: Path, piece: str) -> Answer:
    """Add the computed wear of a run, fitted to the measured wear.

    Parameters
    ----------
    answer : Answer
        Of the comparison.
    comparison : Comparison
        Two traces along x.
    folder : Path
        Results folder of a run with [wear].
    piece : str
        "upper" or "lower"; "" if both pieces wear alike.

    Raises
    ------
    PatchfemError
        If the traces show no depth or run along y, or if the run cannot be theirs.
    """
    # The fit has the wear coefficient, the position of the patch, and both depths along it.
    fitted = predicted.fit_wear(_measure_depth(comparison), read_history(folder, piece))
    numbers = {"wear_coefficient": fitted.coefficient, "patch_centre": fitted.centre}
    values = sentences.to_answers(numbers)
    sentence = describe_fit(fitted)
    notes = describe_reliability(fitted)
    warnings = warn_of_other_shape(fitted)

    # Content of compare.json on the fit and its run.
    entry = {
        "coefficient": values["wear_coefficient"],
        "patch_centre": values["patch_centre"],
        "difference_rms": fitted.difference_rms,
        "sentence": sentence,
        "run": fitted.history.source,
        "piece": fitted.history.piece,
        "run_coefficient": fitted.history.coefficient,
        "proportional_coefficient": fitted.proportional,
        "extrapolated": fitted.is_extrapolated,
        "mirrored": fitted.is_mirrored,
        "warnings": warnings,
        "notes": notes,
    }
    details = answer.details | {"predicted": entry}
    details["sentences"] = [*details["sentences"], sentence, *warnings]
    details["notes"] = [*details["notes"], *notes]

    # the sentence belongs to the verdict, whose last sentence then becomes a note
    kept = sentences.MAX_VERDICT_SENTENCES - 1
    notes = (*answer.remarks.notes, *answer.verdict[kept:], *notes)

    # Both depths along the patch, with the 95 % band of the measured one, for the chart.
    depths = fitted.depths
    data = make_variables(
        "surface",
        x_patch=depths.x,
        computed_depth=depths.computed,
        depth_difference=depths.measured - depths.computed,
    )
    data |= make_band("measured_depth", depths.measured, HALF_WIDTH_95 * depths.noise)
    return replace(
        answer,
        verdict=(*answer.verdict[:kept], sentence),
        quantities=answer.quantities
        | values
        | {"difference_rms": Quantity(fitted.difference_rms, "m")},
        data=answer.data | data,
        remarks=Remarks((*answer.remarks.warnings, *warnings), notes),
        details=details,
    )


def _measure_depth(comparison: Comparison) -> MeasuredDepth:
    """Return the measured depth of two traces along x, or raise PatchfemError."""
    curves = comparison.evidence.curves
    area = comparison.values.get("worn_area")
    reason = ""
    if comparison.is_areal or comparison.direction == "y":
        reason = "the computed depth lies along x, the sliding direction; give traces along x, not scans or traces along y"
    elif curves is None or not sentences.is_known(area) or not area.low > 0:
        reason = sentences.MISSING_VALUE_REASONS.get(
            getattr(area, "reason", ""), "no wear is shown"
        )
        reason = f"no worn depth was measured: {reason}"
    if reason:
        raise PatchfemError(f"compare --predicted: {reason}")

    # what the interval of the lost area adds to all depths alike
    known = np.isfinite(curves.depth)
    x = curves.x[known]
    datum_error = (area.high - area.low) / (2 * HALF_WIDTH_95) / np.ptp(x)
    track = comparison.track
    width = None if track is None or any(track.cut) else track.values["width"].value
    correlation = curves.errors.correlation
    return MeasuredDepth(
        x, curves.depth[known], curves.noise[known], correlation, datum_error, width
    )


def read_history(folder: Path, piece: str = "") -> WearHistory:
    """Read the worn depth of a piece over the cycles of a run from its results folder.

    Raises
    ------
    PatchfemError
        If the folder is not that of a run from unworn pieces with [wear] over a plane patch.
    """
    run = read_patch(folder)
    wear = run.tables.get("wear", {})
    upper_share = wear.get("upper_share", 0.0)
    share = {"lower": 1 - upper_share, "upper": upper_share, "": 0.5}.get(piece, 0.0)

    # A run that cannot be that of the traces is refused with the reason.
    checks = (
        (
            not wear,
            "this run has no [wear]; add [wear] with coefficient and cycles to its scene and run it again",
        ),
        (
            "start" in wear,
            "it starts from worn pieces (wear.start); give a run that starts from unworn pieces",
        ),
        (run.state.y is not None, "a trace shows one line; give a run without [contact.area]"),
        (
            not piece and upper_share != share,
            f"with wear.upper_share = {upper_share:g} the pieces wear differently; say with --piece upper or --piece "
            "lower of which piece the traces are",
        ),
        (not share > 0, f"no piece '{piece}' wears; give --piece upper or --piece lower"),
    )

    for applies, text in checks:
        if applies:
            raise PatchfemError(f"compare --predicted {folder}: {text}")

    # Worn depth of both pieces in each frame of the wear; of frames of the same cycle the first one counts.
    depth = worn_depths(run.answer)
    if not depth[-1].max() > 0:
        raise PatchfemError(f"compare --predicted {folder}: nothing wore off in this run")
    cycles = run.answer.data["wear_frame"].values
    work, first = np.unique(cycles / cycles[-1], return_index=True)
    errors = [(error or 0.0) / value for value, error in run.state.measures.values() if value]
    return WearHistory(
        x=run.state.x,
        work=work,
        depth=share * depth[first],
        coefficient=parse_quantity(wear["coefficient"], "wear coefficient"),
        error=max(errors, default=0.0),
        source=str(folder),
        piece=piece or "worn",
    )


def describe_fit(fitted: PredictedWear) -> str:
    """Return the sentence on the fitted coefficient and the difference between both depths."""
    coefficient = sentences.format_value("wear_coefficient", fitted.coefficient)
    return (
        f"With a wear coefficient of {coefficient} the computed depth of the {fitted.history.piece} piece differs from the "
        f"measured depth by {format_length(fitted.difference_rms, 3)} rms ({_format_percent(fitted)} of the mean computed "
        f"depth over the patch, {format_length(fitted.mean_computed, 3)})."
    )


def _format_percent(fitted: PredictedWear) -> str:
    """Return the rms difference of both depths relative to the mean computed depth as text, such as "2.6 %"."""
    return f"{format_number(100 * fitted.difference_rms / fitted.mean_computed, 2)} %"


def warn_of_other_shape(fitted: PredictedWear) -> list[str]:
    """Return a list with a warning if the computed depth has another shape than the measured one, or [].

    The shape is another one if the difference of both depths is a smooth pattern that neither scatter nor noise explains.
    """
    noise = fitted.depths.noise[fitted.on_patch]
    deviation = np.sqrt(np.mean(noise**2) + fitted.datum_error**2)
    limit = max(
        MIN_SHAPE_MISFIT_FRACTION * fitted.mean_computed, MIN_SHAPE_MISFIT_DEVIATIONS * deviation
    )
    if fitted.n_blocks >= MIN_SCATTER_BLOCKS or fitted.difference_rms <= limit:
        return []
    return [
        f"The computed shape does not fit: the two depths differ in a smooth pattern by {_format_percent(fitted)} of the "
        "mean computed depth (rms), which noise and scatter do not explain, so the wear coefficient may lie outside its "
        "interval; check wear.upper_share and --piece, the place of the patch in the traces (patch_centre), and load, "
        "pieces and wear.coefficient of the run."
    ]


def describe_reliability(fitted: PredictedWear) -> list[str]:
    """Return the sentences on what the fitted coefficient rests on."""
    notes = []
    value = fitted.coefficient.value
    if fitted.is_extrapolated:
        notes.append(
            "The measured depth is larger than that of the run, so that the coefficient is extrapolated from its "
            "last frames; run the scene again with "
            f'wear.coefficient = "{PROPOSAL_FACTOR * value:.2g} m^2/N" and compare again.'
        )
    if abs(fitted.proportional / value - 1) > MIN_COEFFICIENT_DIFFERENCE:
        notes.append(
            "The computed depth is not proportional to the coefficient, because the pressure changes with wear; the last "
            f"depth of the run in proportion would give {format_number(fitted.proportional, 4)} m^2/N."
        )
    if fitted.is_mirrored is None:
        notes.append(
            "The computed wear fits as well with x of the patch against x of the traces; the interval of the coefficient "
            "contains both."
        )
    return notes
