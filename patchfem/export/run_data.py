"""Arrays of a run as variables with dimensions, units and descriptions: the content of result.nc.

In: a `Result` of `runs`. Out: {name: Variable}. VARIABLES lists the names of the histories and fields; the other parts of a
run (levels, events, curve, decay, spectra, wear, measured readings, accuracy) have one function each.
"""

import tomllib

import numpy as np

from ..core import PatchfemError, SineDrive
from ..inputs import loops, measured
from ..model import structure
from ..response import spectrum
from ..response.events import EVENT_KIND_NAMES
from ..response.levels import LEVEL_MEASURES
from ..response.rows import TABLE
from ..runs.accuracy_curve import compute_accuracy_curve
from ..runs.results.result import Result, patch_surface
from ..structure import drive_sizes
from .answer import Variable

STATUS_NAMES = ("open", "stick", "slip")
ENERGIES = ("friction_work", "energy_stored", "energy_dissipated", "energy_created")
# a measured row belongs to a run if its frequency differs by no more than this [Hz]
SAME_FREQUENCY = 0.5
HOLDER_PREFIX = "holder_"  # fields of the holders, which only fields.vtkhdf contains

# unit and description of the histories and of the fields along the interface
VARIABLES = {
    "time": ("s", "time"),
    "relative_displacement": ("m", "displacement of the output relative to the base"),
    "relative_velocity": ("m s-1", "velocity of the output relative to the base"),
    "absolute_acceleration": ("m s-2", "acceleration at the output, base motion included"),
    "base_acceleration": ("m s-2", "acceleration of the base"),
    "slide": ("m", "relative displacement of the two surfaces of the interface"),
    "slide_velocity": ("m s-1", "relative velocity of the two surfaces of the interface"),
    "friction_force": ("N", "resultant friction force, positive when it opposes positive slip"),
    "normal_load": ("N", "normal load on the interface"),
    "lateral_displacement": ("m", "slide of the interface across the sliding direction"),
    "lateral_velocity": ("m s-1", "velocity of the slide across the sliding direction"),
    "lateral_force": ("N", "friction force across the sliding direction"),
    "yaw_moment": (
        "N m",
        "moment about +z of the friction on the upper piece, sum of y f_x - x f_y",
    ),
    "friction_work": ("J", "work done against friction since the start of the run"),
    "energy_stored": ("J", "elastic energy of the interface"),
    "energy_dissipated": ("J", "energy dissipated by friction since the start of the run"),
    "energy_created": ("J", "energy created since the start by a friction law that is not passive"),
    "modal_coordinate": ("m", "modal coordinate"),
    "x": ("m", "position along the sliding direction"),
    "weight": (
        "m2",
        "area of the interface that belongs to a node, summed over all pairs of pieces",
    ),
    "frame_time": ("s", "time of the frame"),
    "normal_stress": ("Pa", "normal stress at the nodes, compression positive"),
    "shear_stress": ("Pa", "frictional shear stress, positive when it opposes positive slip"),
    "gap": ("m", "gap that remains between the loaded surfaces"),
    "slip": ("m", "irreversible local slip"),
    "status": ("", "contact status; FILES.md defines slip"),
    "worn_depth": ("m", "worn depth, sum of both pieces"),
    "unloaded_gap": ("m", "gap of the unloaded surfaces, wear included"),
    "strip_offset": ("m", "position of the strip across the width"),
    "strip_normal_stress": ("Pa", "normal stress at the nodes of each strip, compression positive"),
}


def collect_data(result: Result) -> dict[str, Variable]:
    """Return all arrays of a run, in SI units."""
    data = _histories(result) | _loop(result)
    if (period := result.extra.get("period")) is not None:
        data["period"] = Variable((), np.array(float(period)), "s", "period of the drive")
    data |= _patch(result)
    for face in result.extra.get("faces", ()):
        data |= _face(face)
    for key, collect in PARTS.items():
        if key in result.extra:
            data |= collect(result)
    return data | _measured_readings(result) | _accuracy(result)


