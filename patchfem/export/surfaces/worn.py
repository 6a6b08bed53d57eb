"""Wear of runs, from their results folders: between two runs, and computed wear beside a measured one."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length, format_number
from ...scene.keys.quantities import parse_quantity
from ...surface.compare.records import Comparison
from ...surface.quantity import HALF_WIDTH_95
from ...wear import between_runs
from ...wear import predicted as predicted_wear
from ...wear.between_runs import PatchState, Wear
from ...wear.predicted import MeasuredDepth, PredictedWear, WearHistory
from .. import quantities, store
from ..answer import Answer, Quantity, Remarks, Variables
from ..rows import make_details, make_variables
from . import shared
from .shared import SURFACE_NAMES, build_answer, format_value, make_band, make_maps

REQUIRED_VARIABLES = ("x", "weight", "unloaded_gap", "normal_stress")
# Smallest rms of a smooth difference, relative to the mean depth and to its noise, that shows another shape
MIN_SHAPE_MISFIT_FRACTION = 0.1
MIN_SHAPE_MISFIT_DEVIATIONS = 2.0
PROPOSAL_FACTOR = 1.2  # ratio of the wear coefficient that a note proposes to the fitted one
# Hidden wear relative to the mean depth from which on the verdict states it.
MIN_HIDDEN_WEAR_RATIO = 0.01
BOTH_PIECES_NOTE = (
    "Depths, areas and volumes are those of both pieces together; their intervals are the numerical errors of "
    "the runs."
)


class PatchRun(NamedTuple):
    """Run of a patch: its answer, the tables of its scene, and the state of its surface at the end."""

    answer: Answer
    tables: dict[str, dict]
    state: PatchState

    @property
    def cycles(self) -> float:
        """Number of cycles of wear."""
        cycles = self.answer.data.get("wear_frame")
        return 0.0 if cycles is None else float(cycles.values[-1])


def read_patch(folder: Path) -> PatchRun:
    """Read the run of a patch from a results folder.

    Raises
    ------
    Missing
        If there is no such folder.
    PatchfemError
        If it does not have the results of a run with [contact].
    """
    answer = store.read_answer(folder)
    data = answer.data
    scene = tomllib.loads(answer.origin.get("resolved", ""))
    if "contact" not in scene:
        raise PatchfemError(
            f"{folder}: a run without [contact] has no surfaces to compare; "
            "give a run with [contact] and [wear]"
        )
    missing = [name for name in REQUIRED_VARIABLES if name not in data]
    if missing:
        raise PatchfemError(
            f"{folder}: result.nc contains no {' and no '.join(missing)}; run the scene again"
        )

    # A field over a face has a row for each y.
    x = data["x"].values
    y = data["y"].values if "y" in data else None
    shape = x.shape if y is None else (y.size, x.size)
    depth = read_worn_depths(answer)[-1] if "wear" in scene else np.zeros(x.size)
    weight = data["weight"].values
    fields = (weight, data["unloaded_gap"].values, depth)
    try:
        area, gap, depth = (np.broadcast_to(field, shape) for field in fields)
    except ValueError:
        raise PatchfemError(
            f"{folder}: the fields in result.nc differ in length; run the scene again"
        ) from None

    # Measures of the wear with their errors, as far as the run has them.
    measures = {
        name: (answer.quantities[name].value, answer.quantities[name].error)
        for name in ("worn_volume", "worn_depth_max")
        if name in answer.quantities
    }
    state = PatchState(str(folder), scene["contact"], x, y, area, gap, depth, measures)
    return PatchRun(answer, scene, state)


def read_worn_depths(answer: Answer) -> np.ndarray:
    """Return the worn depth [m] of both pieces after the cycles of `wear_frame`: (f, m), or (f, ny, nx) over a face."""
    if "wear_worn_depth" not in answer.data:
        raise PatchfemError("result.nc contains no wear_worn_depth; run the scene again")
    return answer.data["wear_worn_depth"].values


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
    fitted = predicted_wear.fit_wear(_measure_depth(comparison), read_history(folder, piece))
    numbers = {"wear_coefficient": fitted.coefficient, "patch_centre": fitted.centre}
    values = shared.convert_quantities(numbers)
    sentence = describe_fit(fitted)
    notes = describe_reliability(fitted)
    warnings = warn_of_other_shape(fitted)

    # Content of compare.json on the fit and its run.
    entry = make_details(
        "predicted",
        fitted,
        coefficient=values["wear_coefficient"],
        patch_centre=values["patch_centre"],
        sentence=sentence,
        warnings=warnings,
        notes=notes,
    )
    details = answer.details | {"predicted": entry}
    details["sentences"] = [*details["sentences"], sentence, *warnings]
    details["notes"] = [*details["notes"], *notes]

    # the sentence belongs to the verdict, whose last sentence then becomes a note
    kept = shared.MAX_VERDICT_SENTENCES - 1
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
    elif curves is None or not shared.is_known(area) or not area.low > 0:
        reason = shared.MISSING_VALUE_REASONS.get(getattr(area, "reason", ""), "no wear is shown")
        reason = f"no worn depth was measured: {reason}"
    if reason:
        raise PatchfemError(f"compare --predicted: {reason}")

    # what the interval of the lost area adds to all depths alike
    known = np.isfinite(curves.depth)
    x = curves.x[known]
    datum_error = (area.high - area.low) / (2 * HALF_WIDTH_95) / np.ptp(x)
    track = comparison.track
    width = None if track is None or any(track.cut) else track.values["width"].value
    errors = curves.errors
    return MeasuredDepth(
        x,
        curves.depth[known],
        curves.noise[known],
        errors.correlation,
        datum_error,
        width,
        errors.gain,
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
    depth = read_worn_depths(run.answer)
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
    coefficient = format_value("wear_coefficient", fitted.coefficient)
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
    # Number of independent blocks of a difference of depths below which it is a smooth pattern, not
    # scatter
    if fitted.n_blocks >= 10.0 or fitted.difference_rms <= limit:
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
    # Smallest relative difference of the proportional coefficient that is reported.
    if abs(fitted.proportional / value - 1) > 0.01:
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


def answer_runs(before: Path, after: Path) -> Answer:
    """Compare the runs in two results folders.

    Parameters
    ----------
    before, after : Path
        The later run has [wear]; the earlier one may be new.

    Returns
    -------
    Answer

    Raises
    ------
    Missing
        If a folder does not exist.
    PatchfemError
        If a folder is no run of a patch, or if the two are not states of one patch in this order.
    """
    for path, other in ((before, after), (after, before)):
        if path.is_file():
            raise PatchfemError(
                f"{path}: a file, while {other} is a folder: two files of surfaces or two results folders are needed"
            )
    runs = (read_patch(before), read_patch(after))
    if "wear" not in runs[1].tables:
        raise PatchfemError(
            f"{after}: this run has no [wear], so nothing wore off; give the run with [wear] as the second folder"
        )
    return make_wear_answer(runs, between_runs.measure_wear(runs[0].state, runs[1].state))


def make_wear_answer(runs: tuple[PatchRun, PatchRun], wear: Wear) -> Answer:
    """Return the answer on the wear of a patch between two runs: its sentences, quantities and curves."""
    verdict = describe_wear(runs, wear)
    # Measures and warnings of the run before and of the run after.
    named = dict(zip(SURFACE_NAMES, runs, strict=True))
    compared = shared.compare_measures({side: run.answer.quantities for side, run in named.items()})
    sides = {}
    warnings = []
    for side, run in named.items():
        measures = {name: pair[side] for name, pair in compared.items() if pair[side]}
        outcome = run.answer.details.get("outcome")
        sides[side] = {"outcome": outcome, "cycles": run.cycles, "measures": measures}
        warnings += [f"{side}: {text}" for text in run.answer.remarks.warnings]

    # Wear only removes material, so the later run cannot be less worn.
    if wear.depth.min() < -wear.error:
        warnings.append(
            f"at {_find_place(runs[1], np.argmin(wear.depth))} the later run is worn by "
            f"{format_length(-wear.depth.min(), 3)} less, so it does not continue the earlier one"
        )

    # Both runs have the same coordinates, so that the second surface needs no alignment.
    zero = {"shift": Quantity(0.0, "m", low=0.0, high=0.0)}
    return build_answer(
        sources=[run.state.source for run in runs],
        words=shared.Words(verdict, tuple(warnings), (BOTH_PIECES_NOTE,)),
        values=wear.values,
        track=wear.track,
        data=_make_data(runs, wear),
        details={
            "direction": "x",
            "reference": "run",
            **zero,
            "registration": zero | {"mirrored": False},
            "removed": dict.fromkeys(SURFACE_NAMES, 0),
            "runs": sides,
            "measures": compared,
            "notes": warnings,
        },
    )


def describe_wear(runs: tuple[PatchRun, PatchRun], wear: Wear) -> tuple[str, ...]:
    """Return the verdict: worn depth, worn part, hidden wear, and the main measures before and after."""
    values = wear.values
    if not values["worn_depth_mean"].value > 0:
        return ("Nothing wore off between the two runs.",)
    after = runs[1]
    since = f" (the surface before: {runs[0].cycles:.6g})" if runs[0].cycles else ""
    if "start" in after.tables["wear"]:
        since += f", continued from {Path(after.tables['wear']['start']).name}"
    depth = format_value("worn_depth_mean", values["worn_depth_mean"])
    headline = (
        f"Worn depth {depth}, the mean over the patch, after {after.cycles:.6g} cycles{since}."
    )
    volume, largest = (
        format_value(name, values[name]) for name in ("worn_volume", "worn_depth_max")
    )
    loss = (
        f"{volume} are lost, at most {largest} deep, at {_find_place(after, np.argmax(wear.depth))}"
    )

    verdict = [headline, f"{loss}."]
    # A part that hardly counts is not stated.
    if values["hidden_wear"].value > MIN_HIDDEN_WEAR_RATIO * values["worn_depth_mean"].value:
        hidden = format_value("hidden_wear", values["hidden_wear"])
        measurement = "trace" if after.state.y is None else "scan"
        verdict.append(
            f"Of this depth, {hidden} on average is even or wedge-shaped wear, which a {measurement} alone cannot show."
        )
    return (*verdict, *_describe_measures(runs))


def _find_place(run: PatchRun, number) -> str:
    """Return where on the patch a node lies, given its number."""
    state = run.state
    strip, node = divmod(int(number), state.x.size)
    text = f"x = {format_length(state.x[node], 3)}"
    return text if state.y is None else f"{text}, y = {format_length(state.y[strip], 3)}"


def _describe_measures(runs: tuple[PatchRun, PatchRun]) -> list[str]:
    """Return the sentence with the main measures before and after; [] if there are none."""
    parts = []
    # First ones of COMPARED_MEASURES, which the verdict states
    for name in shared.COMPARED_MEASURES[:3]:
        pair = [run.answer.quantities.get(name) for run in runs]
        if all(shared.is_known(number) for number in pair):
            first, second = (quantities.format_quantity(name, number) for number in pair)
            parts.append(f"{name.replace('_', ' ')} {first} and {second}")
    return [f"Before and after: {'; '.join(parts)}."] if parts else []


def _make_data(runs: tuple[PatchRun, PatchRun], wear: Wear) -> Variables:
    """Return gaps, worn depth and its hidden part along the patch, and pressure and friction loop of both runs."""
    state = runs[1].state
    before, after = wear.gaps
    if state.y is not None:
        data = make_maps(state.x, state.y, before_map=before, after_map=after, depth_map=wear.depth)
    else:
        line = np.interp(state.x, state.x[[0, -1]], wear.hidden)
        data = make_variables(
            "surface",
            x=state.x,
            gap_before=before,
            gap_after=after,
            depth=wear.depth,
            hidden_depth=line,
        )

    if wear.track:
        ends = [wear.track[name].value for name in ("from", "to")]
        data |= make_variables("surface", track_end=ends)

    # Pressure of the last frame, on a face that at y = 0, and the loop of a single interface.
    for side, run in zip(SURFACE_NAMES, runs, strict=True):
        variables = run.answer.data
        last = np.atleast_2d(variables["normal_stress"].values[-1])
        middle = last[(len(last) - 1) // 2 : len(last) // 2 + 1].mean(axis=0)
        columns = {f"x_pressed_{side}": run.state.x, f"pressure_{side}": middle}
        if "loop_slide" in variables and variables["loop_slide"].values.ndim == 1:
            columns[f"slide_{side}"] = variables["loop_slide"].values
            columns[f"force_{side}"] = variables["loop_friction_force"].values
        data |= make_variables("surface", **columns)
    return data
