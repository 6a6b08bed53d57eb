"""A finished run on disk: summary, netCDF, fields, resolved scene and report in one results folder."""

import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter

import numpy as np

from .. import __version__
from ..effects import EFFECTS
from ..model.structure import motions
from ..response.events import MEANINGS
from ..response.levels import KEPT
from ..response.rows import TABLE
from ..runs.results.result import Result
from ..runs.run import Kept, run
from ..structure.drive_sizes import largest
from . import netcdf
from .report import picture, write_report
from .results import STATE, Folder
from .summary import summary, write_json

LEDGER = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
PACKAGES = ("numpy", "scipy", "scikit-fem", "numba", "xarray", "h5netcdf", "matplotlib")


def versions() -> dict:
    """Versions, by name, of the interpreter and of the packages that compute, those that are there."""
    out = {"python": ".".join(map(str, sys.version_info[:3]))}
    for name in PACKAGES:
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            continue
    return out


def summary_of(result: Result) -> dict:
    """The object of summary.json."""
    what = result.plan
    return summary(__version__, what.model.source.title, what.kind, str(result.outcome), result.measures,
                   effects_of(result), list(what.not_in_scene), (result.warnings, result.extra.get("notes", [])),
                   result.seconds)


def effects_of(result: Result) -> list:
    """Effects of a run as [{"effect", "equations", "seconds"}].

    The law and the modes share one loop, whose time stands with the law.
    """
    patch, out = result.patch, []
    loop = result.seconds.get("march", result.seconds.get("bench", 0.0))
    for name in result.plan.effects:
        seconds = 0.0
        if patch is not None and name == "contact":
            seconds = sum(patch.seconds.get(k, 0.0) for k in ("assemble", "condense", "press"))
        elif patch is not None and name.removeprefix("contact.") in patch.seconds:
            seconds = patch.seconds[name.removeprefix("contact.")]
        elif name == "contact.shear":
            seconds = result.seconds.get("reduce", 0.0)
        elif name.startswith("friction.law=") or (name == "structure" and result.plan.kind == "linear"):
            seconds = loop
        out.append({"effect": name, "equations": EFFECTS[name].equations, "seconds": round(float(seconds), 6)})
    return out


def run_into(what, target: Path, say=None, progress=None, fresh: bool = False, resume: bool = False) -> dict:
    """Run a plan into the results folder `target` and return its summary.

    The folder is claimed first. An older folder of results is replaced only when the new one is whole, and a folder
    with other files is refused before anything runs. A run with [wear] keeps its state in the folder, from which it
    goes on with `resume`; PatchfemError where there is none.
    """
    with Folder(target, resume) as folder:
        kept = Kept(folder.path / STATE, __version__, resume) if what.model.wear is not None else None
        result = run(what, say, progress, fresh=fresh, kept=kept)
        return write(result, folder.path)


def write(result: Result, path: Path) -> dict:
    """Write every file of a run into the folder `path` and return its summary."""
    begin = perf_counter()
    text = result.plan.model.source.resolved
    (path / "scene.resolved.toml").write_text(text, encoding="utf-8")
    _write_netcdf(result, path / "result.nc")
    data = report_data(result)
    if result.patch is not None:
        from .fields.bodies import write_fields

        drawn = write_fields(result, path / "fields.vtkhdf")
        data |= {"bodies": drawn} if drawn else {}

    result.seconds["files"] = perf_counter() - begin
    write_report(path / "report.html", data)
    result.seconds["files"] = perf_counter() - begin
    answer = summary_of(result)
    write_json(answer, path / "summary.json")
    return answer


def _histories(result: Result) -> tuple:
    kind, r = result.plan.kind, result.response
    if r is None:
        return {}, None
    if kind == "bench":
        across = {"lateral_displacement": r.lateral, "lateral_force": r.lateral_force, "yaw_moment": r.yaw_moment}
        return {"time": r.time, "relative_displacement": r.slide, "relative_velocity": r.rate,
                "friction_force": r.force, "normal_load": r.load,
                **dict(zip(LEDGER, r.ledger)),
                **{name: values for name, values in across.items() if values is not None}}, None
    out = {"time": r.time, "relative_displacement": r.output, "relative_velocity": r.output_rate,
           "absolute_acceleration": r.acceleration, "base_acceleration": r.base_acceleration}
    if kind == "rig" and "ledger" in r.extra:
        out |= dict(zip(LEDGER, r.extra["ledger"]))
    rig = result.plan.model.rig
    if rig.names:
        out |= _between(result)
    elif kind == "rig":
        still = np.full(r.time.size, result.measures["normal_load"].value)
        out |= {"friction_force": r.force, "normal_load": r.extra.get("normal_load", still)}
    return out, (list(rig.modes.names), motions(rig.modes, r.modal))


def _between(result: Result) -> dict:
    """Histories (i, k) of the interfaces of a rig of masses, those of its output beside them."""
    r = result.response
    columns = {"relative_displacement": ("slides", r.slide), "relative_velocity": ("slide_rates", r.slide_rate),
               "friction_force": ("forces", r.force)}
    loads = np.array([one.load for one in result.plan.model.rig.interfaces])
    return {"output_displacement": r.output, "output_velocity": r.output_rate,
            "normal_load": np.repeat(loads[:, None], r.time.size, axis=1),
            **{name: np.ascontiguousarray(r.extra[many].T) if many in r.extra else one[None, :]
               for name, (many, one) in columns.items()}}


