"""summary.json: the results of a run as one small object."""

import json
import math
import sys
import tomllib
from functools import cache
from pathlib import Path

from .. import __version__
from ..core import Outcome
from ..disk.atomic_write import write_text
from ..disk.installed import list_installed_versions
from ..effects import EFFECTS
from ..runs.patch import values
from ..runs.results.result import Result, collect_used_settings, engine_by_measure
from ..runs.rig import plan as rig_plan

# Ratio of a stiffness to its error above which the loss factor is computed.
MIN_STIFFNESS_ERRORS = 10.0
PACKAGES = ("numpy", "scipy", "scikit-fem", "numba", "xarray", "h5netcdf", "matplotlib")


def measure_object(measure) -> dict:
    """Convert a Measure to the JSON object of a summary.

    Numbers that are not finite become None. A measure without a value also has its "reason".
    """

    def clean(number):
        """Convert a number to float, or to None if it is not finite."""
        return None if number is None or not math.isfinite(number) else float(number)

    out = {
        "value": clean(measure.value),
        "unit": measure.unit,
        "error": clean(measure.error),
        "floor": float(measure.floor),
    }
    return {**out, "reason": measure.reason} if measure.reason else out


def make_summary(
    version: str,
    title: str,
    kind: str,
    outcome: str,
    measures: dict,
    effects: list,
    absent: list,
    messages: tuple,
    seconds: dict,
) -> dict:
    """Return the contents of summary.json.

    Parameters
    ----------
    version, title, kind, outcome : str
    measures : dict
        Name -> Measure.
    effects : list of dict
        With effect, equations and seconds.
    absent : list of str
        Effects that are not in the scene.
    messages : tuple
        Warnings about numerical trust, and notes about what the model leaves out.
    seconds : dict
        Part of the run -> time.

    Returns
    -------
    dict
    """
    return {
        "patchfem": version,
        "title": title,
        "kind": kind,
        "outcome": outcome,
        "measures": {name: measure_object(m) for name, m in measures.items()},
        "effects": effects,
        "not_in_scene": absent,
        "warnings": list(messages[0]),
        "notes": list(messages[1]),
        "seconds": {name: round(float(value), 6) for name, value in seconds.items()},
    }


