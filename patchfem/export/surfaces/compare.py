"""Answer of the comparison of two measured surfaces: sentences, quantities, curves or maps, and compare.json."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns import compare as pressing
from ...campaigns.compare import SurfaceRuns
from ...core import PatchfemError
from ...surface.areal import level
from ...surface.compare import compare
from ...surface.compare.compare import COMPARE_DEFAULTS, Options
from ...surface.compare.records import Comparison, Track
from ...surface.profile import resample_evenly
from ...surface.quantity import CONFIDENCE_LEVEL, HALF_WIDTH_95, Quantity
from ...surface.spectrum import WAVE_BAND
from ..answer import Answer, JsonObject, Remarks, Variables
from ..rows import make_variables
from ..surface_definitions import name_in_track
from . import predicted as predicted_wear
from . import sentences
from .sentences import to_answers
from .variables import make_band, make_maps

SURFACE_NAMES = ("before", "after")  # keys of the two compared surfaces or runs
# Numbers of compare.json that the page and the screen show under another name: those of the longest track in both traces.
SHOWN_ELSEWHERE = (
    "worn_depth_within",
    "worn_from_before",
    "worn_from_after",
    "worn_to_before",
    "worn_to_after",
)
MATERIAL_RATIOS = np.linspace(0.0, 1.0, 201)


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
    answer = make_answer(comparison)
    if predicted is None:
        return answer
    return predicted_wear.add_predicted(answer, comparison, predicted, piece)


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
        Receives surface_before.csv and surface_after.csv.

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
    return _add_pressed(make_answer(comparison), run_surfaces(*paths))


def make_answer(comparison: Comparison) -> Answer:
    """Return the answer of a comparison of two surfaces: its sentences, quantities, curves and content of compare.json."""
    words = sentences.describe_comparison(comparison)
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
            "other_tracks": [to_answers(other.values) for other in comparison.tracks[1:]],
            "removed": dict(zip(SURFACE_NAMES, comparison.evidence.removed, strict=True)),
            **_compare_roughness(comparison),
            "notes": file_notes,
        },
    )
    # A mean depth is meaningless without the region of the mean.
    if sentences.is_known(comparison.values.get("worn_depth_mean")):
        region = sentences.describe_region(comparison).removeprefix("the ")
        answer.details["worn_depth_mean"]["over"] = region
    return answer


def build_answer(
    *,
    sources: list[str],
    words: sentences.Words,
    values: dict[str, Quantity],
    track: dict[str, Quantity],
    data: Variables,
    details: JsonObject,
) -> Answer:
    """Return the answer of a comparison of two surfaces or runs.

    Parameters
    ----------
    sources : list of str
        Files or folders before and after wear.
    words : Words
        Verdict, warnings and notes.
    values, track : dict of str to Quantity
        Quantities of the whole surface, and of the longest track ({} without one).
    data : dict of str to Variable
        Variables of the charts by name.
    details : dict
        Further content of compare.json.
    """
    # Values are shown once on the page; compare.json has them all.
    values = values | {name_in_track(name): value for name, value in track.items()}
    shown = {name: one for name, one in values.items() if name not in SHOWN_ELSEWHERE}

    # Head of compare.json: the verdict and all quantities. `details` follow.
    content = {
        "patchfem": __version__,
        "verdict": words.verdict[0],
        "sentences": [*words.verdict[1:], *words.warnings, *words.notes],
        "confidence": CONFIDENCE_LEVEL,
        **dict(zip(SURFACE_NAMES, sources, strict=True)),
        **to_answers(values),
        "track": to_answers(track) or None,
    }

    return Answer(
        kind="compare",
        title=" and ".join(Path(source).name for source in sources),
        verdict=words.verdict,
        quantities=to_answers(shown),
        data=data,
        remarks=Remarks(words.warnings, words.notes),
        details=content | details,
        origin={"patchfem": __version__},
    )


def _describe_place(comparison: Comparison) -> JsonObject:
    """Return how the second surface lies on the first one: `reference` and `registration` of compare.json."""
    placement = comparison.evidence.placement
    names = ("shift_x", "shift_y", "rotation") if comparison.is_areal else ("shift",)
    names += ("significance",)
    values = comparison.values if placement is None else comparison.values | placement.values
    registration = to_answers({name: values[name] for name in names if name in values})
    registration["mirrored"] = bool(placement and placement.mirrored)
    basis = placement.basis if placement is not None else ""
    return {"reference": basis or None, "registration": registration}


def _compare_roughness(comparison: Comparison) -> JsonObject:
    """Return the roughness inside and outside of the track: `roughness` of compare.json, and the rows of a table."""
    evidence = comparison.evidence
    content = {"cutoff": evidence.cutoff, "inside": None, "outside": None}
    rows = {}
    for region, sides in evidence.roughness.items():
        content[region] = {side: to_answers(values) for side, values in sides.items()}
        for name in content[region]["before"]:
            row = {side: entries[name] for side, entries in content[region].items()}
            rows[f"{name} {region}"] = row | {"cutoff": {"value": evidence.cutoff, "unit": "m"}}
    if not rows:
        content["reason"] = sentences.MISSING_VALUE_REASONS[_explain_no_roughness(comparison)]
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
    heights = (curves.before, curves.after)
    if comparison.is_areal:
        data = make_maps(
            curves.x, curves.y, before_map=heights[0], after_map=heights[1], depth_map=curves.depth
        )
    else:
        data = make_variables("surface", x=curves.x, before=heights[0], after=heights[1])
        data |= make_band("depth", curves.depth, HALF_WIDTH_95 * curves.noise)
        state = np.select((curves.unworn, curves.worn, curves.grown), (1, 2, 3))
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
    curves = [np.quantile(values, 1 - MATERIAL_RATIOS) for values in known]
    return make_variables(
        "surface",
        material_ratio=MATERIAL_RATIOS,
        abbott_before=curves[0],
        abbott_after=curves[1],
    )


def _add_pressed(answer: Answer, runs: SurfaceRuns) -> Answer:
    """Add the measures and pressures of a scene that was run with the surface before and after wear."""
    pressed = runs.as_dict()
    data = dict(answer.data)
    for side, (places, stress) in runs.pressures().items():
        columns = {f"x_pressed_{side}": places, f"pressure_{side}": stress}
        data |= make_variables("surface", **columns)
    warnings = (*answer.remarks.warnings, *runs.failed, *pressed["warnings"])
    return replace(
        answer,
        data=data,
        remarks=Remarks(warnings, answer.remarks.notes),
        details=answer.details | {"pressed": pressed},
    )