def _write_netcdf(result: Result, path: Path) -> None:
    netcdf.write(dataset(result), path)


def dataset(result: Result):
    """The xarray.Dataset of result.nc in SI: histories, interface frames, levels, events, curve, provenance."""
    histories, modal = _histories(result)
    patch, extra = result.patch, result.extra
    x, weight = (patch.x, patch.pieces.interface.weight) if patch is not None else (None, None)
    fields = {k: v for k, v in result.fields.items() if not k.startswith("holder_")}
    strips = None if patch is None or patch.strips is None else (patch.strips.offsets, patch.strips.pressure)
    levels = _levels(extra["levels"]) if "levels" in extra else None
    rig = result.plan.model.rig
    names = list(rig.names) if histories and rig is not None else []
    data = netcdf.dataset(histories, modal, fields, x, weight, strips, levels, names)
    if "events" in extra:
        e = extra["events"]
        data = netcdf.with_events(data, e.time, e.interface, e.kind, e.slide, e.count, MEANINGS, e.source)
    if "curve" in extra:
        data = netcdf.with_curve(data, extra["curve"])
    if "wear" in extra:
        data = netcdf.with_wear(data, extra["wear"], {name: m.unit for name, m in result.measures.items()})
    if "regime" in extra:
        data = data.assign_attrs(regime=extra["regime"], largest_multiplier=_multiplier(extra))
    return netcdf.described(data, summary_of(result), result.plan.model.source.resolved, versions())


def _multiplier(extra: dict) -> float:
    """Largest |Floquet multiplier|."""
    return float(np.abs(np.asarray(extra["multipliers"])).max(initial=0.0))


def _levels(levels) -> dict:
    """Columns of a run in levels: the drive, whether it held, every measure and its error."""
    out = {"level_drive": ("m s-2", np.array([one.drive for one in levels])),
           "level_stuck": ("1", np.array([one.stuck for one in levels], np.int8))}
    for name in KEPT:
        if any(name in one.values for one in levels):
            out[f"level_{name}"] = (TABLE[name].unit, np.array([one.values.get(name, np.nan) for one in levels]))
            out[f"level_{name}_error"] = (TABLE[name].unit, np.array([one.errors.get(name, np.nan) for one in levels]))
    return out


def report_data(result: Result) -> dict:
    """Plain arrays and texts of a run for the report page, by name; SI units throughout."""
    model, r, w = result.plan.model, result.response, result.window
    source = model.source
    data = {"name": source.path.stem, "summary": summary_of(result), "scene": source.text, "resolved": source.resolved,
            "sentence": result.outcome.sentence, "engine": result.extra.get("engine", ""), "fields": result.fields,
            "x": None if result.patch is None else result.patch.x, "versions": versions()}
    if "curve" in result.extra:
        data["curve"] = result.extra["curve"]
    if "wear" in result.extra:
        count, period = result.extra["wear_shown"]["states"], result.extra["wear_shown"]["period"]
        data["wear"] = {"history": result.extra["wear"], "period": period,
                        "states": {name: rows[:count + 1] for name, rows in result.fields.items()}}
        data["fields"] = {name: rows[count:] for name, rows in result.fields.items()}
        data["fields"]["time"] = data["fields"]["time"] - data["fields"]["time"][0]
    if "levels" in result.extra:
        data["levels"] = [{"drive": one.drive, "stuck": one.stuck, "values": one.values, "errors": one.errors}
                          for one in result.extra["levels"]]
    if "regime" in result.extra:
        data["steady"] = {"regime": result.extra["regime"], "multiplier": _multiplier(result.extra)}
    if r is not None:
        slow = result.plan.kind == "bench"
        data["history"] = {"time": r.time, "displacement": r.slide if slow else r.output, "force": r.force}
        data["loop"] = {"slide": w.slide, "force": w.force, "time": w.time}
        if not slow:
            data["window"] = {"time": w.time, "displacement": w.output, "acceleration": w.acceleration,
                              "base": w.base_acceleration, "force": w.force, "slide": w.slide}
            data["loop"] |= {"period": result.extra["period"]}
    if model.measured is not None:
        from ..inputs.measured import read_table

        path, gain = model.measured
        rig = model.rig
        data["measured"] = {"rows": read_table(path), "frequency": rig.frequency if rig is not None else None,
                            "gain": gain}
        if rig is not None:
            data["measured"]["input"] = largest(rig.drive)
    return data


def figure(result: Result, names: tuple):
    """The first of the named pictures in which a run has something to show, as a matplotlib Figure; None without."""
    data = report_data(result)
    shown = (picture(name, data) for name in names)
    return next((one.draw.figure(*one.values) for one in shown if one is not None), None)


def save(result: Result, folder: Path) -> None:
    """Write the results folder of a run that is done; an older one is replaced."""
    with Folder(folder) as claimed:
        write(result, claimed.path)