def _variable(name: str, dims: tuple[str, ...], values) -> Variable:
    """Return a variable of VARIABLES."""
    unit, text = VARIABLES[name]
    meanings = STATUS_NAMES if name == "status" else ()
    return Variable(dims, np.asarray(values), unit, text, meanings)


def _histories(result: Result) -> dict[str, Variable]:
    """Return the histories of a run: on `time`, or on (interface, time) for each interface of a rig of masses."""
    response = result.response
    if response is None:
        return {}
    if result.plan.kind == "bench":
        columns = _bench_columns(response)
    else:
        columns = _rig_columns(result)
    data = {"time": _variable("time", ("time",), response.time)}
    for name, values in columns.items():
        if values is not None:
            data[name] = _variable(name, ("interface", "time")[-np.ndim(values) :], values)
    rig = result.plan.model.rig
    if rig is None:
        return data

    if rig.friction.names:
        text = "the two masses of the interface; 0 is the base"
        data["interface"] = Variable(("interface",), np.array(rig.friction.names, str), "", text)
    names = np.array([str(name) for name in rig.modes.names])
    data["mode"] = Variable(("mode",), names, "", "mode or coordinate of the structure")
    motions = structure.compute_named_motions(rig.modes, response.modal)
    data["modal_coordinate"] = _variable("modal_coordinate", ("time", "mode"), motions)
    return data


def _bench_columns(response) -> dict:
    """Return the histories of a bench by name; None for one that it does not have."""
    return {
        "relative_displacement": response.slide,
        "relative_velocity": response.rate,
        "slide": response.slide,
        "friction_force": response.force,
        "normal_load": response.load,
        **dict(zip(ENERGIES, response.ledger, strict=False)),
        "lateral_displacement": response.lateral,
        "lateral_force": response.lateral_force,
        "yaw_moment": response.yaw_moment,
    }


def _rig_columns(result: Result) -> dict:
    """Return the histories of a rig by name, (k,) or (i, k) for i interfaces."""
    response = result.response
    extra = response.extra
    columns = {
        "relative_displacement": response.output,
        "relative_velocity": response.output_rate,
        "absolute_acceleration": response.acceleration,
        "base_acceleration": response.base_acceleration,
    }
    if result.plan.kind != "rig":
        return columns
    if "ledger" in extra:
        columns |= dict(zip(ENERGIES, extra["ledger"], strict=False))
    friction = result.plan.model.rig.friction
    count = response.time.size
    if not friction.names:
        load = np.full(count, result.measures["normal_load"].value)
        return columns | {
            "slide": response.slide,
            "friction_force": response.force,
            "normal_load": extra.get("normal_load", load),
        }

    # an engine stores one row per sample for each interface, or the histories of a single interface
    loads = np.array([interface.load for interface in friction.interfaces])
    columns["normal_load"] = np.repeat(loads[:, None], count, axis=1)
    sources = {
        "slide": ("slides", response.slide),
        "slide_velocity": ("slide_rates", response.slide_rate),
        "friction_force": ("forces", response.force),
    }
    for name, (key, single) in sources.items():
        columns[name] = extra[key].T if key in extra else single[None, :]
    for name, key in (("displacement", "slides"), ("velocity", "slide_rates"), ("force", "forces")):
        if f"lateral_{key}" in extra:
            columns[f"lateral_{name}"] = extra[f"lateral_{key}"].T
    return columns


