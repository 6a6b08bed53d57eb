"""What a finished run is shown by: the plain data of its page, its page and its pictures."""

import tomllib
from pathlib import Path

import numpy as np

from ..core import BaseSine, PatchfemError
from ..inputs import loops, measured
from ..response import spectrum
from ..runs.results.result import Result, surface_of
from ..structure.drive_sizes import largest
from .drawing import pictures
from .histories import largest_multiplier
from .pages.driven import command, driven
from .pages.released import released
from .pages.words import verdict
from .report import page, picture
from .summary import cycles_of, summary_of, versions


def report_data(result: Result) -> dict:
    """Plain arrays and texts of a run for the report page, by name; SI units throughout."""
    model, r, w = result.plan.model, result.response, result.window
    source, resolved = model.source, model.source.resolved
    scene = tomllib.loads(resolved)
    summary = summary_of(result)
    data = {"name": source.path.stem, "summary": summary, "scene": source.text, "resolved": resolved,
            "sets": source.sets, "driven": driven(scene), "command": command(source.path, source.sets),
            "sentence": verdict(summary), "released": released(result),
            "cycles": cycles_of(result), "engine": result.extra.get("engine", ""),
            "fields": result.fields,
            "x": None if result.patch is None else surface_of(result.patch, result.fields).x,
            "width": None if result.patch is None else result.plan.model.patch.width, "versions": versions(),
            "means": {name: one.text for name, one in result.measures.items()}}
    data |= {name: result.extra[name] for name in ("curve", "decay", "spectra") if name in result.extra}
    if "faces" in result.extra:
        data["faces"] = [(one.surface.x, one.fields, f"interface {one.name}") for one in result.extra["faces"]]
    if "wear" in result.extra:
        count, period = result.extra["wear_shown"]["states"], result.extra["wear_shown"]["period"]
        data["wear"] = {"history": result.extra["wear"], "period": period,
                        "states": {name: rows[:count + 1] for name, rows in result.fields.items()}}
        data["fields"] = {name: rows[count:] for name, rows in result.fields.items()}
        data["fields"]["time"] = data["fields"]["time"] - data["fields"]["time"][0]
    if "levels" in result.extra:
        data["levels"] = [{"drive": one.drive, "stuck": one.stuck, "values": one.values, "errors": one.errors,
                           "unit": one.unit, "outcome": one.outcome}
                          for one in result.extra["levels"]]
    if "regime" in result.extra:
        data["steady"] = {"regime": result.extra["regime"], "multiplier": largest_multiplier(result.extra)}
    if r is not None:
        slow = result.plan.kind == "bench"
        data["history"] = {"time": r.time, "displacement": r.slide if slow else r.output, "force": r.force}
        data["loop"] = {"slide": w.slide, "force": w.force, "time": w.time}
        if slow and (read := _recorded(source.path.parent, scene["slide"], r)) is not None:
            data["recorded"] = {"file": Path(scene["slide"]["file"]).name, "slide": read[1], "force": read[2]}
            data["history"]["measured"] = read[::2]
        if not slow:
            data["window"] = {"time": w.time, "displacement": w.output, "acceleration": w.acceleration,
                              "base": w.base_acceleration, "force": w.force, "slide": w.slide}
            data["loop"] |= {"period": result.extra["period"]}
            if model.rig.names and "slides" in w.extra:
                data["loop"]["each"] = list(zip(model.rig.names, w.extra["slides"].T, w.extra["forces"].T))
                data["loop"]["each"] += [(f"{name}, across: {one.lateral}", w.extra["lateral_slides"][:, k],
                                          w.extra["lateral_forces"][:, k])
                                         for k, (name, one) in enumerate(zip(model.rig.names, model.rig.interfaces))
                                         if one.lateral]
    if model.measured is not None:
        path, gains, kind, cutoff = model.measured
        rig = model.rig
        data["measured"] = {"rows": measured.read_table(path), "frequency": rig.frequency if rig is not None else None,
                            "gains": gains, "reading": "peak", "share": 1.0}
        if rig is not None:
            data["measured"]["input"] = largest(rig.drive)
            if kind != "peak" and isinstance(rig.drive, BaseSine) and "absolute_acceleration_peak" in result.measures:
                peak = result.measures["absolute_acceleration_peak"].value
                share = spectrum.reading(w, rig.drive, peak, kind, cutoff) / peak
                data["measured"] |= {"reading": kind, "share": share}
    return data


def _recorded(folder: Path, slide: dict, response) -> tuple | None:
    """Times [s], slides [m] and forces [N] that the file of a slide holds beside it; None where it holds no force."""
    if slide["kind"] != "file":
        return None

    try:
        read = loops.read_loop(folder / slide["file"])
    except PatchfemError:  # a path alone; its own faults were found when it was read as one
        return None
    if read.time is None:
        return None
    load = 1.0 if read.quantity == "force" else np.interp(read.time, response.time, response.load)
    return read.time, read.displacement, read.reading * load


def page_of(result: Result, bodies: dict, film: dict | None = None) -> str:
    """The HTML page of a run; bodies: the pressed pieces as `fields.bodies.write_fields` returns them; film: what
    `pages.player.reel` makes of the fields of its folder."""
    return page(report_data(result) | ({"bodies": bodies} if bodies else {}) | ({"film": film} if film else {}))


def axes(result: Result, names: tuple, onto=None, more: dict | None = None):
    """The first of the named pictures in which a run has something to show, as matplotlib Axes; None without.

    onto: Axes to draw the first panel on; without them the Axes are the first of a new figure with all panels. more:
    beside the data of the report.
    """
    data = report_data(result) | {name: one for name, one in (more or {}).items() if one}
    shown = next((one for one in (picture(name, data) for name in names) if one is not None), None)
    if shown is None:
        return None
    if onto is None:
        return pictures.draw.figure(shown.charts(*shown.values)).axes[0]
    pictures.draw.figure(shown.charts(*shown.values), onto=onto)
    return onto
