"""summary.json: the answer of a run as one small object."""

import json
import math
from pathlib import Path


def measure_object(measure) -> dict:
    """The object {"value", "unit", "error", "floor"} of a Measure; a value that is not finite becomes null.

    A measure without a value has its "reason" beside it.
    """
    def clean(number):
        return None if number is None or not math.isfinite(number) else float(number)

    out = {"value": clean(measure.value), "unit": measure.unit, "error": clean(measure.error),
           "floor": float(measure.floor)}
    return {**out, "reason": measure.reason} if measure.reason else out


def summary(version: str, title: str, kind: str, outcome: str, measures: dict, effects: list, absent: list,
            said: tuple, seconds: dict) -> dict:
    """The object of summary.json: the answer of a run with its effects, warnings, notes and times.

    measures: name -> Measure; effects: dicts with effect, equations and seconds; absent: effects not in the scene;
    said: (warnings on numerical trust, notes on what the model leaves out); seconds: part of the run -> time.
    """
    return {"patchfem": version, "title": title, "kind": kind, "outcome": outcome,
            "measures": {name: measure_object(m) for name, m in measures.items()}, "effects": effects,
            "not_in_scene": absent, "warnings": list(said[0]), "notes": list(said[1]),
            "seconds": {name: round(float(value), 6) for name, value in seconds.items()}}


def write_json(value: dict, path: Path) -> None:
    """Write `value` to `path` as strict JSON with a final newline; ValueError for NaN or infinity in it."""
    Path(path).write_text(json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