def _loop(result: Result) -> dict[str, Variable]:
    """Return the friction loop of the last cycle, of each interface for a rig of masses; and a measured loop."""
    window = result.window
    if window is None or not np.any(window.force) or np.ptp(window.slide) == 0:
        return {}
    dims = ("loop_point",)
    slide = window.slide
    force = window.force
    period = result.extra.get("period")
    keep = np.ones(window.time.size, bool)
    if period and result.plan.kind != "bench":
        keep = window.time >= window.time[-1] - period * (1 + 1e-9)
    if result.plan.model.rig is not None and "slides" in window.extra:
        dims = ("interface", "loop_point")
        slide = window.extra["slides"].T
        force = window.extra["forces"].T
    slide = slide[..., keep]
    force = force[..., keep]
    if result.plan.model.sticks_rigidly and slide.ndim == 1:
        slide, force = _insert_jumps(slide, force)
    data = {
        "loop_slide": Variable(dims, slide, "m", "slide of the interface in the last cycle"),
        "loop_friction_force": Variable(dims, force, "N", "friction force in the last cycle"),
    }
    return data | _measured_loop(result)


def _insert_jumps(slide: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a loop with the jumps of the force of a rigid interface.

    The force of a sample acts from this sample on, so it jumps at the slide of the sample before.
    """
    before = np.flatnonzero(np.diff(np.sign(force)))
    places = np.insert(np.arange(slide.size), before + 1, before)
    forces = np.insert(np.arange(slide.size), before + 1, before + 1)
    return slide[places], force[forces]


def _measured_loop(result: Result) -> dict[str, Variable]:
    """Return slide and force of the file that prescribes the slide of a bench, if the file contains forces."""
    source = result.plan.model.source
    slide = tomllib.loads(source.resolved).get("slide", {})
    if result.plan.kind != "bench" or slide.get("kind") != "file":
        return {}
    try:
        loop = loops.read_loop(source.path.parent / slide["file"])
    except PatchfemError:  # a file of slides alone
        return {}
    if loop.time is None:
        return {}
    load = 1.0
    if loop.quantity != "force":
        load = np.interp(loop.time, result.response.time, result.response.load)
    dims = ("measured_sample",)
    return {
        "measured_slide": Variable(dims, loop.displacement, "m", "measured slide"),
        "measured_force": Variable(dims, loop.reading * load, "N", "measured friction force"),
    }


def _patch(result: Result) -> dict[str, Variable]:
    """Return the fields along the interface of a solved patch; the states of wear have frames of their own."""
    patch = result.patch
    surface = patch_surface(patch, result.fields)
    if surface is None:
        return {}
    fields = {k: v for k, v in result.fields.items() if not k.startswith(HOLDER_PREFIX)}
    data = {}
    if "wear" in result.extra:
        shown = result.extra["wear_shown"]
        data |= _wear_states(fields, shown["states"], shown["period"])
        fields = {name: values[shown["states"] :] for name, values in fields.items()}
        fields["time"] = fields["time"] - fields["time"][0]
    data |= _frames(fields, surface)
    gap = np.asarray(surface.unloaded_gap)
    data["unloaded_gap"] = _variable("unloaded_gap", ("strip", "x")[-gap.ndim :], gap)
    if patch.strips is not None:
        data["strip_offset"] = _variable("strip_offset", ("strip",), patch.strips.offsets)
        data["strip_normal_stress"] = _variable(
            "strip_normal_stress", ("strip", "x"), patch.strips.pressure
        )
    return data


def _frames(fields: dict, surface) -> dict[str, Variable]:
    """Return the fields along x in all frames."""
    data = {
        "x": _variable("x", ("x",), surface.x),
        "weight": _variable("weight", ("x",), surface.weight),
        "frame_time": _variable("frame_time", ("frame",), fields["time"]),
    }
    for name, values in fields.items():
        if np.ndim(values) >= 2:
            dims = ("frame", "x") if np.ndim(values) == 2 else ("frame", "strip", "x")
            data[name] = _variable(name, dims, values)
    return data


def _wear_states(fields: dict, count: int, period: float) -> dict[str, Variable]:
    """Return pressure and worn depth of all states of wear, the last one included."""
    cycles = fields["time"][: count + 1] / period
    data = {"wear_frame": Variable(("wear_frame",), cycles, "1", "cycles")}
    for name in ("normal_stress", "worn_depth"):
        values = fields[name][: count + 1]
        dims = ("wear_frame", "x") if values.ndim == 2 else ("wear_frame", "strip", "x")
        unit, text = VARIABLES[name]
        data[f"wear_{name}"] = Variable(
            dims, values, unit, f"{text}, after the cycles of wear_frame"
        )
    return data


def _face(face) -> dict[str, Variable]:
    """Return the fields of the patch of one interface; their names end in the number of the interface, from 1."""
    number = face.number + 1
    frame = "frame" if face.fields["time"].size > 1 else "frame_at_rest"
    renamed = {"x": f"x_{number}", "frame": frame}
    data = {}
    for name, variable in _frames(face.fields, face.surface).items():
        dims = tuple(renamed.get(dimension, dimension) for dimension in variable.dims)
        new_name = {"frame_time": f"{frame}_time"}.get(name, f"{name}_{number}")
        data[new_name] = Variable(
            dims, variable.values, variable.unit, variable.text, variable.meanings
        )
    return data


def _levels(result: Result) -> dict[str, Variable]:
    """Return the results at the end of each level of the drive."""
    levels = result.extra["levels"]
    dims = ("level",)
    unit = levels[0].unit
    drive_text = "force" if unit == "N" else "acceleration of the base"
    stuck = np.array([level.stuck for level in levels], np.int8)
    data = {
        "level_drive": Variable(
            dims, np.array([level.drive for level in levels]), unit, drive_text
        ),
        "level_stuck": Variable(dims, stuck, "", "state of the interface", ("slips", "sticks")),
    }
    if any(level.outcome for level in levels):
        outcomes = np.array([str(level.outcome) for level in levels])
        data["level_outcome"] = Variable(dims, outcomes, "", "outcome of the level")
    for name in LEVEL_MEASURES:
        if any(name in level.values for level in levels):
            for suffix, sources in (("", "values"), ("_error", "errors")):
                column = [getattr(level, sources).get(name, np.nan) for level in levels]
                text = TABLE[name].text if not suffix else f"error of level_{name}"
                data[f"level_{name}{suffix}"] = Variable(
                    dims, np.array(column), TABLE[name].unit, text
                )
    return data


def _events(result: Result) -> dict[str, Variable]:
    """Return the list of events: stops, releases, reversals of the slip, changes of the drive."""
    events = result.extra["events"]
    dims = ("event",)
    texts = {
        "time": f"time of the event; {events.source}; {events.count} events in all",
        "interface": "number of the interface or strip from 1; 0 for a change of the drive",
        "kind": "kind of event; `up` means towards positive slip",
        "slide": "relative displacement at the event",
    }
    return {
        "event_time": Variable(dims, np.asarray(events.time, float), "s", texts["time"]),
        "event_interface": Variable(
            dims, np.asarray(events.interface, np.int32), "1", texts["interface"]
        ),
        "event_kind": Variable(
            dims, np.asarray(events.kind, np.int8), "", texts["kind"], tuple(EVENT_KIND_NAMES)
        ),
        "event_slide": Variable(dims, np.asarray(events.slide, float), "m", texts["slide"]),
    }


CURVE_COLUMNS = {
    "frequency": ("Hz", "drive frequency"),
    "level": ("m s-2", "drive: acceleration of the base, or force divided by the modal mass"),
    "amplitude": ("m", "half the peak-to-peak motion at the output"),
    "acceleration_peak": ("m s-2", "largest absolute acceleration"),
    "acceleration_fundamental": ("m s-2", "first harmonic of the absolute acceleration"),
    "acceleration_distortion": ("1", "third over first harmonic of the absolute acceleration"),
    "multiplier": ("1", "largest Floquet multiplier"),
}


def _curve(result: Result) -> dict[str, Variable]:
    """Return a curve of steady motions with its regimes and folds."""
    curve = result.extra["curve"]
    dims = ("curve_point",)
    data = {}
    for name, (unit, text) in CURVE_COLUMNS.items():
        for suffix in ("", "_error"):
            if name + suffix in curve:
                about = text if not suffix else f"estimated error of curve_{name}"
                values = np.asarray(curve[name + suffix], float)
                data[f"curve_{name}{suffix}"] = Variable(dims, values, unit, about)
    names, codes = np.unique(np.asarray(curve["regime"], str), return_inverse=True)
    text = "regime of the steady motion"
    data["curve_regime"] = Variable(dims, codes.astype(np.int8), "", text, tuple(names.tolist()))
    if len(curve.get("folds", ())):
        is_over_frequency = np.ptp(curve["frequency"]) > 0
        unit = "Hz" if is_over_frequency else "m s-2"
        folds = np.asarray(curve["folds"], float)
        data["curve_fold"] = Variable(("fold",), folds, unit, "where the curve turns back")
    return data


def _decay(result: Result) -> dict[str, Variable]:
    """Return frequency and damping ratio of a decay against its amplitude."""
    decay = result.extra["decay"]
    dims = ("decay_time",)
    columns = {
        "decay_time": ("s", "time at the middle of the evaluated cycle", decay.time),
        "decay_amplitude": ("m", "half the peak-to-peak motion of the output", decay.amplitude),
        "decay_frequency": ("Hz", "frequency of the decay", decay.frequency),
        "decay_frequency_error": ("Hz", "half-width of the interval", decay.frequency_error),
        "decay_damping": ("1", "damping ratio of the decay", decay.damping),
        "decay_damping_error": ("1", "half-width of the interval", decay.damping_error),
    }
    return {
        name: Variable(dims, np.asarray(v), unit, text) for name, (unit, text, v) in columns.items()
    }


def _spectra(result: Result) -> dict[str, Variable]:
    """Return the spectra of a random response, and the frequency at which H1 has its peak."""
    spectra = result.extra["spectra"]
    dims = ("frequency",)
    density = "one-sided spectral density of the"
    columns = {
        "frequency": ("Hz", "frequency", spectra.frequency),
        "base_acceleration_spectrum": ("m2 s-3", f"{density} base acceleration", spectra.drive),
        "relative_displacement_spectrum": ("m2 Hz-1", f"{density} output", spectra.displacement),
        "absolute_acceleration_spectrum": (
            "m2 s-3",
            f"{density} acceleration at the output",
            spectra.acceleration,
        ),
        "gain": (
            "s2",
            "magnitude of H1, displacement over base acceleration",
            np.abs(spectra.gain),
        ),
        "phase": ("rad", "phase of H1", np.angle(spectra.gain)),
        "coherence": ("1", "coherence", spectra.coherence),
    }
    data = {
        name: Variable(dims, np.asarray(v), unit, text) for name, (unit, text, v) in columns.items()
    }
    peak = result.measures.get("response_frequency")
    if peak is not None and peak.value is not None:
        data["gain_peak"] = Variable((), np.array(peak.value), "Hz", "frequency of the peak of H1")
    return data


def _wear(result: Result) -> dict[str, Variable]:
    """Return the measures over the cycles of wear."""
    history = result.extra["wear"]
    dims = ("wear_cycle",)
    data = {
        "wear_cycle": Variable(dims, np.asarray(history["cycle"]), "1", "cycles of wear so far")
    }
    for name, values in history.items():
        if name in result.measures:
            measure = result.measures[name]
            data[f"wear_{name}"] = Variable(dims, np.asarray(values), measure.unit, measure.text)
    if "pressure_peak_at_edge" in history:
        text = (
            "excess of a pressure peak at the edge of the contact over all pressures inside; else 0"
        )
        values = np.asarray(history["pressure_peak_at_edge"])
        data["wear_pressure_peak_at_edge"] = Variable(dims, values, "Pa", text)
    return data


# parts of a run by their key in `Result.extra`
PARTS = {
    "levels": _levels,
    "events": _events,
    "curve": _curve,
    "decay": _decay,
    "spectra": _spectra,
    "wear": _wear,
}


def _measured_readings(result: Result) -> dict[str, Variable]:
    """Return the measured readings at the drive frequency, and what the sensors would indicate in the computed motion."""
    readings = find_readings(result)
    if readings is None:
        return {}
    rows, computed = readings
    dims = ("measured_row",)
    data = {
        "measured_input": Variable(dims, np.array([row.input for row in rows]), "m s-2", "input")
    }
    level = drive_sizes.find_max_acceleration(result.plan.model.rig.drive.signal)
    text = "largest acceleration of the drive"
    data["computed_input"] = Variable(("computed",), np.array([float(level)]), "m s-2", text)
    for name, unit in (("acceleration", "m s-2"), ("displacement", "m")):
        values = [np.nan if getattr(row, name) is None else getattr(row, name) for row in rows]
        data[f"measured_{name}"] = Variable(dims, np.array(values), unit, f"measured {name}")
        if name in computed:
            value, error = computed[name]
            text = f"{name} that the sensor would indicate"
            data[f"computed_{name}"] = Variable(("computed",), np.array([value]), unit, text)
            if error is not None:
                error_text = f"error of computed_{name}"
                data[f"computed_{name}_error"] = Variable(
                    ("computed",), np.array([error]), unit, error_text
                )
    return data


def find_readings(result: Result) -> tuple[list, dict] | None:
    """Return the measured rows at the drive frequency, and the computed readings of the sensors.

    Returns
    -------
    tuple or None
        Rows of the table of the scene, and {"acceleration" or "displacement": (reading, error or None)} [SI]. None if the
        scene names no table, if the drive has no frequency, or if no row is measured at it.
    """
    model = result.plan.model
    if model.measured is None or model.rig is None or model.rig.drive.frequency is None:
        return None
    path, gains, kind, cutoff = model.measured
    rows = [
        row
        for row in measured.read_table(path)
        if abs(row.frequency - model.rig.drive.frequency) <= SAME_FREQUENCY
    ]
    if not rows:
        return None

    factors = {"acceleration": gains[0], "displacement": gains[1]}
    names = {
        "acceleration": "absolute_acceleration_peak",
        "displacement": "relative_displacement_amplitude",
    }
    peak = result.measures.get(names["acceleration"])
    signal = model.rig.drive.signal
    if kind != "peak" and isinstance(signal, SineDrive) and peak is not None and peak.value:
        reading = spectrum.read_instrument(result.window, signal, peak.value, kind, cutoff)
        factors["acceleration"] *= reading / peak.value
    computed = {}
    for name, measure_name in names.items():
        measure = result.measures.get(measure_name)
        if measure is not None and measure.value is not None:
            error = None if measure.error is None else measure.error * factors[name]
            computed[name] = measure.value * factors[name], error
    return rows, computed


def _accuracy(result: Result) -> dict[str, Variable]:
    """Return the error of the run and of its coarser runs over their CPU time, if the time steps limit the accuracy."""
    curve = compute_accuracy_curve(result)
    if curve is None:
        return {}
    settings = [*curve.coarser[::-1], curve.present]
    dims = ("accuracy_run",)
    columns = {
        "accuracy_steps": ("1", "steps per cycle", [one.steps for one in settings]),
        "accuracy_seconds": ("s", "CPU time of the motion", [one.seconds for one in settings]),
        "accuracy_error": (
            "1",
            "largest error of the main measures, as the tolerance that it meets",
            [one.error for one in settings],
        ),
    }
    return {
        name: Variable(dims, np.array(v), unit, text) for name, (unit, text, v) in columns.items()
    }
