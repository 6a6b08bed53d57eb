"""The answer of `fit`: fitted values of a scene with their intervals, measured and fitted data.

A fit to a loop, to frequency and damping against amplitude, to rows of a rig or to a worn depth differs in its `Parts`.
"""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import __version__
from ..campaigns.fits.curve import CURVE_EXTENSION_RATIO, FittedCurve
from ..campaigns.fits.loop import FittedLoop
from ..campaigns.fits.options import FitOptions
from ..campaigns.fits.problem import FittedKeys, Listener
from ..campaigns.fits.request import fit_measurement
from ..campaigns.fits.wear import COEFFICIENT_KEY, FittedCoefficient
from ..campaigns.rows.fit import FittedRows
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
    make_columns,
)
from .quantities import format_quantity
from .run_data import SENSOR_UNITS
from .runs import make_origin

FITTED_SCENE_FILE = "scene.fitted.toml"
MAX_HEADLINE_VALUES = 2  # further fitted values are in the table only
MIN_REPORTED_CORRELATION = 0.95  # smallest correlation of two values that the verdict states
LOOP_FORCE_UNITS = {"force": "N", "friction_ratio": "1"}
# settings and gains of the sensors of a rig that a scene may leave out
DEFAULT_SENSOR_SETTINGS = {
    "reading": "peak",
    "reading_cutoff": None,
    "acceleration_gain": 1.0,
    "displacement_gain": 1.0,
}
WEAR_COEFFICIENT_UNIT = "m2 N-1"
AnyFit = FittedLoop | FittedCurve | FittedRows | FittedCoefficient


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
    fit = fit_measurement(scene, to, free, options, listener)
    answer = make_answer(fit, scene)
    write_text(folder / FITTED_SCENE_FILE, format_fitted_scene(fit, scene, answer.verdict, folder))
    return answer


class Parts(NamedTuple):
    """What differs between the kinds of fits.

    - residual: sentence on the distance of fit and measurement.
    - details: further keys of fit.json, among them `measured` (name of the file) and `quantity` (what was measured).
    - scores: quantities of the residual.
    - data: measured and computed values as variables of the answer.
    """

    residual: str
    details: JsonObject
    scores: Quantities
    data: Variables


def make_answer(fit: AnyFit, scene: Scene) -> Answer:
    """Return the answer of a fit.

    Parameters
    ----------
    fit : FittedLoop, FittedCurve, FittedRows or FittedCoefficient
        Fitted values with their intervals, and the measurement.
    scene : Scene
        Scene before the fit.
    """
    # Sentence on the residual, details, scores and arrays of this kind of fit.
    parts = _DESCRIBE_FUNCTIONS[type(fit)](fit)
    details = {"patchfem": __version__, "title": scene.title, "outcome": "done"}
    if isinstance(fit, FittedCoefficient):
        details["values"] = _describe_coefficient(fit)
    else:
        details |= _describe_search(fit.keys)
    details |= parts.details

    # fitted values; without an interval they have the reason
    measures = {}
    for name, entry in details["values"].items():
        reason = "" if entry["interval"] else "the measurement does not determine an interval"
        low, high = entry["interval"] or (None, None)
        entry |= {"low": low, "high": high}
        measures[name] = Quantity(entry["value"], entry["unit"], None, low, high, reason=reason)

    # the verdict names the most correlated pair of values if their correlation is strong
    verdict = [_make_headline(details, measures), parts.residual]
    pairs = _collect_pairs(details.get("correlation", ()), list(measures))
    if pairs and abs(pairs["correlation"].values[0]) >= MIN_REPORTED_CORRELATION:
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
        remarks=Remarks(tuple(details["warnings"]), tuple(details.get("notes", ()))),
        details=details,
        origin=make_origin(find_source(build(scene)), "fit"),
    )


def _make_headline(details: JsonObject, measures: Quantities) -> str:
    """Return a sentence with the first fitted values and their intervals."""
    named = list(measures.items())[:MAX_HEADLINE_VALUES]
    text = ", ".join(f"{key} = {format_quantity(key, one)}" for key, one in named)
    if len(measures) > len(named):
        text += f" and {len(measures) - len(named)} more"
    source = details["measured"]
    if source == "--to":  # a depth given with the command
        source = details["quantity"]
    if details["outcome"] != "done":
        return f"The fit to {source} did not converge; best values so far: {text}."
    return f"Fitted to {source}: {text}."


