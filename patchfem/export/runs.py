"""The answer of a run: measures, verdict, arrays and the keys of summary.json."""

import math
import shlex
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten

from .. import __version__
from ..core import Measure, Outcome
from ..disk.installed import list_installed_versions
from ..effects import EFFECTS
from ..runs.patch import values
from ..runs.results.result import Result, collect_used_settings, engine_by_measure
from ..runs.rig import plan as rig_plan
from .answer import Answer, JsonObject, Quantities, Quantity, Remarks
from .run_data import collect_data
from .run_words import list_readings, make_verdict

# ratio of a stiffness to its error above which the loss factor is computed
MIN_STIFFNESS_TO_ERROR = 10.0
RECORDED_PACKAGES = ("numpy", "scipy", "scikit-fem", "numba", "xarray", "h5netcdf", "matplotlib")


def make_run_answer(result: Result) -> Answer:
    """Return the answer of a run: its measures, verdict, arrays and warnings, from its result."""
    run_plan = result.plan
    source = run_plan.model.source
    measures = make_quantities(result.measures)
    details = make_details(result)
    changed = _format_changed_keys(source.sets)
    title = f"{source.title}; changed: {changed}" if source.title and changed else source.title
    return Answer(
        kind=run_plan.kind,
        title=title,
        verdict=make_verdict(result, measures, details),
        quantities=measures,
        data=collect_data(result),
        remarks=Remarks(tuple(result.warnings), tuple(result.notes)),
        details=details,
        origin=make_origin(source, "run"),
    )


def _format_changed_keys(sets: tuple[str, ...]) -> str:
    """Return the scene keys that options --set have changed, such as "load = 4 kN"; at most 160 characters."""
    pairs = (assignment.partition("=") for assignment in sets)
    return shorten(", ".join(f"{key} = {value}" for key, _, value in pairs), 160)


def make_quantities(measures: dict[str, Measure]) -> Quantities:
    """Return the measures of a run as quantities."""
    quantities = {}
    for name, measure in measures.items():
        is_unknown = measure.value is not None and measure.error is None
        reason = measure.reason or ("error unknown" if is_unknown else "")
        quantities[name] = Quantity(
            measure.value, measure.unit, measure.error, floor=float(measure.floor), reason=reason
        )
    return quantities


def make_origin(source, verb: str) -> JsonObject:
    """Return where an answer comes from.

    Parameters
    ----------
    source : model.Source
        Scene as text, as written and with all defaults.
    verb : str
        Verb that repeats it on the scene.

    Returns
    -------
    dict
        Keys `patchfem`, `scene`, `resolved`, `command` and `versions`, all without the folder of the scene; and `source`,
        from which `write_answer` writes the resolved scene for another folder.
    """
    return {
        "patchfem": __version__,
        "scene": source.text,
        "resolved": source.resolved,
        "source": source,
        "command": make_command(verb, source.path, source.repeating_sets),
        "versions": list_versions(),
    }


def make_command(verb: str, path: Path, sets: tuple[str, ...], options: Sequence[str] = ()) -> str:
    """Return the command line that repeats a verb, or "" for a scene without a file, which Python gave as text or dict.

    Parameters
    ----------
    verb : str
        Command, such as "run".
    path : Path
        Scene file. It is named without its folder.
    sets : tuple of str
        ``table.key=value`` strings.
    options : sequence of str, optional
        Further words.
    """
    name = Path(path).name
    if name.startswith("<"):  # such as "<text>"
        return ""
    words = ["patchfem", verb, name]
    for assignment in sets:
        key, _, value = assignment.partition("=")
        words += ["--set", f"{key}={Path(value).name if Path(value).is_absolute() else value}"]
    return shlex.join([*words, *options])


