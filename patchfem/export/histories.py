"""Content of result.nc from a finished run."""

import numpy as np

from ..model import structure
from ..response.events import EVENT_KIND_NAMES
from ..response.levels import LEVEL_MEASURES
from ..response.rows import TABLE
from ..runs.results.result import Result, patch_surface
from . import netcdf
from .summary import package_versions, summarise_run

LEDGER = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")


def result_contents(result: Result) -> netcdf.Contents:
    """Return the contents of result.nc in SI units.

    It consists of histories, interface frames, levels, events, curve and provenance.
    """
    histories, modal = collect_histories(result)
    patch = result.patch
    extra = result.extra
    surface = patch_surface(patch, result.fields)
    x, weight = (surface.x, surface.weight) if surface is not None else (None, None)
    fields = {k: v for k, v in result.fields.items() if not k.startswith("holder_")}
    strips = (
        None
        if patch is None or patch.strips is None
        else (patch.strips.offsets, patch.strips.pressure)
    )
    levels = _level_columns(extra["levels"]) if "levels" in extra else None
    rig = result.plan.model.rig
    names = list(rig.friction.names) if histories and rig is not None else []
    data = netcdf.run_contents(
        histories, modal, fields, x, weight, strips, levels, names, _coordinate_description(rig)
    )
    if patch is not None:
        data = netcdf.add_surfaces(data, surface.unloaded_gap)
    if "faces" in extra:
        data = netcdf.add_faces(data, extra["faces"])
    if "events" in extra:
        e = extra["events"]
        data = netcdf.add_events(
            data, e.time, e.interface, e.kind, e.slide, e.count, EVENT_KIND_NAMES, e.source
        )
    if "curve" in extra:
        data = netcdf.add_curve(data, extra["curve"])
    if "decay" in extra:
        data = netcdf.add_decay(data, extra["decay"])
    if "spectra" in extra:
        data = netcdf.add_spectra(data, extra["spectra"])
    if "wear" in extra:
        data = netcdf.add_wear(
            data, extra["wear"], {name: m.unit for name, m in result.measures.items()}
        )
    if "regime" in extra:
        data = data.with_entries(
            attributes={"regime": extra["regime"], "largest_multiplier": largest_multiplier(extra)}
        )
    return netcdf.add_provenance(
        data, summarise_run(result), result.plan.model.source.resolved, package_versions()
    )


def largest_multiplier(extra: dict) -> float:
    """Return the largest absolute value of the Floquet multipliers of a run."""
    return float(np.abs(np.asarray(extra["multipliers"])).max(initial=0.0))


def collect_histories(result: Result) -> tuple:
    """Return the histories and the modal coordinates of a run.

    Returns
    -------
    tuple
        Histories by name, (k,) or (i, k) for i interfaces, and (names, (k, n)) of the modes or
        None; ({}, None) for a run without motion.
    """
    kind = result.plan.kind
    response = result.response
    if response is None:
        return {}, None
    if kind == "bench":
        lateral = {
            "lateral_displacement": response.lateral,
            "lateral_force": response.lateral_force,
            "yaw_moment": response.yaw_moment,
        }
        return {
            "time": response.time,
            "relative_displacement": response.slide,
            "relative_velocity": response.rate,
            "friction_force": response.force,
            "normal_load": response.load,
            **dict(zip(LEDGER, response.ledger)),
            **{name: values for name, values in lateral.items() if values is not None},
        }, None
    histories = {
        "time": response.time,
        "relative_displacement": response.output,
        "relative_velocity": response.output_rate,
        "absolute_acceleration": response.acceleration,
        "base_acceleration": response.base_acceleration,
    }
    if kind == "rig" and "ledger" in response.extra:
        histories |= dict(zip(LEDGER, response.extra["ledger"]))
    rig = result.plan.model.rig
    if rig.friction.names:
        histories |= _interface_histories(result)
    elif kind == "rig":
        constant_load = np.full(response.time.size, result.measures["normal_load"].value)
        histories |= {
            "friction_force": response.force,
            "normal_load": response.extra.get("normal_load", constant_load),
        }
        # If modes move the interface and the output differently, the slide has its own history.
        if not np.array_equal(response.slide, response.output):
            histories["slide"] = response.slide
    return histories, (
        list(rig.modes.names),
        structure.compute_named_motions(rig.modes, response.modal),
    )


def _interface_histories(result: Result) -> dict:
    """Return the histories (i, k) of all i interfaces and of the output of a rig that consists of masses."""
    response = result.response
    columns = {
        "relative_displacement": ("slides", response.slide),
        "relative_velocity": ("slide_rates", response.slide_rate),
        "friction_force": ("forces", response.force),
    }
    second = {
        f"lateral_{name}": np.ascontiguousarray(response.extra[f"lateral_{key}"].T)
        for name, key in (
            ("displacement", "slides"),
            ("velocity", "slide_rates"),
            ("force", "forces"),
        )
        if f"lateral_{key}" in response.extra
    }
    loads = np.array([interface.load for interface in result.plan.model.rig.friction.interfaces])
    return {
        "output_displacement": response.output,
        "output_velocity": response.output_rate,
        "normal_load": np.repeat(loads[:, None], response.time.size, axis=1),
        **{
            name: np.ascontiguousarray(response.extra[key].T)
            if key in response.extra
            else total[None, :]
            for name, (key, total) in columns.items()
        },
        **second,
    }


def _coordinate_description(rig) -> str:
    """Describe the coordinates of a run, or return "" if they are modal coordinates."""
    if rig is None or rig.structure.lists_modes or rig.modes.shapes is None:
        return ""
    if any(str(name).startswith("mode ") for name in rig.modes.names):
        return "displacement of a boundary coordinate, which `mode` names, or coordinate of a fixed-interface mode"
    return "displacement of the mass or coordinate of the structure that `mode` names"


def _level_columns(levels) -> dict:
    """Return the results of a run at each of its drive levels as columns."""
    out = {
        "level_drive": (levels[0].unit, np.array([level.drive for level in levels])),
        "level_stuck": ("1", np.array([level.stuck for level in levels], np.int8)),
    }
    if any(level.outcome for level in levels):
        out["level_outcome"] = ("", np.array([level.outcome for level in levels]))
    for name in LEVEL_MEASURES:
        if any(name in level.values for level in levels):
            out[f"level_{name}"] = (
                TABLE[name].unit,
                np.array([level.values.get(name, np.nan) for level in levels]),
            )
            out[f"level_{name}_error"] = (
                TABLE[name].unit,
                np.array([level.errors.get(name, np.nan) for level in levels]),
            )
    return out