def write_json(value: dict, path: Path) -> None:
    """Write a value as strict JSON; raise ValueError for NaN or infinity."""
    write_text(path, json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def read_summary(path: Path) -> dict:
    """Read and check a summary.json file.

    OSError if it cannot be read, ValueError if `make_summary` cannot have made it.
    """
    text = path.read_text(encoding="utf-8")
    try:
        _summary_model().model_validate_json(text, strict=True)
        return json.loads(text, parse_int=_parse_int)
    except RecursionError:
        raise ValueError("nested deeper than a summary is") from None
    except ValueError as fault:  # a pydantic error has many lines, of which the first is reported
        if not hasattr(fault, "errors"):
            raise
        first = fault.errors(include_url=False)[0]
        at = ".".join(map(str, first["loc"]))
        raise ValueError(
            f"{path.name} is not a summary of a run: {at + ': ' * bool(at)}{first['msg']}"
        ) from None


def _parse_int(digits: str) -> int:
    """Parse an integer; raise ValueError if it is too large for a float."""
    if len(digits) > 300:
        raise ValueError(f"a whole number of {len(digits)} digits cannot come from a run")
    return int(digits)


@cache
def _summary_model() -> type:
    """Return the pydantic model that checks the entries on which readers of a summary rely."""
    from pydantic import BaseModel

    class Number(BaseModel):
        value: float | None
        unit: str
        error: float | None
        floor: float
        reason: str = ""

    class Seconds(BaseModel):
        total: float

    class Summary(BaseModel):
        kind: str
        outcome: str
        measures: dict[str, Number]
        seconds: Seconds

    return Summary


def summarise_run(result: Result) -> dict:
    """Return the contents of summary.json for a run."""
    run_plan = result.plan
    summary = make_summary(
        __version__,
        run_plan.model.source.title,
        run_plan.kind,
        str(result.outcome),
        result.measures,
        effect_entries(result),
        list(run_plan.not_in_scene),
        (result.warnings, result.extra.get("notes", [])),
        result.seconds,
    )
    numerics = collect_used_settings(result) | {"measures": engine_by_measure(result)}
    return (
        summary
        | {"numerics": numerics}
        | contact_entry(result)
        | runaway_data(result)
        | loop_entry(result)
    )


def runaway_data(result: Result) -> dict:
    """Return the drive signal [m s-2] of an unsettled motion, and the largest one that friction can limit.

    It is {"run_away": {"drive", "knee"}}: the acceleration of the base, and the one above which
    friction alone does not limit the amplitude at resonance.
    """
    drive_and_knee = (
        rig_plan.find_drive_and_knee(result.plan.model)
        if result.outcome in (Outcome.TRANSIENT, Outcome.GROWS)
        else {}
    )
    return (
        {"run_away": drive_and_knee}
        if drive_and_knee and drive_and_knee["drive"] > drive_and_knee["knee"]
        else {}
    )


def loop_entry(result: Result) -> dict:
    """Return the displacement amplitude [m] and the loss factor of a bench in periodic motion as a dict.

    It is {"loop": {"slide_amplitude", "loss_factor", "error"}}. The loss factor is the work of a
    cycle over 2 pi times the largest elastic energy, W/(pi k A^2) with the equivalent stiffness k.
    {} if this stiffness is not positive beyond its error.
    """
    stiffness, work = (result.measures.get(name) for name in ("equivalent_stiffness", "loop_area"))
    if (
        result.plan.kind != "bench"
        or None in (stiffness, work)
        or None in (stiffness.value, work.value)
    ):
        return {}
    amplitude = result.plan.model.slide.amplitude
    stiffness_error = stiffness.error or stiffness.floor
    if stiffness.value <= MIN_STIFFNESS_ERRORS * stiffness_error or work.value < 0:
        return {}
    factor = work.value / (math.pi * stiffness.value * amplitude**2)
    error = (
        None
        if None in (stiffness.error, work.error)
        else work.error / (math.pi * stiffness.value * amplitude**2)
        + factor * stiffness.error / stiffness.value
    )
    return {"loop": {"slide_amplitude": amplitude, "loss_factor": factor, "error": error}}


def contact_entry(result: Result) -> dict:
    """Return the intervals [m] in which a solved patch without strips is in contact, as a dict.

    It is {"contact": {"from", "to": ends of the interface, "stretches": [[begin, end] of each part
    in contact]}}.
    """
    patch = result.patch
    if patch is None or patch.strips is not None or not patch.active.any():
        return {}
    if patch.points is not None:
        intervals = patch.points.intervals
    else:
        intervals = values.contact_intervals(patch, values.contact_ends(patch))
    return {
        "contact": {
            "from": float(patch.x[0]),
            "to": float(patch.x[-1]),
            "stretches": intervals.tolist(),
        }
    }


def count_cycles(result: Result) -> float | None:
    """Return the number of cycles of the drive signal or of the slide, or None if the run has none."""
    r = result.response
    period = result.extra.get("period")
    if r is not None and period and result.plan.kind != "bench":
        return float(r.time[-1] - r.time[0]) / period
    return tomllib.loads(result.plan.model.source.resolved).get("slide", {}).get("cycles")


def effect_entries(result: Result) -> list:
    """Return the computed effects of a run with equations and CPU time.

    The law and the modes share one loop, whose time is assigned to the law.
    """
    patch = result.patch
    out = []
    loop = result.seconds.get("march", result.seconds.get("bench", 0.0))
    for name in result.plan.effects:
        seconds = 0.0
        if patch is not None and name == "contact":
            seconds = sum(patch.seconds.get(k, 0.0) for k in ("condense", "press"))
        elif patch is not None and name.removeprefix("contact.") in patch.seconds:
            seconds = patch.seconds[name.removeprefix("contact.")]
        elif name == "contact.shear":
            seconds = result.seconds.get("reduce", 0.0)
        elif name.startswith("friction.law=") or (
            name == "structure" and result.plan.kind == "linear"
        ):
            seconds = loop
        out.append(
            {
                "effect": name,
                "equations": EFFECTS[name].equations,
                "seconds": round(float(seconds), 6),
            }
        )
    return out


def package_versions() -> dict:
    """Return the versions of Python and of the packages that compute, as a dict."""
    installed = list_installed_versions()
    return {"python": ".".join(map(str, sys.version_info[:3]))} | {
        name: installed[name] for name in PACKAGES if name in installed
    }