def list_versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute."""
    installed = list_installed_versions()
    python = ".".join(map(str, sys.version_info[:3]))
    return {"python": python} | {
        name: installed[name] for name in RECORDED_PACKAGES if name in installed
    }


def make_details(result: Result) -> JsonObject:
    """Return the further keys of summary.json for a run, such as outcome, effects, seconds, cycles and readings."""
    details = {
        "outcome": str(result.outcome),
        "effects": _list_effects(result),
        "not_in_scene": result.plan.not_in_scene,
        "seconds": {name: round(float(value), 6) for name, value in result.seconds.items()},
        "numerics": collect_used_settings(result) | {"measures": engine_by_measure(result)},
    }
    cycles = count_cycles(result)
    optional = {
        "cycles": cycles,
        "contact": _find_contact(result),
        "run_away": _find_run_away(result),
        "loop": _find_loss_factor(result),
        "measured": list_readings(result),
    }
    return details | {name: value for name, value in optional.items() if value}


def count_cycles(result: Result) -> float | None:
    """Return the number of cycles of the drive or of the slide in a run, or None if it has none."""
    response = result.response
    period = result.histories.period
    if response is not None and period and result.plan.kind != "bench":
        return (response.time[-1] - response.time[0]) / period
    return tomllib.loads(result.plan.model.source.resolved).get("slide", {}).get("cycles")


def _list_effects(result: Result) -> list[JsonObject]:
    """Return `effect`, `equations` and `seconds` of each computed effect.

    Law and modes share one loop, whose time is that of the law.
    """
    patch_seconds = {} if result.patch is None else result.patch.seconds
    loop_seconds = result.seconds.get("march", result.seconds.get("bench", 0.0))
    effect_seconds = {f"contact.{name}": seconds for name, seconds in patch_seconds.items()}
    effect_seconds["contact"] = patch_seconds.get("condense", 0.0) + patch_seconds.get("press", 0.0)
    effect_seconds["contact.shear"] = result.seconds.get("reduce", 0.0)
    if result.plan.kind == "linear":
        effect_seconds["structure"] = loop_seconds

    entries = []
    for name in result.plan.effects:
        is_law = name.startswith("friction.law=")
        seconds = round(float(loop_seconds if is_law else effect_seconds.get(name, 0.0)), 6)
        entries.append({"effect": name, "equations": EFFECTS[name].equations, "seconds": seconds})
    return entries


def _find_contact(result: Result) -> JsonObject:
    """Return {"from", "to": ends of the interface [m], "stretches": (start, end) [m] of each part in contact}.

    The dict is empty for a patch without contact, and for a face.
    """
    patch = result.patch
    is_plane = patch is not None and patch.model.area is None
    if not is_plane or not patch.active.any():
        return {}
    if patch.points is not None:
        intervals = patch.points.intervals
    else:
        intervals = values.find_contact_intervals(patch)
    ends = {"from": patch.x[0], "to": patch.x[-1]}
    return ends | {"stretches": intervals.tolist()}


def _find_run_away(result: Result) -> JsonObject:
    """Return drive and limit [m s-2] of a motion that friction cannot bound, {} for other motions.

    The keys are "drive" and "knee", the largest drive at which friction bounds the resonance.
    """
    if result.outcome not in (Outcome.TRANSIENT, Outcome.GROWS):
        return {}
    levels = rig_plan.find_drive_and_knee(result.plan.model)
    return levels if levels and levels["drive"] > levels["knee"] else {}


def _find_loss_factor(result: Result) -> JsonObject:
    """Return slide amplitude [m] and loss factor of a bench in periodic motion.

    The loss factor is the work of a cycle over 2 pi times the largest elastic energy, W/(pi k A^2) with the equivalent
    stiffness k. {} if this stiffness is not positive beyond its error.
    """
    stiffness = result.measures.get("equivalent_stiffness")
    work = result.measures.get("loop_area")
    if result.plan.kind != "bench" or stiffness is None or work is None:
        return {}
    if None in (stiffness.value, work.value) or work.value < 0:
        return {}
    stiffness_error = stiffness.error or stiffness.floor
    if stiffness.value <= MIN_STIFFNESS_TO_ERROR * stiffness_error:
        return {}

    amplitude = result.plan.model.slide.amplitude
    elastic = math.pi * stiffness.value * amplitude**2
    factor = work.value / elastic
    error = None
    if None not in (stiffness.error, work.error):
        error = work.error / elastic + factor * stiffness.error / stiffness.value
    return {"slide_amplitude": amplitude, "loss_factor": factor, "error": error}
