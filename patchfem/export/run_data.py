"""Arrays of a run as variables with dimensions, units and descriptions: the content of result.nc.

In: a `Result` of `runs`. Out: {name: Variable}. A row of VARIABLES says where a Result has an array; a new variable is a
new row. What has to be computed or selected first has a function of its own.
"""

import tomllib
from typing import NamedTuple

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

# a measured row belongs to a run if its frequency differs by no more than this [Hz]
SAME_FREQUENCY = 0.5
MEANINGS = {"status": ("open", "stick", "slip"), "event_kind": tuple(EVENT_KIND_NAMES)}
FRICTIONLESS = ("slide", "slide_velocity", "friction_force")  # histories that a linear run has not


class Row(NamedTuple):
    """Variable of a run.

    dims: its dimensions; the last ones of them for an array with fewer. unit: SI unit, "" for codes and names. text:
    description. places: where a Result has it, as dotted names of attributes, keys and indices; the first that exists.
    """

    dims: str
    unit: str
    text: str
    places: str


VARIABLES = {
    "time": Row("time", "s", "time", "response.time"),
    "relative_displacement": Row(
        "time",
        "m",
        "displacement of the output relative to the base",
        "response.output response.slide",
    ),
    "relative_velocity": Row(
        "time",
        "m s-1",
        "velocity of the output relative to the base",
        "response.output_rate response.rate",
    ),
    "absolute_acceleration": Row(
        "time", "m s-2", "acceleration at the output, base motion included", "response.acceleration"
    ),
    "base_acceleration": Row(
        "time", "m s-2", "acceleration of the base", "response.base_acceleration"
    ),
    "interface": Row(
        "interface",
        "",
        "the two masses of the interface; 0 is the base",
        "plan.model.rig.friction.names",
    ),
    "slide": Row(
        "interface time",
        "m",
        "relative displacement of the two surfaces of the interface",
        "response.extra.slides.T response.slide",
    ),
    "slide_velocity": Row(
        "interface time",
        "m s-1",
        "relative velocity of the two surfaces",
        "response.extra.slide_rates.T",
    ),
    "friction_force": Row(
        "interface time",
        "N",
        "resultant friction force, positive when it opposes positive slip",
        "response.extra.forces.T response.force",
    ),
    "yaw_moment": Row(
        "time",
        "N m",
        "moment about +z of the friction on the upper piece, sum of y f_x - x f_y",
        "response.yaw_moment",
    ),
    "friction_work": Row(
        "time",
        "J",
        "work done against friction since the start",
        "response.ledger.0 response.extra.ledger.0",
    ),
    "energy_stored": Row(
        "time", "J", "elastic energy of the interface", "response.ledger.1 response.extra.ledger.1"
    ),
    "energy_dissipated": Row(
        "time",
        "J",
        "energy dissipated by friction since the start",
        "response.ledger.2 response.extra.ledger.2",
    ),
    "energy_created": Row(
        "time",
        "J",
        "energy created since the start by a friction law that is not passive",
        "response.ledger.3 response.extra.ledger.3",
    ),
    "mode": Row("mode", "", "mode or coordinate of the structure", "plan.model.rig.modes.names"),
    "period": Row("", "s", "period of the drive", "extra.period"),
    "strip_offset": Row(
        "strip", "m", "position of the strip across the width", "patch.strips.offsets"
    ),
    "strip_normal_stress": Row(
        "strip x",
        "Pa",
        "normal stress of each strip, compression positive",
        "patch.strips.pressure",
    ),
    "event_time": Row("event", "s", "time of the event", "extra.events.time"),
    "event_interface": Row(
        "event",
        "1",
        "number of the interface or strip from 1; 0 for a change of the drive",
        "extra.events.interface",
    ),
    "event_kind": Row(
        "event", "", "kind of event; `up` means towards positive slip", "extra.events.kind"
    ),
    "event_slide": Row("event", "m", "relative displacement at the event", "extra.events.slide"),
    "curve_frequency": Row("curve_point", "Hz", "drive frequency", "extra.curve.frequency"),
    "curve_level": Row(
        "curve_point",
        "m s-2",
        "drive: acceleration of the base, or force divided by the modal mass",
        "extra.curve.level",
    ),
    "curve_amplitude": Row(
        "curve_point", "m", "half the peak-to-peak motion at the output", "extra.curve.amplitude"
    ),
    "curve_amplitude_error": Row(
        "curve_point", "m", "error of curve_amplitude", "extra.curve.amplitude_error"
    ),
    "curve_acceleration_peak": Row(
        "curve_point", "m s-2", "largest absolute acceleration", "extra.curve.acceleration_peak"
    ),
    "curve_acceleration_peak_error": Row(
        "curve_point",
        "m s-2",
        "error of curve_acceleration_peak",
        "extra.curve.acceleration_peak_error",
    ),
    "curve_acceleration_fundamental": Row(
        "curve_point",
        "m s-2",
        "first harmonic of the absolute acceleration",
        "extra.curve.acceleration_fundamental",
    ),
    "curve_acceleration_fundamental_error": Row(
        "curve_point",
        "m s-2",
        "error of curve_acceleration_fundamental",
        "extra.curve.acceleration_fundamental_error",
    ),
    "curve_acceleration_distortion": Row(
        "curve_point",
        "1",
        "third over first harmonic of the absolute acceleration",
        "extra.curve.acceleration_distortion",
    ),
    "curve_acceleration_distortion_error": Row(
        "curve_point",
        "1",
        "error of curve_acceleration_distortion",
        "extra.curve.acceleration_distortion_error",
    ),
    "curve_multiplier": Row(
        "curve_point", "1", "largest Floquet multiplier", "extra.curve.multiplier"
    ),
    "decay_time": Row(
        "decay_time", "s", "time at the middle of the evaluated cycle", "extra.decay.time"
    ),
    "decay_amplitude": Row(
        "decay_time", "m", "half the peak-to-peak motion of the output", "extra.decay.amplitude"
    ),
    "decay_frequency": Row("decay_time", "Hz", "frequency of the decay", "extra.decay.frequency"),
    "decay_frequency_error": Row(
        "decay_time", "Hz", "half-width of the interval", "extra.decay.frequency_error"
    ),
    "decay_damping": Row("decay_time", "1", "damping ratio of the decay", "extra.decay.damping"),
    "decay_damping_error": Row(
        "decay_time", "1", "half-width of the interval", "extra.decay.damping_error"
    ),
    "frequency": Row("frequency", "Hz", "frequency", "extra.spectra.frequency"),
    "base_acceleration_spectrum": Row(
        "frequency",
        "m2 s-3",
        "one-sided spectral density of the base acceleration",
        "extra.spectra.drive",
    ),
    "relative_displacement_spectrum": Row(
        "frequency",
        "m2 Hz-1",
        "one-sided spectral density of the output",
        "extra.spectra.displacement",
    ),
    "absolute_acceleration_spectrum": Row(
        "frequency",
        "m2 s-3",
        "one-sided spectral density of the acceleration at the output",
        "extra.spectra.acceleration",
    ),
    "coherence": Row("frequency", "1", "coherence of drive and output", "extra.spectra.coherence"),
    "gain_peak": Row("", "Hz", "frequency of the peak of H1", "measures.response_frequency.value"),
    "wear_cycle": Row("wear_cycle", "1", "cycles of wear so far", "extra.wear.cycle"),
    "wear_pressure_peak_at_edge": Row(
        "wear_cycle",
        "Pa",
        "excess of a pressure peak at the edge of the contact over all pressures inside; else 0",
        "extra.wear.pressure_peak_at_edge",
    ),
}
# fields along the interface, by their names in `Result.fields`
FIELDS = {
    "normal_stress": ("Pa", "normal stress at the nodes, compression positive"),
    "shear_stress": ("Pa", "frictional shear stress, positive when it opposes positive slip"),
    "gap": ("m", "gap that remains between the loaded surfaces"),
    "slip": ("m", "irreversible local slip"),
    "status": ("", "contact status; FILES.md defines slip"),
    "worn_depth": ("m", "worn depth, sum of both pieces"),
}


