"""Answer of the comparison of two measured surfaces: sentences, quantities, curves or maps, and compare.json."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns import compare as pressing
from ...campaigns import surface_pairs
from ...campaigns.compare import SurfaceRuns
from ...campaigns.surface_pairs import TableLine
from ...core import PatchfemError
from ...runs.results.result import patch_surface
from ...surface.areal import level
from ...surface.compare import compare
from ...surface.compare.compare import COMPARE_DEFAULTS, Options
from ...surface.compare.records import Comparison, Track
from ...surface.profile import resample_evenly
from ...surface.quantity import HALF_WIDTH_95
from ...surface.roughness.parameters import abbott_curve
from ...surface.spectrum import WAVE_BAND
from ..answer import Answer, JsonObject, Remarks, Variables
from ..rows import make_variables
from ..runs import make_quantities
from . import shared, worn
from .shared import SURFACE_NAMES, build_answer, convert_quantities, make_band, make_maps


def answer_files(
    before: Path,
    after: Path,
    options: Options = COMPARE_DEFAULTS,
    predicted: Path | None = None,
    piece: str = "",
) -> Answer:
    """Compare two files before and after wear.

    Parameters
    ----------
    before, after : Path
        Two traces or two scans.
    options : Options
        What is known of the two surfaces.
    predicted : Path, optional
        Results folder of a run with [wear], whose depth is fitted to the measured depth.
    piece : str
        "upper" or "lower", of which the traces are; "" if both pieces wear alike.

    Returns
    -------
    Answer

    Raises
    ------
    PatchfemError
        If the files cannot be read or compared, or do not fit to the run.
    """
    if piece and predicted is None:
        raise PatchfemError(
            "compare: piece needs predicted, the results folder of a run with [wear]"
        )
    comparison = compare.compare_files(before, after, options)
    answer = make_comparison_answer(comparison)
    if predicted is None:
        return answer
    return worn.add_predicted(answer, comparison, predicted, piece)


def compare_with_scene(
    before: Path,
    after: Path,
    options: Options,
    run_surfaces: Callable[[Path, Path], SurfaceRuns],
    folder: Path,
) -> Answer:
    """Compare two traces, and run a scene with each of them.

    Parameters
    ----------
    before, after : Path
        Two traces.
    options : Options
        What is known of the two surfaces.
    run_surfaces : callable
        Receives the paths of both traces, limited to their common part, and runs the scene with each.
    folder : Path
        Folder NAME.partial, later NAME, that receives surface_before.csv and surface_after.csv.

    Returns
    -------
    Answer

    Raises
    ------
    PatchfemError
        If the files are scans or cannot be compared.
    """
    comparison = compare.compare_files(before, after, options)
    paths = pressing.write_common_traces(comparison, folder)
    return _add_pressed(make_comparison_answer(comparison), run_surfaces(*paths), folder)


def make_comparison_answer(comparison: Comparison) -> Answer:
    """Return the answer of a comparison of two surfaces: its sentences, quantities, curves and content of compare.json."""
    words = shared.describe_comparison(comparison)
    surfaces = (comparison.before, comparison.after)
    file_notes = [note for surface in surfaces for note in surface.notes]
    track = comparison.track

    answer = build_answer(
        sources=[surface.source for surface in surfaces],
        words=words._replace(notes=(*words.notes, *file_notes)),
        values=comparison.values,
        track={} if track is None else track.values,
        data=_make_data(comparison),
        details={
            "code": comparison.verdict.code,
            "band": WAVE_BAND,
            "direction": comparison.direction or None,
            **_describe_place(comparison),
            "other_tracks": [convert_quantities(other.values) for other in comparison.tracks[1:]],
            "removed": dict(zip(SURFACE_NAMES, comparison.evidence.removed, strict=True)),
            **_compare_roughness(comparison),
            "notes": file_notes,
        },
    )
    # A mean depth is meaningless without the region of the mean.
    if shared.is_known(comparison.values.get("worn_depth_mean")):
        region = shared.describe_region(comparison).removeprefix("the ")
        answer.details["worn_depth_mean"]["over"] = region
    return answer


def _describe_place(comparison: Comparison) -> JsonObject:
    """Return how the second surface lies on the first one: `reference` and `registration` of compare.json."""
    placement = comparison.evidence.placement
    names = ("shift_x", "shift_y", "rotation") if comparison.is_areal else ("shift",)
    names += ("significance",)
    values = comparison.values if placement is None else comparison.values | placement.values
    registration = convert_quantities({name: values[name] for name in names if name in values})
    registration["mirrored"] = bool(placement and placement.mirrored)
    basis = placement.basis if placement is not None else ""
    return {"reference": basis or None, "registration": registration}


def _compare_roughness(comparison: Comparison) -> JsonObject:
    """Return the roughness inside and outside of the track: `roughness` of compare.json, and the rows of a table."""
    evidence = comparison.evidence
    content = {"cutoff": evidence.cutoff, "inside": None, "outside": None}
    rows = {}
    for region, sides in evidence.roughness.items():
        content[region] = {side: convert_quantities(values) for side, values in sides.items()}
        for name in content[region]["before"]:
            row = {side: entries[name] for side, entries in content[region].items()}
            rows[f"{name} {region}"] = row | {"cutoff": {"value": evidence.cutoff, "unit": "m"}}
    if not rows:
        content["reason"] = shared.MISSING_VALUE_REASONS[_explain_no_roughness(comparison)]
    return {"roughness": content, "track_roughness": rows}


def _explain_no_roughness(comparison: Comparison) -> str:
    """Return the code of the reason why there is no roughness inside and outside of a track."""
    if comparison.is_areal:
        return "scans"
    if comparison.track is None:
        return "no_track"
    return "elsewhere" if comparison.evidence.placement.basis == "flanks" else "short_track"


def _make_data(comparison: Comparison) -> Variables:
    """Return the aligned curves or maps of a comparison, or both traces alone without a common place."""
    curves = comparison.evidence.curves
    if curves is None:
        return _make_separate(comparison)
    heights = curves.heights
    if comparison.is_areal:
        data = make_maps(
            curves.x, curves.y, before_map=heights[0], after_map=heights[1], depth_map=curves.depth
        )
    else:
        data = make_variables("surface", x=curves.x, before=heights[0], after=heights[1])
        data |= make_band("depth", curves.depth, HALF_WIDTH_95 * curves.noise)
        state = np.select((curves.masks.unworn, curves.masks.worn, curves.masks.grown), (1, 2, 3))
        data |= make_variables("surface", state=state)
    return data | _make_tracks(comparison.tracks) | _make_abbott(heights)


def _make_tracks(tracks: tuple[Track, ...]) -> Variables:
    """Return the known ends of the tracks of traces."""
    if not tracks:
        return {}
    ends = [track.values[name].value for track in tracks for name in ("from", "to")]
    return make_variables("surface", track_end=ends)


def _make_separate(comparison: Comparison) -> Variables:
    """Return both traces, each about its own least-squares line; {} for scans."""
    if comparison.is_areal:
        return {}
    data = {}
    traces = [level(resample_evenly(each)) for each in (comparison.before, comparison.after)]
    for side, trace in zip(SURFACE_NAMES, traces, strict=True):
        data |= make_variables("surface", **{f"x_{side}": trace.x, f"trace_{side}": trace.z})
    return data | _make_abbott([trace.z for trace in traces])


def _make_abbott(heights) -> Variables:
    """Return the Abbott curves of the heights before and after wear; {} if one of them is unknown."""
    known = [values[np.isfinite(values)] for values in heights]
    if not all(values.size for values in known):
        return {}
    # Points of each Abbott curve, which is smooth
    before, after = (abbott_curve(values, 201) for values in known)
    return make_variables(
        "surface", material_ratio=before[0], abbott_before=before[1], abbott_after=after[1]
    )


def _add_pressed(answer: Answer, runs: SurfaceRuns, folder: Path) -> Answer:
    """Add the measures and pressures of a scene that was run with the surface before and after wear.

    `folder` has the traces. The messages of the runs then name it as it is called when the answer is complete.
    """
    data = dict(answer.data)
    warnings = []
    notes = []
    for side, result in runs.results.items():
        x = patch_surface(result.patch, result.fields).x
        stress = result.fields["normal_stress"][0]
        columns = {f"x_pressed_{side}": x, f"pressure_{side}": stress}
        data |= make_variables("surface", **columns)
        for listed, texts in ((warnings, result.warnings), (notes, result.notes)):
            listed += [f"{side}: {text}".replace(folder.name, folder.stem) for text in texts]

    outcomes = {side: str(result.outcome) for side, result in runs.results.items()}
    sides = {side: make_quantities(result.measures) for side, result in runs.results.items()}
    pressed = {
        "scene": runs.title,
        "measures": shared.compare_measures(sides),
        "failed": runs.failed,
        "outcome": dict.fromkeys(SURFACE_NAMES) | outcomes,
        "warnings": warnings,
        "notes": notes,
    }
    warnings = (*answer.remarks.warnings, *runs.failed, *warnings)
    return replace(
        answer,
        data=data,
        remarks=Remarks(warnings, (*answer.remarks.notes, *notes)),
        details=answer.details | {"pressed": pressed},
    )


def answer_pairs(
    table: Path, options: Options = COMPARE_DEFAULTS, report_progress: Callable | None = None
) -> Answer:
    """Compare the two files or results folders of each line of a table.

    Parameters
    ----------
    table : Path
        As `campaigns.surface_pairs.read_pairs` reads it.
    options : Options
        Of all pairs of files; `direction` is that of the lines that state none.
    report_progress : callable, optional
        Receives the fraction of the pairs that are done.

    Returns
    -------
    Answer
        Kind "pairs". A pair that fails has the `outcome` "failed" and a `message`; the others continue.

    Raises
    ------
    Missing
        If the table is not there.
    PatchfemError
        If it is no such table.
    """
    lines = surface_pairs.read_pairs(table)
    rows = []
    for line in lines:
        rows.append(_compare_line(line, options))
        if report_progress is not None:
            report_progress(len(rows) / len(lines))
    return make_pairs_answer(rows, Path(table).name)


def _compare_line(line: TableLine, options: Options) -> JsonObject:
    """Return the content of compare.json for the pair of a line, with the cells of the line."""
    cells = {"line": line.line, "before": line.names[0], "after": line.names[1]}
    cells["labels"] = dict(line.labels)
    direction = line.direction or options.direction
    try:
        if any(path.is_dir() for path in line.paths):
            for option, value in (("a direction", line.direction), ("a shift", options.shift)):
                if value not in ("", None):
                    raise PatchfemError(
                        f"{option} can be given only for traces, not for results folders"
                    )
            answer = worn.answer_runs(*line.paths)
        else:
            answer = answer_files(*line.paths, options._replace(direction=direction))
    except Exception as error:  # a defect of one pair must not lose the answers of the others
        reason = str(error)
        if not isinstance(error, PatchfemError):
            reason = f"internal fault, please report it: {type(error).__name__}: {error}"
        return cells | {"direction": direction or None, "outcome": "failed", "message": reason}
    return answer.details | cells | {"outcome": "done", "message": ""}


def make_pairs_answer(rows: list[JsonObject], name: str) -> Answer:
    """Return the answer of the compared pairs of a table with this name."""
    return Answer(
        kind="pairs",
        title=name,
        verdict=(_count_pairs(rows),),
        data=_make_pairs_data(rows),
        details={"patchfem": __version__, "pairs": rows},
        origin={"patchfem": __version__},
    )


def _count_pairs(rows: list[JsonObject]) -> str:
    """Return the headline: numbers of pairs, of pairs with wear and of failed pairs."""
    failed = sum(row["outcome"] == "failed" for row in rows)
    depths = [row.get("worn_depth_mean", {}) for row in rows]
    n_worn = sum((depth.get("low") or 0.0) > 0 for depth in depths)
    return f"{len(rows)} pairs: {n_worn} worn, {len(rows) - n_worn - failed} not, {failed} failed."


def _make_pairs_data(rows: list[JsonObject]) -> Variables:
    """Return the quantities of the charts with their intervals over the line of each pair."""
    columns = {"line": [float(row["line"]) for row in rows]}
    # Quantities of the charts of pairs
    for name in ("worn_depth_mean", "amplitude_ratio"):
        for key, suffix in (("value", ""), ("low", "_low"), ("high", "_high")):
            columns[name + suffix] = [row.get(name, {}).get(key) for row in rows]
    return make_variables("surface", **columns)
