"""The answer of `fit`: fitted values of a scene with their intervals, measured and fitted data.

A fit to a loop, to frequency and damping against amplitude, to rows of a rig or to a worn depth differs in its `Parts`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..campaigns.fits.curve import CURVE_EXTENSION_RATIO, FITTED_NAMES, CurveComparison
from ..campaigns.fits.loop import LoopComparison
from ..campaigns.fits.options import FitOptions
from ..campaigns.fits.problem import FittedKeys, Listener
from ..campaigns.fits.request import fit_measurement
from ..campaigns.fits.rows import RowsComparison
from ..campaigns.fits.wear import DepthComparison
from ..campaigns.free_keys import parse_ranges
from ..disk.atomic_write import write_text
from ..formatting import format_length, format_number
from ..model.model import build, write_resolved
from ..runs.joint import find_source
from ..scene.scene import Scene, add_sets
from .answer import (
    Answer,
    JsonObject,
    Quantities,
    Quantity,
    Remarks,
    Variables,
    encode_texts,
)
from .quantities import format_quantity
from .rows import make_details, make_variables
from .run_data import SENSOR_UNITS
from .runs import make_origin

FITTED_SCENE_FILE = "scene.fitted.toml"
LOOP_FORCE_UNITS = {"force": "N", "friction_ratio": "1"}


def compute_answer(
    scene: Scene,
    to: str,
    free: Sequence[str],
    options: FitOptions,
    listener: Listener,
    folder: Path,
) -> Answer:
    """Fit keys of a scene to a measurement; the fitted scene is written into a folder.

    Parameters
    ----------
    scene : Scene
        Scene whose keys are fitted.
    to : str
        File of the measurement, or a worn depth such as "worn_depth_max=2.5 um..3.5 um".
    free : sequence of str
        Keys to fit with their ranges, such as "friction.static=0.1..0.6".
    options : FitOptions
        Rows that are held out, and settings of the search.
    listener : Listener
        Functions that take a line of text and the completed fraction.
    folder : Path
        Existing folder of the results.

    Returns
    -------
    Answer
        Fitted values with their intervals, the verdict, and measured and computed values as arrays.

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used, before anything is computed.
    """
    fitted = fit_measurement(scene, to, parse_ranges(free), options, listener)
    answer = make_fit_answer(fitted)
    text = format_fitted_scene(fitted, answer.verdict, folder)
    write_text(folder / FITTED_SCENE_FILE, text)
    return answer


class Parts(NamedTuple):
    """What differs between the kinds of fits.

    - residual: sentence on the distance of fit and measurement.
    - scores: quantities of the residual.
    - data: measured and computed values as variables of the answer.
    - details: further keys of fit.json.
    """

    residual: str
    scores: Quantities
    data: Variables
    details: JsonObject


def make_fit_answer(fitted: FittedKeys) -> Answer:
    """Return the answer of a fit from its fitted values and its measurement."""
    comparison = fitted.comparison
    parts = _DESCRIBE_FUNCTIONS[type(comparison)](fitted)
    scene = fitted.keys.scene
    fit = fitted.fit

    # fitted values, and combinations of them that the data do not determine
    values = {}
    measures = {}
    for k, bound in enumerate(fitted.keys.ranges):
        low, high = fit.intervals.ends[k].tolist()
        reason = "" if np.isfinite(low) else "the measurement does not determine an interval"
        one = Quantity(fit.values[k], bound.unit, None, low, high, reason=reason)
        measures[bound.key] = one
        values[bound.key] = one.as_json() | {
            "method": fit.intervals.methods[k],
            "bounds": [bound.low, bound.high],
            "at_bound": fit.at_bound[k] or None,
            "sensitivity": fit.intervals.sensitivity[k],
        }
    unknown = [dict(zip(values, row, strict=True)) for row in fit.intervals.unknown.tolist()]

    details = make_details(
        "fit",
        fitted,
        outcome=str(fit.outcome),
        values=values,
        unknown=[{name: part for name, part in row.items() if part} for row in unknown],
        rows=(~fitted.held_out).sum(),
        held=fitted.held_out.sum(),
        seconds=round(fitted.seconds, 6),
        scores={name: score.value for name, score in parts.scores.items()},
    )
    details |= parts.details

    # the verdict names the most correlated pair of values if their correlation is strong
    verdict = [_make_headline(details, measures), parts.residual]
    pairs = _collect_pairs(fit.intervals.correlation, list(measures))
    # Smallest correlation of two values that the verdict states
    if pairs and abs(pairs["correlation"].values[0]) >= 0.95:
        names = pairs["pair"].values[0].replace(", ", " and ")
        verdict.append(
            f"{names} are correlated by {pairs['correlation'].values[0]:.2f}: the measurement determines a combination "
            "of them better than each one."
        )
    return Answer(
        kind="fit",
        title=scene.title,
        verdict=tuple(verdict),
        quantities=measures | parts.scores,
        data=parts.data | pairs,
        remarks=Remarks(tuple(fitted.warnings), tuple(fitted.notes)),
        details=details,
        origin=make_origin(find_source(build(scene)), "fit"),
    )


def _make_headline(details: JsonObject, measures: Quantities) -> str:
    """Return a sentence with the first fitted values and their intervals."""
    # Further fitted values are in the table only
    named = list(measures.items())[:2]
    text = ", ".join(f"{key} = {format_quantity(key, one)}" for key, one in named)
    if len(measures) > len(named):
        count = len(measures) - len(named)
        text += f" and {count} more key{'s' * (count > 1)}"
    if details["outcome"] != "done":
        return f"The fit to {details['measured']} did not converge; best values so far: {text}."
    return f"Fitted to {details['measured']}: {text}."


def _collect_pairs(correlation: np.ndarray, names: list[str]) -> Variables:
    """Return the correlation of each pair of fitted values, the strongest first; {} for a single value."""
    if len(names) < 2:
        return {}
    first, second = np.triu_indices(len(names), 1)
    values = np.asarray(correlation, float)[first, second]
    order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")
    texts = [f"{names[first[k]]}, {names[second[k]]}" for k in order]
    return make_variables("fit", pair=texts, correlation=values[order])


def describe_loop_fit(fitted: FittedKeys) -> Parts:
    """Return what the answer of a fit to a friction loop contains: residuals, loops and their variables."""
    comparison = fitted.comparison
    loop = comparison.loop
    held_out = fitted.held_out
    unit = LOOP_FORCE_UNITS[loop.quantity]
    fraction = fitted.fit.rms / np.abs(loop.reading).max()
    scores = {
        "residual_rms": Quantity(fitted.fit.rms, unit),
        "residual_fraction": Quantity(fraction),
    }

    text = format_quantity("residual_rms", scores["residual_rms"])
    residual = f"The residual of {np.count_nonzero(~held_out)} rows is {text} rms, {100 * fraction:.2g} % of the peak."
    if loop.quantity == "force":
        # the steps between two fitted rows
        is_used = ~(held_out[1:] | held_out[:-1])
        pairs = np.array([loop.reading, fitted.computed])
        works = (pairs[:, 1:] + pairs[:, :-1]) / 2 @ (np.diff(loop.displacement) * is_used)
        scores["work_measured"], scores["work_fitted"] = (Quantity(work, "J") for work in works)
        share = format_number(100 * works[1] / works[0], 4)
        residual += f" The fitted loop dissipates {share} % of the measured work."

    # the chart shows the residual along the rows, where a pattern is an error of the model
    columns = {
        "slide": loop.displacement,
        loop.quantity: loop.reading,
        "fitted": (fitted.computed, unit),
        "residual": (np.where(held_out, np.nan, fitted.computed - loop.reading), unit),
        "row": np.arange(loop.reading.size),
        "held": held_out.astype(np.int8),
    }
    if loop.time is not None:
        columns["time"] = loop.time
    if held_out.any():  # these rows are drawn apart
        columns["held_out"] = (np.where(held_out, loop.reading, np.nan), unit)
    scores |= {name: Quantity(rms, unit) for name, rms in fitted.score_predictions().items()}
    details = {"step_error": comparison.step_error, "steps_between_rows": comparison.steps_per_row}
    return Parts(residual, scores, make_variables("fit", **columns), details)


def describe_curve_fit(fitted: FittedKeys) -> Parts:
    """Return what the answer of a fit to measured frequency and damping against amplitude contains."""
    comparison = fitted.comparison
    beyond = comparison.extrapolate(fitted.fit)

    # measured and fitted values, and the curve that extends beyond the measured amplitudes
    columns = {"amplitude": comparison.amplitude}
    curve = {"curve_amplitude": beyond[0]}
    scores = {}
    for k, name in enumerate(FITTED_NAMES):
        row = comparison.parts == k
        value = comparison.measured[row]
        distance = fitted.computed[row] - value
        errors = 2 * comparison.deviation[row]  # half the width of a 95 % interval
        is_used = ~fitted.held_out[row]
        rms = np.sqrt(np.mean((distance / value)[is_used] ** 2))
        scores[f"{name}_residual_rms"] = Quantity(rms)
        columns |= {
            name: value,
            f"{name}_error": errors,
            f"{name}_fitted": fitted.computed[row],
            f"{name}_residual": distance / errors,
        }
        curve |= {f"curve_{name}": beyond[k + 1], f"curve_{name}_error": beyond[k + 3]}
    columns["held"] = fitted.held_out[comparison.parts == 0].astype(np.int8)

    frequency, damping = (f"{100 * score.value:.2g} %" for score in scores.values())
    residual = (
        f"At {np.count_nonzero(is_used)} amplitudes the residual is {frequency} rms of the frequency and {damping} of the "
        f"damping ratio, by method {comparison.method}."
    )
    if comparison.is_assumed.any():
        residual += " The errors of the measured values are their scatter around the fit."
    scores |= {name: Quantity(rms) for name, rms in fitted.score_predictions().items()}
    data = make_variables("fit", **columns, **curve)
    # a row of the table has two values
    details = {"method": comparison.method, "rows": is_used.sum(), "held": (~is_used).sum()}
    return Parts(residual, scores, data, details)


def describe_rows_fit(fitted: FittedKeys) -> Parts:
    """Return what the answer of a fit to a table of measured responses contains.

    Its scores are root mean squares of ln(computed/measured).
    """
    comparison = fitted.comparison
    search = fitted.fit
    all_scores = comparison.compute_scores(fitted)
    totals = {name: score["all"] for name, score in all_scores.items() if score is not None}
    texts = []
    for name, value in totals.items():
        if value:
            texts.append(f"{format_number(value, 3)} for those {name.replace('_', ' ')}")
    residual = (
        f"The rms of ln(computed/measured) over readings is {', '.join(texts)}; {search.n_best} of "
        f"{search.descent_rms.size} starts led to within 1 % of the best."
    )
    scores = {f"score_{name}": Quantity(value) for name, value in totals.items()}
    details = {
        "scores": all_scores,
        "scores_stable": comparison.compute_scores(fitted, only_stable=True),
        "rms": search.rms,
        "motions": comparison.readings.n_motions,
    }
    return Parts(residual, scores, _collect_rows(fitted), details)


def _collect_rows(fitted: FittedKeys) -> Variables:
    """Return measured and computed readings of each row and their ratios."""
    cells = fitted.comparison.cells
    rows = cells.rows
    is_held = np.zeros(len(rows), bool)
    is_held[cells.row[fitted.held_out]] = True
    columns = {"held": is_held.astype(np.int8)}
    for name in ("frequency", "input", "flag"):
        columns[name] = [getattr(row, name) for row in rows]

    lines = {}
    for name in SENSOR_UNITS:
        # a row without a reading has no computed one
        is_kind = cells.is_acceleration == (name == "acceleration")
        measured, computed = np.full((2, len(rows)), np.nan)
        measured[cells.row[is_kind]] = cells.measured[is_kind]
        computed[cells.row[is_kind]] = fitted.computed[is_kind]
        ratio = computed / np.where(measured > 0, measured, np.nan)
        columns |= {name: measured, f"computed_{name}": computed, f"{name}_ratio": ratio}
        # ends of the line on which both are equal
        positive = np.concatenate([measured[measured > 0], computed[computed > 0]])
        lines[f"equal_{name}"] = [positive.min(), positive.max()] if positive.size else []

    # codes by which the charts colour the rows
    uses = []
    for row, is_held_out in zip(rows, is_held, strict=True):
        unstable = ", unstable in the test" * ("U" in row.flag)
        uses.append(f"{'held out' if is_held_out else 'fitted'}{unstable}")
    drives = [f"{row.frequency:.6g} Hz" for row in rows]
    codes = {"use": encode_texts("row", uses), "drive": encode_texts("row", drives)}
    return codes | make_variables("fit", **lines, **columns)


def describe_wear_fit(fitted: FittedKeys) -> Parts:
    """Return what the answer of a wear coefficient that was fitted to a measured depth contains."""
    comparison = fitted.comparison
    depth = comparison.depth
    unit = fitted.keys.ranges[0].unit

    # the computed curve is drawn a little beyond the interval of the coefficient
    coefficients, depths = comparison.curve
    is_drawn = coefficients <= CURVE_EXTENSION_RATIO * np.nanmax(fitted.fit.intervals.ends)
    data = make_variables(
        "fit",
        coefficient=(fitted.fit.values, unit),
        depth=[depth.value],
        depth_low=[depth.low],
        depth_high=[depth.high],
        curve_coefficient=(coefficients[is_drawn], unit),
        curve_depth=comparison.factor * depths[is_drawn],
    )

    scores = {"fitted_depth": Quantity(fitted.computed[0], "m", comparison.error)}
    text = format_quantity("fitted_depth", scores["fitted_depth"])
    residual = f"The computed depth is {text}; it was measured as {format_length(depth.low)} to {format_length(depth.high)}."
    measured = comparison.path.name.replace("--to", depth.name)
    details = {"measured": measured, "model_error": comparison.error, "runs": comparison.n_runs}
    return Parts(residual, scores, data, details)


_DESCRIBE_FUNCTIONS = {
    LoopComparison: describe_loop_fit,
    CurveComparison: describe_curve_fit,
    RowsComparison: describe_rows_fit,
    DepthComparison: describe_wear_fit,
}


def format_fitted_scene(fitted: FittedKeys, verdict: Sequence[str], folder: Path) -> str:
    """Return the text of the fitted scene, in SI units with all defaults, below comments that say what was fitted.

    Parameters
    ----------
    fitted : FittedKeys
        Fitted values.
    verdict : sequence of str
        Sentences of the answer.
    folder : Path
        Folder to which the paths of the fitted scene are relative.
    """
    scene = add_sets(fitted.keys.scene, fitted.sets)
    model = build(scene)
    text = write_resolved(scene, model, find_source(model).writer.joint, folder)
    return "\n".join([*(f"# {sentence}" for sentence in verdict), "", text])