def collect_data(result: Result) -> dict[str, Variable]:
    """Return all arrays of a run, in SI units."""
    data = {}
    for name, row in VARIABLES.items():
        found = (_look_up(result, place) for place in row.places.split())
        values = next((one for one in found if one is not None), None)
        if values is not None and np.size(values):
            data[name] = _make_variable(name, row, values)
    if result.plan.kind == "linear":
        data = {name: one for name, one in data.items() if name not in FRICTIONLESS}
    data |= _motion(result) | _loop(result) | _patch(result)
    for face in result.faces:
        data |= _face(face)
    for key, collect in {
        "levels": _levels,
        "curve": _curve,
        "spectra": _response,
        "wear": _wear,
    }.items():
        if key in result.extra:
            data |= collect(result)
    return data | _measured_readings(result) | _accuracy(result)


def _look_up(value, place: str):
    """Return what a dotted place of attributes, keys and indices contains, or None."""
    for name in place.split("."):
        if isinstance(value, dict):
            value = value.get(name)
        elif name.isdigit():
            value = value[int(name)]
        else:
            value = getattr(value, name, None)
        if value is None:
            return None
    return value


def _make_variable(name: str, row: Row, values) -> Variable:
    """Return the variable of a row; codes become small integers, names become strings."""
    if name == "event_kind":
        values = np.asarray(values, np.int8)
    elif row.unit == "":
        values = np.array([str(value) for value in values])
    values = np.asarray(values)
    dims = row.dims.split()
    dims = tuple(dims[len(dims) - values.ndim :])
    return Variable(dims, values, row.unit, row.text, MEANINGS.get(name, ()))


