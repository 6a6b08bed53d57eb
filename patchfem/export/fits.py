"""The answer of `fit`: fitted values of a scene with their intervals, measured and fitted data.

A fit to a loop, to frequency and damping against amplitude, to rows of a rig or to a worn depth differs in its `Parts`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import numpy as np

from .. import __version__
from ..campaigns.fits.curve import FittedCurve
from ..campaigns.fits.loop import FittedLoop
from ..campaigns.fits.problem import FittedKeys
from ..campaigns.fits.request import FitOptions, Listener, fit_measurement
from ..campaigns.fits.wear import COEFFICIENT_KEY, FittedCoefficient
from ..campaigns.rows.condition_models import GAIN_KEYS
from ..campaigns.rows.fit import SAME_SCORE, FittedRows
from ..disk.atomic_write import write_text
from ..formatting import format_number
from ..identify.least_squares import Fit
from ..model.model import build, write_resolved
from ..scene.ranges import Range
from ..scene.scene import Scene, loads, move_scene
from . import page, store
from .answer import Answer, Quantity, Remarks, Variable
from .folder import STARTS, Folder
from .quantities import format_quantity
from .runs import make_origin

FITTED_SCENE = "scene.fitted.toml"
MAX_NAMED_VALUES = 2  # largest number of fitted values in the headline
MIN_NAMED_CORRELATION = 0.95  # smallest correlation of two values that the verdict states
LOOP_UNITS = {"force": "N", "friction_ratio": "1"}


def fit_into(
    scene: Scene,
    to: str,
    free: Sequence[str],
    options: FitOptions,
    target: Path,
    listener: Listener,
    command: str = "",
    with_page: bool = True,
) -> Answer:
    """Fit keys of a scene to a measurement, and write the results folder.

    Parameters
    ----------
    scene, to, free, options, listener
        As for `campaigns.fits.request.fit_measurement`.
    target : Path
        Results folder, which is claimed before the work.
    command : str
        Command line that repeats it; by default that without options.
    with_page : bool

    Returns
    -------
    Answer

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used, before anything is computed.
    """
    with Folder(target, options.resume) as folder:
        if folder.dropped and listener.say is not None:
            listener.say(folder.dropped)
        fit = fit_measurement(scene, to, free, options, listener, folder.path / STARTS)
        answer = make_answer(fit, scene, command)
        store.write(answer, folder.path)
        write_text(folder.path / FITTED_SCENE, format_fitted_scene(fit, scene, folder.target))
        if with_page:
            page.write_page(folder.path)
    return answer


@dataclass(frozen=True, eq=False)
class Parts:
    """What differs between the kinds of fits.

    measured: name of the file; quantity: of the measurement; values: fitted values as in fit.json; residual: sentence on the
    distance of fit and measurement; details: further keys of fit.json; scores: quantities of the residual; data; notes.
    """

    measured: str
    quantity: str
    values: dict[str, dict]
    residual: str
    details: dict
    scores: dict[str, Quantity]
    data: dict[str, Variable]
    outcome: str = "done"
    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()
    offsets: dict[str, dict] = field(default_factory=dict)


def make_answer(
    fit: FittedLoop | FittedCurve | FittedRows | FittedCoefficient, scene: Scene, command: str = ""
) -> Answer:
    """Return the answer of a fit.

    Parameters
    ----------
    fit : FittedLoop, FittedCurve, FittedRows or FittedCoefficient
    scene : Scene
        Scene before the fit.
    command : str
        Command line that repeats it; by default that without options.
    """
    parts = _DESCRIBE[type(fit)](fit)
    fitted = parts.values | {f"offset_{name}": one for name, one in parts.offsets.items()}
    measures = {name: _make_quantity(entry) for name, entry in fitted.items()} | parts.scores
    pairs = _collect_pairs(parts.details.get("correlation", []), list(fitted))
    origin = make_origin(build(scene).source, "fit")
    header = {
        "patchfem": __version__,
        "title": scene.title,
        "measured": parts.measured,
        "quantity": parts.quantity,
        "outcome": parts.outcome,
        "values": parts.values,
    }
    return Answer(
        kind="fit",
        title=scene.title,
        verdict=(_make_headline(parts, measures), parts.residual, *_describe_pairs(pairs)),
        quantities=measures,
        data=parts.data | pairs,
        remarks=Remarks(tuple(parts.warnings), tuple(parts.notes)),
        details=header | parts.details,
        origin=origin | {"command": command or origin["command"]},
    )


def _make_quantity(entry: dict) -> Quantity:
    """Return a fitted value of fit.json as a quantity."""
    has_interval = entry["low"] is not None
    reason = "" if has_interval else "the measurement does not determine an interval"
    return Quantity(entry["value"], entry["unit"], None, entry["low"], entry["high"], reason=reason)


def _make_headline(parts: Parts, measures: dict[str, Quantity]) -> str:
    """Return a sentence with the first fitted values and their intervals."""
    named = list(parts.values)[:MAX_NAMED_VALUES]
    texts = [f"{key} = {format_quantity(key, measures[key])}" for key in named]
    more = len(parts.values) - len(named)
    others = f" and {more} more" if more else ""
    if parts.outcome != "done":
        return f"The fit to {parts.measured} did not converge; best values so far: {', '.join(texts)}{others}."
    return f"Fitted to {parts.measured}: {', '.join(texts)}{others}."


def _collect_pairs(correlation: list[list], names: list[str]) -> dict[str, Variable]:
    """Return the correlation of each pair of fitted values, the strongest first."""
    pairs = [
        (f"{names[i]}, {names[k]}", np.nan if correlation[i][k] is None else correlation[i][k])
        for i, k in combinations(range(len(correlation)), 2)
    ]
    if not pairs:
        return {}
    pairs.sort(key=lambda pair: -abs(np.nan_to_num(pair[1])))
    return {
        "pair": Variable(("pair",), np.array([name for name, _ in pairs]), ""),
        "correlation": Variable(
            ("pair",), np.array([value for _, value in pairs]), text="correlation of the errors"
        ),
    }


def _describe_pairs(pairs: dict[str, Variable]) -> list[str]:
    """Return a sentence on the most correlated pair of values, if only a combination of them is well determined."""
    if not pairs or not abs(pairs["correlation"].values[0]) >= MIN_NAMED_CORRELATION:
        return []
    first, second = pairs["pair"].values[0].split(", ")
    value = pairs["correlation"].values[0]
    return [
        f"{first} and {second} are correlated by {value:.2f}: the measurement determines a combination of them better than "
        "each one."
    ]


def describe_value(bound: Range, fit: Fit, k: int) -> dict:
    """Return fitted value k with its confidence interval and range, as written in fit.json."""
    ends = fit.intervals.ends[k].tolist()
    low, high = ends if np.isfinite(ends).all() else (None, None)
    return {
        "value": float(fit.values[k]),
        "unit": bound.unit,
        "low": low,
        "high": high,
        "interval": None if low is None else ends,
        "method": fit.intervals.methods[k],
        "bounds": [bound.low, bound.high],
        "at_bound": fit.at_bound[k] or None,
        "sensitivity": float(fit.intervals.sensitivity[k]),
    }


def _describe_values(keys: FittedKeys) -> dict[str, dict]:
    """Return all fitted values by scene key, as written in fit.json."""
    return {bound.key: describe_value(bound, keys.fit, k) for k, bound in enumerate(keys.ranges)}


def _describe_search(keys: FittedKeys, bounds: list[Range]) -> dict:
    """Return what the data do not determine, correlation and counts of a search, as written in fit.json."""
    fit = keys.fit
    correlation = fit.intervals.correlation
    return {
        "unknown": [
            {bound.key: part for bound, part in zip(bounds, row, strict=True) if part}
            for row in fit.intervals.unknown.tolist()
        ],
        "correlation": np.where(np.isfinite(correlation), correlation, None).tolist(),
        "evaluations": fit.counts.evaluations,
        "failures": fit.counts.failures,
        "descents_agreed": fit.agreed,
        "warnings": keys.warnings,
        "seconds": round(keys.seconds, 6),
    }


def describe_loop_fit(fit: FittedLoop) -> Parts:
    """Return the parts of a fit to a friction loop."""
    keys = fit.keys
    loop = fit.loop
    unit = LOOP_UNITS[loop.quantity]
    peak = float(np.abs(loop.reading).max())
    n_keys = len(keys.ranges)
    n_rows = int((~fit.held_out).sum())
    scores = {
        "residual_rms": Quantity(fit.rms, unit),
        "residual_fraction": Quantity(fit.rms / peak),
    }
    held = None
    if fit.held_out_rms is not None:
        held = {"rows": int(fit.held_out.sum()), "rms": fit.held_out_rms}
        scores["held_out_rms"] = Quantity(fit.held_out_rms, unit)
    work = ""
    if loop.quantity == "force":
        measured, fitted = np.trapezoid([loop.reading, fit.model], loop.displacement)
        scores["work_measured"] = Quantity(measured, "J")
        scores["work_fitted"] = Quantity(fitted, "J")
        work = f" The fitted loop dissipates {format_number(100 * fitted / measured, 4)} % of the measured work."

    def column(values: np.ndarray, unit: str, text: str) -> Variable:
        """Return a variable over the rows of the record."""
        return Variable(("row",), np.asarray(values), unit, text)

    data = {} if loop.time is None else {"time": column(loop.time, "s", "time")}
    data |= {
        "slide": column(loop.displacement, "m", "measured slide"),
        loop.quantity: column(loop.reading, unit, f"measured {loop.quantity.replace('_', ' ')}"),
        "fitted": column(fit.model, unit, "fitted value"),
        "residual": column(fit.model - loop.reading, unit, "fitted minus measured value"),
        "row": column(np.arange(loop.reading.size), "1", "row of the record"),
        "held": column(fit.held_out.astype(np.int8), "", "1 if the row is held out"),
    }
    if fit.held_out.any():
        shown = np.where(fit.held_out, loop.reading, np.nan)
        data["held_out"] = column(shown, unit, "measured value of a row that is held out")
    rows = fit.keys.fit.intervals.rows
    details = {
        "unit": unit,
        "rows": n_rows,
        "effective_rows": None if np.isnan(rows) else rows,
        "rms": fit.rms,
        "held": held,
        "peak": peak,
        "step_error": fit.step_error,
        "steps_between_rows": fit.steps_per_row,
    }
    offsets = {
        offset.name: describe_value(offset.range, keys.fit, n_keys + k)
        for k, offset in enumerate(fit.offsets)
    }
    bounds = [*keys.ranges, *(offset.range for offset in fit.offsets)]
    residual = format_quantity("residual_rms", Quantity(float(f"{fit.rms:.3g}"), unit))
    return Parts(
        measured=loop.path.name,
        quantity=loop.quantity,
        values=_describe_values(keys),
        residual=f"The residual of {n_rows} rows is {residual} rms, {100 * fit.rms / peak:.2g} % of the peak.{work}",
        details={"offsets": offsets} | details | _describe_search(keys, bounds),
        scores=scores,
        data=data,
        outcome=str(keys.outcome),
        warnings=keys.warnings,
        offsets=offsets,
    )


def describe_curve_fit(fit: FittedCurve) -> Parts:
    """Return the parts of a fit to measured frequency and damping against amplitude."""
    keys = fit.keys
    measured = fit.measured
    error = 2 * measured.error  # half the width of a 95 % interval
    deviation = (fit.model - measured.value) / np.abs(measured.value)
    rms = dict(zip(("frequency", "damping"), np.sqrt(np.mean(deviation**2, axis=1)).tolist()))
    data = {"amplitude": Variable(("row",), measured.amplitude, "m", "amplitude at the output")}
    for k, (name, unit) in enumerate((("frequency", "Hz"), ("damping", "1"))):
        scaled = (fit.model[k] - measured.value[k]) / error[k]
        columns = {
            name: (measured.value[k], unit, f"measured {name}"),
            f"{name}_error": (error[k], unit, f"half the 95 % interval of the {name}"),
            f"{name}_fitted": (fit.model[k], unit, f"fitted {name}"),
            f"{name}_residual": (scaled, "1", f"deviation of the {name} over its error"),
        }
        data |= {title: Variable(("row",), *column) for title, column in columns.items()}
    if fit.beyond.size:
        texts = {"amplitude": "m", "frequency": "Hz", "damping": "1"}
        for (name, unit), values in zip(texts.items(), fit.beyond, strict=True):
            data[f"curve_{name}"] = Variable(("curve_amplitude",), values, unit, f"fitted {name}")
    details = {"method": fit.method, "rows": int(measured.amplitude.size), "rms": rms}
    search = _describe_search(keys, keys.ranges) | {"evaluations": fit.n_computed}
    return Parts(
        measured=fit.path.name,
        quantity="decay",
        values=_describe_values(keys),
        residual=f"At {measured.amplitude.size} amplitudes the residual is {100 * rms['frequency']:.2g} % rms of the frequency "
        f"and {100 * rms['damping']:.2g} % of the damping ratio, by method {fit.method}.",
        details=details | search | {"notes": list(fit.notes)},
        scores={f"{name}_residual_rms": Quantity(value) for name, value in rms.items()},
        data=data,
        outcome=str(keys.outcome),
        warnings=keys.warnings,
        notes=fit.notes,
    )


def describe_rows_fit(fit: FittedRows) -> Parts:
    """Return the parts of a fit to a table of measured responses.

    Scores are root mean squares of ln(computed/measured).
    """
    keys = fit.keys
    scores = fit.compute_scores()
    totals = {name: score["all"] for name, score in scores.items() if score is not None}
    texts = [
        f"{name.replace('_', ' ')} {value:.3f}"
        for name, value in totals.items()
        if value is not None
    ]
    search = _describe_search(keys, keys.ranges)
    n_best = int((fit.search.rms <= np.nanmin(fit.search.rms) * SAME_SCORE).sum())
    n_starts = fit.search.rms.size
    details = {
        "scores": scores,
        "scores_stable": fit.compute_scores(only_stable=True),
        "unstable": fit.settings.unstable,
        "reading": _list_instrument_settings(fit),
        "readings": int((~fit.held_out).sum()),
        "held": int(fit.held_out.sum()),
        "rms": keys.fit.rms,
        "seed": fit.settings.seed,
        "starts": _list_starts(fit),
        "rows": _list_rows(fit),
        "motions": fit.n_motions,
    }
    return Parts(
        measured=fit.cells.path.name,
        quantity="rows",
        values=_describe_values(keys),
        residual=f"Scores, the rms of ln(computed/measured): {', '.join(texts)}; {n_best} of {n_starts} starts led to within "
        "1 % of the best.",
        details=details | search,
        scores={f"score_{name}": Quantity(value) for name, value in totals.items()},
        data=_collect_rows(details["rows"]),
        outcome=str(keys.outcome),
        warnings=keys.warnings,
    )


def _list_instrument_settings(fit: FittedRows) -> dict[str, float | str | None]:
    """Return the settings and gains of the sensors that measure the motion of a rig."""
    instrument = fit.models.instrument
    keys = fit.keys
    values = {bound.key: float(value) for bound, value in zip(keys.ranges, keys.fit.values)}
    gains = {}
    for key in GAIN_KEYS:
        name = key.partition(".")[2]
        gains[name] = values.get(key, 1.0 if instrument is None else getattr(instrument, name))
    return {
        "reading": "peak" if instrument is None else instrument.reading,
        "reading_cutoff": None if instrument is None else instrument.reading_cutoff,
    } | gains


def _list_starts(fit: FittedRows) -> list[dict]:
    """Return for each search its initial values, its final values and its score on the training data."""
    names = [bound.key for bound in fit.keys.ranges]
    search = fit.search
    starts = []
    for first, last, rms in zip(search.starts.tolist(), search.ends.tolist(), search.rms.tolist()):
        is_finished = np.isfinite(rms)
        starts.append(
            {
                "from": dict(zip(names, first)),
                "to": dict(zip(names, last)) if is_finished else None,
                "training": rms if is_finished else None,
            }
        )
    return starts


def _list_rows(fit: FittedRows) -> list[dict]:
    """Return measured and computed readings of each row in SI units."""
    cells = fit.cells
    number = {
        key: n for n, key in enumerate(zip(cells.row.tolist(), map(bool, cells.is_acceleration)))
    }
    entries = []
    for k, row in enumerate(cells.rows):
        entry = {"frequency": row.frequency, "input": row.input, "flag": row.flag}
        for part, name in enumerate(("acceleration", "displacement")):
            n = number.get((k, name == "acceleration"))
            value = None if n is None else float(fit.computed[part, cells.condition[n]])
            entry[name] = {
                "measured": getattr(row, name),
                "computed": value if value is None or np.isfinite(value) else None,
                "held": None if n is None else bool(fit.held_out[n]),
            }
        entries.append(entry)
    return entries


def _collect_rows(rows: list[dict]) -> dict[str, Variable]:
    """Return the rows of a fit as arrays, with the ratios of computed to measured readings."""
    kinds = {"acceleration": "m s-2", "displacement": "m"}
    held = np.array([any(row[name]["held"] for name in kinds) for row in rows])
    uses = [
        ("held out" if is_held else "fitted") + ", unstable in the test" * ("U" in row["flag"])
        for is_held, row in zip(held, rows, strict=True)
    ]
    drives = [f"{row['frequency']:.6g} Hz" for row in rows]

    def column(values, unit: str, text: str = "", meanings=()) -> Variable:
        """Return a variable over the rows."""
        return Variable(("row",), np.array(values), unit, text, tuple(meanings))

    def codes(texts: list[str]) -> Variable:
        """Return texts as codes with meanings."""
        meanings = sorted(set(texts))
        return column(np.array([meanings.index(text) for text in texts], np.int8), "", "", meanings)

    data = {
        "frequency": column([row["frequency"] for row in rows], "Hz", "frequency of the drive"),
        "input": column([row["input"] for row in rows], "m s-2", "acceleration of the base"),
        "flag": column([row["flag"] for row in rows], "", "flag of the row"),
        "held": column(held.astype(np.int8), "", "1 if a reading of the row is held out"),
        "use": codes(uses),
        "drive": codes(drives),
    }
    for name, unit in kinds.items():
        measured, computed = (
            np.array([row[name][part] for row in rows], float) for part in ("measured", "computed")
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(measured > 0, computed / measured, np.nan)
        known = np.concatenate([measured[measured > 0], computed[computed > 0]])
        data[name] = column(measured, unit, f"measured {name}")
        data[f"computed_{name}"] = column(computed, unit, f"computed {name}")
        data[f"{name}_ratio"] = column(ratio, "1", f"computed over measured {name}")
        if known.size:
            ends = np.array([known.min(), known.max()])
            data[f"equal_{name}"] = Variable((f"equal_{name}",), ends, unit)
    return data


def describe_wear_fit(fit: FittedCoefficient) -> Parts:
    """Return the parts of a fitted wear coefficient."""
    measured = fit.measured
    unit = "m2 N-1"
    value = {
        "value": fit.value,
        "unit": unit,
        "low": fit.low,
        "high": fit.high,
        "interval": [fit.low, fit.high],
        "bounds": [fit.bounds.low, fit.bounds.high],
    }
    depth = Quantity(measured.value, "m", None, measured.low, measured.high)
    name = measured.name.replace("_", " ")
    is_file = measured.source != "--to"
    data = {
        "coefficient": Variable(("point",), np.array([fit.value]), unit, "fitted coefficient"),
        "depth": Variable(("point",), np.array([measured.value]), "m", f"measured {name}"),
        "depth_low": Variable(("point",), np.array([measured.low]), "m"),
        "depth_high": Variable(("point",), np.array([measured.high]), "m"),
        "curve_coefficient": Variable(("curve_coefficient",), fit.curve[0], unit, "coefficient"),
        "curve_depth": Variable(("curve_coefficient",), fit.curve[1], "m", f"computed {name}"),
    }
    return Parts(
        measured=Path(measured.source).name if is_file else measured.source,
        quantity=measured.name,
        values={COEFFICIENT_KEY: value},
        residual=f"The interval is that of the measured {name}, {format_quantity(measured.name, depth)}.",
        details={
            "runs": fit.runs,
            "model": fit.model,
            "data": {"value": measured.value, "low": measured.low, "high": measured.high},
            "warnings": [],
        },
        scores={"fitted_depth": Quantity(fit.model, "m")},
        data=data,
    )


_DESCRIBE = {
    FittedLoop: describe_loop_fit,
    FittedCurve: describe_curve_fit,
    FittedRows: describe_rows_fit,
    FittedCoefficient: describe_wear_fit,
}


def format_fitted_scene(fit, scene: Scene, folder: Path) -> str:
    """Return the text of the fitted scene, in SI units with all defaults, with comments that say what was fitted.

    Parameters
    ----------
    fit : FittedLoop, FittedCurve, FittedRows or FittedCoefficient
    scene : Scene
        Scene before the fit.
    folder : Path
        Folder to which the paths of the fitted scene are relative.
    """
    parts = _DESCRIBE[type(fit)](fit)
    comments = []
    for key, entry in parts.values.items():
        interval = ", not determined"
        if entry["interval"]:
            interval = f", 95 % in [{entry['low']!r}, {entry['high']!r}]"
        comments.append(
            f"# {key} fitted to {parts.measured}: {entry['value']!r} {entry['unit']}{interval}"
        )
    if isinstance(fit, FittedCoefficient):
        assignment = fit.bounds.format_assignment(fit.value)
        fitted = loads(scene.text, scene.path, [*scene.sets, assignment])
    else:
        fitted = fit.keys.fitted_scene()
    # the model is built before the scene moves, because its file names are relative to its folder
    model = build(fitted)
    text = write_resolved(move_scene(fitted, folder / FITTED_SCENE), model)
    return "\n".join(comments) + "\n\n" + text