def _collect_pairs(correlation: np.ndarray, names: list[str]) -> Variables:
    """Return the correlation of each pair of fitted values, the strongest first; {} for a single value."""
    if len(names) < 2:
        return {}
    first, second = np.triu_indices(len(names), 1)
    values = np.asarray(correlation, float)[first, second]
    order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")
    texts = [f"{names[first[k]]}, {names[second[k]]}" for k in order]
    return make_columns("pair", {"pair": (texts, ""), "correlation": (values[order], "1")})


def _describe_coefficient(fit: FittedCoefficient) -> dict[str, JsonObject]:
    """Return {key of the wear coefficient: value, unit, interval and bounds}, the fitted values of fit.json."""
    value = {"value": fit.value, "unit": WEAR_COEFFICIENT_UNIT, "interval": [fit.low, fit.high]}
    return {COEFFICIENT_KEY: value | {"bounds": [fit.bounds.low, fit.bounds.high]}}


def _describe_search(keys: FittedKeys) -> JsonObject:
    """Return what fit.json says of a search: values with intervals, outcome, counts, and what the data leave open."""
    fit = keys.fit
    intervals = fit.intervals
    values = {}
    for k, bound in enumerate(keys.ranges):
        ends = intervals.ends[k].tolist()
        values[bound.key] = {
            "value": fit.values[k],
            "unit": bound.unit,
            "interval": ends if np.isfinite(ends).all() else None,
            "method": intervals.methods[k],
            "bounds": [bound.low, bound.high],
            "at_bound": fit.at_bound[k] or None,
            "sensitivity": intervals.sensitivity[k],
        }

    # combinations of values that the data do not determine, without the values that do not take part
    unknown = [dict(zip(values, row, strict=True)) for row in intervals.unknown.tolist()]
    return {
        "outcome": str(keys.outcome),
        "values": values,
        "unknown": [{name: part for name, part in row.items() if part} for row in unknown],
        "correlation": intervals.correlation,
        "evaluations": fit.counts.evaluations,
        "failures": fit.counts.failures,
        "descents_agreed": fit.n_best,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def describe_loop_fit(fit: FittedLoop) -> Parts:
    """Return what the answer of a fit to a friction loop contains: residuals, loops and their variables."""
    loop = fit.loop
    unit = LOOP_FORCE_UNITS[loop.quantity]
    peak = np.abs(loop.reading).max()
    n_rows = int((~fit.held_out).sum())
    scores = {
        "residual_rms": Quantity(fit.rms, unit),
        "residual_fraction": Quantity(fit.rms / peak),
    }

    text = format_quantity("residual_rms", scores["residual_rms"])
    share = f"{100 * fit.rms / peak:.2g} %"
    residual = f"The residual of {n_rows} rows is {text} rms, {share} of the peak."
    if loop.quantity == "force":
        # the steps between two fitted rows
        is_used = ~(fit.held_out[1:] | fit.held_out[:-1])
        pairs = np.array([loop.reading, fit.model])
        works = (pairs[:, 1:] + pairs[:, :-1]) / 2 @ (np.diff(loop.displacement) * is_used)
        scores["work_measured"], scores["work_fitted"] = (Quantity(work, "J") for work in works)
        share = format_number(100 * works[1] / works[0], 4)
        residual += f" The fitted loop dissipates {share} % of the measured work."

    # the chart shows the residual along the rows, where a pattern is an error of the model
    columns = {
        "slide": (loop.displacement, "m"),
        loop.quantity: (loop.reading, unit),
        "fitted": (fit.model, unit),
        "residual": (np.where(fit.held_out, np.nan, fit.model - loop.reading), unit),
        "row": (np.arange(loop.reading.size), "1"),
        "held": (fit.held_out.astype(np.int8), ""),
    }
    if loop.time is not None:
        columns["time"] = (loop.time, "s")
    held_out = None
    if fit.held_out_rms is not None:  # these rows are drawn and scored apart
        held_out = {"rows": fit.held_out.sum(), "rms": fit.held_out_rms}
        scores["held_out_rms"] = Quantity(fit.held_out_rms, unit)
        columns["held_out"] = (np.where(fit.held_out, loop.reading, np.nan), unit)

    details = {
        "measured": loop.path.name,
        "quantity": loop.quantity,
        "unit": unit,
        "rows": n_rows,
        "effective_rows": fit.keys.fit.intervals.rows,
        "rms": fit.rms,
        "held": held_out,
        "peak": peak,
        "step_error": fit.step_error,
        "steps_between_rows": fit.steps_per_row,
    }
    return Parts(residual, details, scores, make_columns("row", columns))


def describe_curve_fit(fit: FittedCurve) -> Parts:
    """Return what the answer of a fit to measured frequency and damping against amplitude contains."""
    measured = fit.measured
    n_rows = measured.amplitude.size
    errors = 2 * measured.error  # half the width of a 95 % interval

    # measured and fitted values, and the curve that extends beyond the measured amplitudes
    columns = {"amplitude": (measured.amplitude, "m")}
    curve = {"curve_amplitude": (fit.beyond[0], "m")}
    rms = {}
    for k, (name, unit) in enumerate((("frequency", "Hz"), ("damping", "1"))):
        value = measured.value[k]
        distance = fit.model[k] - value
        rms[name] = np.sqrt(np.mean((distance / value) ** 2))
        columns |= {
            name: (value, unit),
            f"{name}_error": (errors[k], unit),
            f"{name}_fitted": (fit.model[k], unit),
            f"{name}_residual": (distance / errors[k], "1"),
        }
        curve[f"curve_{name}"] = (fit.beyond[k + 1], unit)
        curve[f"curve_{name}_error"] = (fit.beyond[k + 3], unit)

    percent = {name: f"{100 * value:.2g} %" for name, value in rms.items()}
    residual = (
        f"At {n_rows} amplitudes the residual is {percent['frequency']} rms of the frequency and "
        f"{percent['damping']} of the damping ratio, by method {fit.method}."
    )
    if measured.assumed.any():
        residual += " The errors of the measured values are their scatter around the fit."

    details = {
        "measured": fit.path.name,
        "quantity": "decay",
        "method": fit.method,
        "rows": n_rows,
        "rms": rms,
        "notes": fit.notes,
        "evaluations": fit.n_computed,
    }
    scores = {f"{name}_residual_rms": Quantity(value) for name, value in rms.items()}
    data = make_columns("row", columns) | make_columns("curve_amplitude", curve)
    return Parts(residual, details, scores, data)


def describe_rows_fit(fit: FittedRows) -> Parts:
    """Return what the answer of a fit to a table of measured responses contains.

    Its scores are root mean squares of ln(computed/measured).
    """
    search = fit.keys.fit
    scores = fit.compute_scores()
    totals = {name: score["all"] for name, score in scores.items() if score is not None}
    texts = [f"{name.replace('_', ' ')} {value:.3f}" for name, value in totals.items() if value]
    residual = (
        f"The rms of ln(computed/measured) is {', '.join(texts)}; {search.n_best} of {search.descent_rms.size} starts "
        "led to within 1 % of the best."
    )

    rows, data = _collect_rows(fit)
    details = {
        "measured": fit.cells.path.name,
        "quantity": "rows",
        "scores": scores,
        # without the rows that were unstable in the test
        "scores_stable": fit.compute_scores(only_stable=True),
        "reading": _describe_instrument(fit),
        "readings": (~fit.held_out).sum(),
        "held": fit.held_out.sum(),
        "rms": fit.keys.fit.rms,
        "rows": rows,
        "motions": fit.n_motions,
        "notes": [fit.advice] if fit.advice else [],
    }
    scores = {f"score_{name}": Quantity(value) for name, value in totals.items()}
    return Parts(residual, details, scores, data)


def _describe_instrument(fit: FittedRows) -> JsonObject:
    """Return settings and gains of the sensors by name: fitted values, else those of the scene, else defaults."""
    instrument = {
        name: getattr(fit.instrument, name, default)
        for name, default in DEFAULT_SENSOR_SETTINGS.items()
    }
    for bound, value in zip(fit.keys.ranges, fit.keys.fit.values, strict=True):
        table, _, key = bound.key.partition(".")
        if table == "measured":
            instrument[key] = value
    return instrument


def _collect_rows(fit: FittedRows) -> tuple[list[JsonObject], Variables]:
    """Return measured and computed readings of each row, twice: as objects of fit.json, and as arrays with their ratios."""
    cells = fit.cells
    entries = [asdict(row) for row in cells.rows]
    is_held = np.zeros(len(entries), bool)
    is_held[cells.row[fit.held_out]] = True
    columns = {
        name: ([row[name] for row in entries], unit)
        for name, unit in (("frequency", "Hz"), ("input", "m s-2"), ("flag", ""))
    }
    columns["held"] = (is_held.astype(np.int8), "")

    data = {}
    for part, (name, unit) in enumerate(SENSOR_UNITS.items()):
        # a row without a reading has no computed one
        is_kind = cells.is_acceleration == (name == "acceleration")
        places = cells.row[is_kind]
        computed = np.full(len(entries), np.nan)
        computed[places] = fit.computed[part, cells.condition[is_kind]]
        held_out = np.full(len(entries), None)
        held_out[places] = fit.held_out[is_kind]
        measured = np.array([row[name] for row in entries], float)
        for row, number, is_held_out in zip(entries, computed, held_out, strict=True):
            row[name] = {"measured": row[name], "computed": number, "held": is_held_out}

        ratio = computed / np.where(measured > 0, measured, np.nan)
        columns |= {name: (measured, unit), f"computed_{name}": (computed, unit)}
        columns[f"{name}_ratio"] = (ratio, "1")
        # ends of the line on which both are equal
        positive = np.concatenate([measured[measured > 0], computed[computed > 0]])
        ends = [positive.min(), positive.max()] if positive.size else []
        data |= make_columns(f"equal_{name}", {f"equal_{name}": (ends, unit)})

    # codes by which the charts colour the rows
    uses = []
    for row, is_held_out in zip(entries, is_held, strict=True):
        unstable = ", unstable in the test" * ("U" in row["flag"])
        uses.append(f"{'held out' if is_held_out else 'fitted'}{unstable}")
    drives = [f"{row['frequency']:.6g} Hz" for row in entries]
    codes = {"use": encode_texts("row", uses), "drive": encode_texts("row", drives)}
    return entries, codes | data | make_columns("row", columns)


def describe_wear_fit(fit: FittedCoefficient) -> Parts:
    """Return what the answer of a wear coefficient that was fitted to a measured depth contains."""
    measured = fit.measured
    ends = {"value": measured.value, "low": measured.low, "high": measured.high}
    name = measured.name.replace("_", " ")
    text = format_quantity(measured.name, Quantity(unit="m", **ends))

    points = {"coefficient": ([fit.value], WEAR_COEFFICIENT_UNIT)}
    for end, value in ends.items():
        points[f"depth_{end}".removesuffix("_value")] = ([value], "m")
    # the computed curve is drawn a little beyond the interval of the coefficient
    coefficients, depths = fit.curve[:, fit.curve[0] <= CURVE_EXTENSION_RATIO * fit.high]
    curve = {
        "curve_coefficient": (coefficients, WEAR_COEFFICIENT_UNIT),
        "curve_depth": (depths, "m"),
    }

    # what the interval of the coefficient contains
    warnings = []
    parts = []
    if measured.low < measured.high:
        parts.append(f"that of the measured {name}, {text},")
    else:
        warnings.append(
            f"{measured.name} was given without an interval, so that of the coefficient does not contain the error of the "
            f'measurement; give both ends, such as "{measured.name}=2.5 um..3.5 um"'
        )
    error = fit.model.error
    if error is not None:
        parts.append(f"the numerical error of the computed depth, {format_length(error, 2)}")
    else:
        warnings.append(
            "the numerical error of the computed depth is unknown, so the interval of the coefficient does not contain it"
        )

    # The curve ends at the high bound of the coefficient, and so does the interval.
    max_depth = fit.curve[1][-1]
    if measured.high + (error or 0.0) > max_depth:
        warnings.append(
            f"the measured {name} with all errors reaches beyond {format_length(max_depth, 4)}, the depth with the high "
            "bound of the coefficient, at which the interval of the coefficient ends; raise the high bound, unless the "
            "coating is worn through"
        )
    residual = f"The interval contains {' and '.join(parts)}." if parts else ""

    details = {
        "measured": Path(measured.source).name,
        "quantity": measured.name,
        "runs": fit.runs,
        "model": fit.model.value,
        "model_error": error,
        "data": ends,
        "warnings": warnings,
    }
    return Parts(
        residual or f"The computed depth is {format_length(fit.model.value)}.",
        details,
        {"fitted_depth": Quantity(fit.model.value, "m", error)},
        make_columns("point", points) | make_columns("curve_coefficient", curve),
    )


_DESCRIBE_FUNCTIONS = {
    FittedLoop: describe_loop_fit,
    FittedCurve: describe_curve_fit,
    FittedRows: describe_rows_fit,
    FittedCoefficient: describe_wear_fit,
}


def format_fitted_scene(fit: AnyFit, scene: Scene, verdict: Sequence[str], folder: Path) -> str:
    """Return the text of the fitted scene, in SI units with all defaults, below comments that say what was fitted.

    Parameters
    ----------
    fit : FittedLoop, FittedCurve, FittedRows or FittedCoefficient
        Fitted values.
    scene : Scene
        Scene before the fit.
    verdict : sequence of str
        Sentences of the answer.
    folder : Path
        Folder to which the paths of the fitted scene are relative.
    """
    if isinstance(fit, FittedCoefficient):
        fitted = add_sets(scene, [fit.bounds.format_assignment(fit.value)])
    else:
        fitted = fit.keys.fitted_scene()
    model = build(fitted)
    text = write_resolved(fitted, model, find_source(model).writer.joint, folder)
    return "\n".join([*(f"# {sentence}" for sentence in verdict), "", text])