def _motion(result: Result) -> dict[str, Variable]:
    """Return the modal coordinates of a rig, and the normal load over time, which may be constant."""
    response = result.response
    if response is None:
        return {}
    text = "normal load on the interface"
    if result.plan.kind == "bench":
        return {"normal_load": Variable(("time",), np.asarray(response.load), "N", text)}
    rig = result.plan.model.rig
    motions = structure.compute_named_motions(rig.modes, response.modal)
    data = {"modal_coordinate": Variable(("time", "mode"), motions, "m", "modal coordinate")}
    if result.plan.kind != "rig":
        return data
    count = response.time.size
    if rig.friction.names:
        loads = np.array([interface.load for interface in rig.friction.interfaces])
        values = np.repeat(loads[:, None], count, axis=1)
    else:
        constant = np.full(count, result.measures["normal_load"].value)
        values = np.asarray(response.extra.get("normal_load", constant))
    data["normal_load"] = Variable(("interface", "time")[-values.ndim :], values, "N", text)
    return data


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
    surface = patch_surface(result.patch, result.fields)
    if surface is None:
        return {}
    fields = result.fields
    data = {}
    if "wear" in result.extra:
        shown = result.extra["wear_shown"]
        count = shown["states"]
        cycles = fields["time"][: count + 1] / shown["period"]
        data["wear_frame"] = Variable(("wear_frame",), cycles, "1", "cycles")
        for name in ("normal_stress", "worn_depth"):
            data[f"wear_{name}"] = _make_field(name, fields[name][: count + 1], "wear_frame")
        fields = {name: values[count:] for name, values in fields.items()}
        fields["time"] = fields["time"] - fields["time"][0]
    gap = np.asarray(surface.unloaded_gap)
    text = "gap of the unloaded surfaces, wear included"
    data["unloaded_gap"] = Variable(("strip", "x")[-gap.ndim :], gap, "m", text)
    return data | _frames(fields, surface)


def _frames(fields: dict, surface) -> dict[str, Variable]:
    """Return positions and areas of the nodes, and the fields along x in all frames."""
    area = "area of the interface that belongs to a node, summed over all pairs of pieces"
    data = {
        "x": Variable(("x",), np.asarray(surface.x), "m", "position along the sliding direction"),
        "weight": Variable(("x",), np.asarray(surface.weight), "m2", area),
        "frame_time": Variable(("frame",), fields["time"], "s", "time of the frame"),
    }
    return data | {name: _make_field(name, fields[name]) for name in FIELDS if name in fields}


def _make_field(name: str, values, frame: str = "frame") -> Variable:
    """Return a field along x over frames, and over strips if it has three dimensions."""
    unit, text = FIELDS[name]
    dims = (frame, "x") if np.ndim(values) == 2 else (frame, "strip", "x")
    return Variable(dims, np.asarray(values), unit, text, MEANINGS.get(name, ()))


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


def _curve(result: Result) -> dict[str, Variable]:
    """Return the regimes and the folds of a curve of steady motions."""
    curve = result.extra["curve"]
    names, codes = np.unique(np.asarray(curve["regime"], str), return_inverse=True)
    text = "regime of the steady motion"
    meanings = tuple(names.tolist())
    data = {"curve_regime": Variable(("curve_point",), codes.astype(np.int8), "", text, meanings)}
    if len(curve.get("folds", ())):
        unit = "Hz" if np.ptp(curve["frequency"]) > 0 else "m s-2"
        folds = np.asarray(curve["folds"], float)
        data["curve_fold"] = Variable(("fold",), folds, unit, "where the curve turns back")
    return data


def _response(result: Result) -> dict[str, Variable]:
    """Return magnitude and phase of the frequency response H1 of a random drive."""
    gain = np.asarray(result.extra["spectra"].gain)
    text = "of H1, displacement of the output over base acceleration"
    return {
        "gain": Variable(("frequency",), np.abs(gain), "s2", f"magnitude {text}"),
        "phase": Variable(("frequency",), np.angle(gain), "rad", f"phase {text}"),
    }


def _wear(result: Result) -> dict[str, Variable]:
    """Return the measures over the cycles of wear."""
    return {
        f"wear_{name}": Variable(
            ("wear_cycle",),
            np.asarray(values),
            result.measures[name].unit,
            result.measures[name].text,
        )
        for name, values in result.extra["wear"].items()
        if name in result.measures
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
