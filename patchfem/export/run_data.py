"""Arrays of a run as variables with dimensions, units and descriptions: the content of result.nc.

In: a `Result` of `runs`. Out: {name: Variable}. A row of RUN_VARIABLES says where a Result has an array; a new variable is a
new row. What has to be computed or selected first has a function of its own.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .. import inputs, response, structure
from ..core import PatchfemError, SineDrive
from ..model import structure as structure_model
from ..runs.findings import compute_accuracy_curve
from ..runs.patch import area_motion
from ..runs.results.result import Result, patch_surface
from .answer import Quantities, Quantity, Variable, Variables, encode_texts, make_columns

# Largest difference of the drive frequencies of a run and of a measured row that belongs to it
MAX_FREQUENCY_DIFFERENCE_HZ = 0.5
STATUS_NAMES = ("open", "stick", "slip")  # meanings of the codes of the status of a node
STICK_STATE_TEXT = "state of the interface"
# Quantities that the sensors of a rig measure, and their SI units
SENSOR_UNITS = {"acceleration": "m s-2", "displacement": "m"}
# Histories of the friction interface, which a linear run has not
FRICTION_HISTORIES = ("slide", "slide_velocity", "friction_force")


class Row(NamedTuple):
    """Variable of a run.

    - dims: its dimensions. An array with fewer dimensions has the last ones of them.
    - unit: SI unit, or "" for codes and names.
    - text: description.
    - places: where a Result has the variable, as dotted names of attributes, keys and indices. The first that exists is
      used.
    """

    dims: str
    unit: str
    text: str
    places: str


RUN_VARIABLES = {
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
        "response.extra.yaw_moment",
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
    "period": Row("", "s", "period of the drive", "motion.period"),
    "event_time": Row("event", "s", "time of the event", "motion.events.time"),
    "event_interface": Row(
        "event",
        "1",
        "number of the interface or band from 1; 0 for a change of the drive",
        "motion.events.interface",
    ),
    "event_kind": Row(
        "event", "", "kind of event; `up` means towards positive slip", "motion.events.kind"
    ),
    "event_slide": Row("event", "m", "relative displacement at the event", "motion.events.slide"),
    "curve_frequency": Row("curve_point", "Hz", "drive frequency", "motion.steady.curve.frequency"),
    "curve_level": Row(
        "curve_point",
        "m s-2",
        "drive: acceleration of the base, or force divided by the modal mass",
        "motion.steady.curve.level",
    ),
    "curve_amplitude": Row(
        "curve_point",
        "m",
        "half the peak-to-peak motion at the output",
        "motion.steady.curve.amplitude",
    ),
    "curve_acceleration_peak": Row(
        "curve_point",
        "m s-2",
        "largest absolute acceleration",
        "motion.steady.curve.acceleration_peak",
    ),
    "curve_acceleration_fundamental": Row(
        "curve_point",
        "m s-2",
        "first harmonic of the absolute acceleration",
        "motion.steady.curve.acceleration_fundamental",
    ),
    "curve_acceleration_distortion": Row(
        "curve_point",
        "1",
        "third over first harmonic of the absolute acceleration",
        "motion.steady.curve.acceleration_distortion",
    ),
    "curve_multiplier": Row(
        "curve_point",
        "1",
        "largest Floquet multiplier; missing under laws of many elements",
        "motion.steady.curve.multiplier",
    ),
    "decay_time": Row(
        "decay_time", "s", "time at the middle of the evaluated cycle", "motion.decay.time"
    ),
    "decay_amplitude": Row(
        "decay_time", "m", "half the peak-to-peak motion of the output", "motion.decay.amplitude"
    ),
    "decay_frequency": Row("decay_time", "Hz", "frequency of the decay", "motion.decay.frequency"),
    "decay_damping": Row("decay_time", "1", "damping ratio of the decay", "motion.decay.damping"),
    "frequency": Row("frequency", "Hz", "frequency", "motion.spectra.frequency"),
    "base_acceleration_spectrum": Row(
        "frequency",
        "m2 s-3",
        "one-sided spectral density of the base acceleration",
        "motion.spectra.drive",
    ),
    "relative_displacement_spectrum": Row(
        "frequency",
        "m2 Hz-1",
        "one-sided spectral density of the output",
        "motion.spectra.displacement",
    ),
    "absolute_acceleration_spectrum": Row(
        "frequency",
        "m2 s-3",
        "one-sided spectral density of the acceleration at the output",
        "motion.spectra.acceleration",
    ),
    "coherence": Row("frequency", "1", "coherence of drive and output", "motion.spectra.coherence"),
    "gain_peak": Row("", "Hz", "frequency of the peak of H1", "measures.response_frequency.value"),
    "wear_cycle": Row("wear_cycle", "1", "cycles of wear so far", "wear.columns.cycle"),
}
# fields along the interface, by their names in `Result.fields`
INTERFACE_FIELDS = {
    "normal_stress": ("Pa", "normal stress at the nodes, compression positive"),
    "shear_stress": ("Pa", "frictional shear stress, positive when it opposes positive slip"),
    "gap": ("m", "gap that remains between the loaded surfaces"),
    "slip": ("m", "irreversible local slip"),
    "status": ("", "contact status; FILES.md defines slip"),
    "worn_depth": ("m", "worn depth, sum of both pieces"),
}


def collect_data(result: Result) -> Variables:
    """Return all arrays of a run, in SI units."""
    data = {}
    for name, row in RUN_VARIABLES.items():
        places = " ".join(f"{place}_error" for place in row.places.split())
        error = Row(row.dims, row.unit, f"error of {name}", places)
        data |= _read_row(result, name, row) | _read_row(result, f"{name}_error", error)
    if result.plan.kind == "linear":
        data = {name: one for name, one in data.items() if name not in FRICTION_HISTORIES}
    data |= _collect_motion(result) | _collect_loop(result) | _collect_patch(result)
    for face in result.faces:
        data |= _collect_face(face)
    data |= _collect_levels(result) | _collect_regimes(result)
    data |= _collect_frequency_response(result) | _collect_wear(result)
    return data | _collect_readings(result) | _collect_accuracy(result)


def _read_row(result: Result, name: str, row: Row) -> Variables:
    """Return the variable of a row by its name, with values from a run, or {} if the run has no such values.

    Codes become small integers, and names become strings. `row` has the places of the values in the run, with dimensions
    and unit.
    """
    found = (_look_up(result, place) for place in row.places.split())
    values = next((one for one in found if one is not None), None)
    if values is None or not np.size(values):
        return {}
    meanings = _list_code_meanings(name)
    if meanings:
        values = np.asarray(values, np.int8)
    elif row.unit == "":
        values = np.array([str(value) for value in values])
    variables = make_columns(row.dims, {name: (values, row.unit, row.text)})
    return {name: replace(variables[name], meanings=meanings)}


def _look_up(value, place: str):
    """Return the content of a place below an object, such as "window.extra.ledger.0", or None if it does not exist.

    The parts of the place are names of attributes, keys of dicts and indices.
    """
    for name in place.split("."):
        if isinstance(value, dict):
            value = value.get(name)
        else:
            value = value[int(name)] if name.isdigit() else getattr(value, name, None)
        if value is None:
            return None
    return value


def _collect_motion(result: Result) -> Variables:
    """Return the modal coordinates (time, mode) [m] of a rig and the normal load [N], which may be constant, by name.

    A result without a motion has neither.
    """
    response = result.response
    if response is None:
        return {}
    data = {}
    if result.plan.kind == "bench":
        loads = response.load
    else:
        # the coordinates of a rig of masses are the motions of its masses
        rig = result.plan.model.rig
        motions = structure_model.compute_named_motions(rig.modes, response.modal)
        columns = {"modal_coordinate": (motions, "m", "modal coordinate")}
        data = make_columns("time mode", columns)
        if result.plan.kind != "rig":
            return data

        count = response.time.size
        if rig.friction.names:
            loads = np.repeat([[one.load] for one in rig.friction.interfaces], count, axis=1)
        else:
            constant = np.full(count, result.measures["normal_load"].value)
            loads = response.extra.get("normal_load", constant)

    columns = {"normal_load": (loads, "N", "normal load on the interface")}
    return data | make_columns("interface time", columns)


def _collect_loop(result: Result) -> Variables:
    """Return the friction loop of the last cycle as variables: slide [m] and friction force [N].

    A rig of masses has a loop for each interface. A bench whose slide is a measured loop also has that loop.
    """
    window = result.window
    if window is None or not np.any(window.force) or np.ptp(window.slide) == 0:
        return {}
    slide = window.slide
    force = window.force
    if result.plan.model.rig is not None and window.slides.shape[1] > 1:
        slide = window.slides.T
        force = window.forces.T

    # the window may have several cycles
    period = result.motion.period
    if period and result.plan.kind != "bench":
        keep = window.time >= window.time[-1] - period * (1 + 1e-9)
        slide = slide[..., keep]
        force = force[..., keep]

    if result.plan.model.sticks_rigidly and slide.ndim == 1:
        # the force of a sample acts from this sample on, so it jumps at the slide of the sample before
        before = np.flatnonzero(np.diff(np.sign(force)))
        slide = np.insert(slide, before + 1, slide[before])
        force = np.insert(force, before + 1, force[before + 1])
    columns = {
        "loop_slide": (slide, "m", "slide of the interface in the last cycle"),
        "loop_friction_force": (force, "N", "friction force in the last cycle"),
    }
    return make_columns("interface loop_point", columns) | _collect_measured_loop(result)


def _collect_measured_loop(result: Result) -> Variables:
    """Return slide and force of the file that prescribes the slide of a bench, if the file contains forces."""
    source = result.plan.model.source
    slide = tomllib.loads(source.resolved).get("slide", {})
    if result.plan.kind != "bench" or slide.get("kind") != "file":
        return {}
    try:
        loop = inputs.loops.read_loop(source.path.parent / slide["file"])
    except PatchfemError:  # a file of slides alone
        return {}
    if loop.time is None:
        return {}
    load = 1.0
    if loop.quantity != "force":
        load = np.interp(loop.time, result.response.time, result.response.load)
    columns = {
        "measured_slide": (loop.displacement, "m", "measured slide"),
        "measured_force": (loop.reading * load, "N", "measured friction force"),
    }
    return make_columns("measured_sample", columns)


def _collect_patch(result: Result) -> Variables:
    """Return pressure, gap, shear stress and slip along the interface of a patch as variables.

    The states of wear have frames of their own.
    """
    surface = patch_surface(result.patch, result.fields)
    if surface is None:
        return {}
    fields = result.fields
    data = {}
    if result.wear is not None:
        count = result.wear.n_frames
        cycles = fields["time"][: count + 1] / result.wear.period
        data = make_columns("wear_frame", {"wear_frame": (cycles, "1", "cycles")})
        for name in ("normal_stress", "worn_depth"):
            data[f"wear_{name}"] = _make_field(name, fields[name][: count + 1], "wear_frame")
        fields = {name: values[count:] for name, values in fields.items()}
        fields["time"] = fields["time"] - fields["time"][0]
    text = "gap of the unloaded surfaces, wear included"
    data |= make_columns("x", {"unloaded_gap": (surface.unloaded_gap, "m", text)})
    data |= _collect_frames(fields, surface)
    if result.patch.model.area is None:
        return data
    return _spread_over_face(data | _collect_reversal(result), result.patch)


def _collect_reversal(result: Result) -> Variables:
    """Return the state of the cells of a face at the last reversal and their slip per cycle; {} without partial slip."""
    reversal = area_motion.find_face_reversal(result, result.patch)
    if reversal is None:
        return {}
    text = "contact status at the last reversal of the slide"
    status = Variable(("x",), reversal.status, "", text, STATUS_NAMES)
    slip_text = "path of the slip of each cell in a cycle"
    slip = Variable(("x",), reversal.slip_per_cycle, "m", slip_text)
    return {"reversal_status": status, "slip_per_cycle": slip}


def _spread_over_face(data: Variables, patch) -> Variables:
    """Return variables over the cells of a face with the dimensions y and x in place of x alone.

    `patch` is the AreaPatch of the face.
    """
    spread = {}
    for name, variable in data.items():
        if variable.dims[-1:] == ("x",):
            values = variable.values.reshape(*variable.values.shape[:-1], *patch.shape)
            variable = replace(variable, dims=(*variable.dims[:-1], "y", "x"), values=values)
        spread[name] = variable
    normal = patch.pieces.normal
    x_text = "position of the middle of the cells along the sliding direction"
    y_text = "position of the middle of the cells across the sliding direction"
    return (
        spread
        | make_columns("x", {"x": (normal.x, "m", x_text)})
        | make_columns("y", {"y": (normal.y, "m", y_text)})
    )


def _collect_frames(fields: dict[str, np.ndarray], surface, frame: str = "frame") -> Variables:
    """Return positions and areas of the nodes, and the fields along x in all frames.

    `fields` are those of all frames by name, `surface` has the nodes of the interface, and `frame` is the name of the
    dimension of the frames.
    """
    area = "area of the interface that belongs to a node, summed over all pairs of pieces"
    nodes = {
        "x": (surface.x, "m", "position along the sliding direction"),
        "weight": (surface.weight, "m2", area),
    }
    data = make_columns("x", nodes)
    data |= make_columns(frame, {f"{frame}_time": (fields["time"], "s", "time of the frame")})
    for name in INTERFACE_FIELDS:
        if name in fields:
            data[name] = _make_field(name, fields[name], frame)
    return data


def _list_code_meanings(name: str) -> tuple[str, ...]:
    """Return the meaning of each code of a variable of codes; () for other variables."""
    if name == "status":
        return STATUS_NAMES
    return response.events.EVENT_KIND_NAMES if name == "event_kind" else ()


def _make_field(name: str, values, frame: str) -> Variable:
    """Return a field along x over frames.

    The `values` are in SI units. `name` is a key of `INTERFACE_FIELDS`, and `frame` the name of the dimension of the
    frames.
    """
    unit, text = INTERFACE_FIELDS[name]
    return Variable((frame, "x"), np.asarray(values), unit, text, _list_code_meanings(name))


def _collect_face(face) -> Variables:
    """Return the fields of the patch of one interface; their names end in the number of the interface, from 1."""
    number = face.number + 1
    frame = "frame" if face.fields["time"].size > 1 else "frame_at_rest"
    data = {}
    own = _collect_frames(face.fields, face.surface, frame)
    if face.patch.model.area is not None:
        own = _spread_over_face(own, face.patch)
    for name, variable in own.items():
        dims = tuple(f"{one}_{number}" if one in ("x", "y") else one for one in variable.dims)
        shown = name if name == f"{frame}_time" else f"{name}_{number}"
        data[shown] = replace(variable, dims=dims)
    return data


def _collect_levels(result: Result) -> Variables:
    """Return the measures at the end of each level of a drive whose amplitude changes in steps, as variables."""
    levels = result.motion.levels
    if not levels:
        return {}
    unit = levels[0].unit
    drive_text = "force" if unit == "N" else "acceleration of the base"
    columns = {
        "level_drive": ([level.drive for level in levels], unit, drive_text),
        "level_stuck": (np.array([level.stuck for level in levels], np.int8), "", STICK_STATE_TEXT),
    }
    table = response.rows.MOTION_TABLE
    for name in response.events.LEVEL_MEASURES:
        if any(name in level.values for level in levels):
            unit = table[name].unit
            values = [level.values.get(name, np.nan) for level in levels]
            errors = [level.errors.get(name, np.nan) for level in levels]
            columns[f"level_{name}"] = (values, unit, table[name].text)
            columns[f"level_{name}_error"] = (errors, unit, f"error of level_{name}")
    data = make_columns("level", columns)
    data["level_stuck"] = replace(data["level_stuck"], meanings=("slips", "sticks"))
    return data


def _collect_regimes(result: Result) -> Variables:
    """Return the regime at each point of a response curve, such as "stick-slip", and where the curve turns back."""
    curve = None if result.motion.steady is None else result.motion.steady.curve
    if curve is None:
        return {}
    regimes = encode_texts("curve_point", curve["regime"], "regime of the steady motion")
    folds = np.asarray(curve.get("folds", ()), float)
    unit = "Hz" if np.ptp(curve["frequency"]) > 0 else "m s-2"
    columns = {"curve_fold": (folds, unit, "where the curve turns back")} if folds.size else {}
    return {"curve_regime": regimes} | make_columns("fold", columns)


def _collect_frequency_response(result: Result) -> Variables:
    """Return magnitude and phase of the frequency response H1 of a random drive."""
    if result.motion.spectra is None:
        return {}
    gain = np.asarray(result.motion.spectra.gain)
    text = "of H1, displacement of the output over base acceleration"
    columns = {
        "gain": (np.abs(gain), "s2", f"magnitude {text}"),
        "phase": (np.angle(gain), "rad", f"phase {text}"),
    }
    return make_columns("frequency", columns)


def _collect_wear(result: Result) -> Variables:
    """Return the measures over the cycles of wear as variables, such as wear_worn_volume."""
    if result.wear is None:
        return {}
    columns = {
        f"wear_{name}": (values, result.measures[name].unit, result.measures[name].text)
        for name, values in result.wear.columns.items()
        if name in result.measures
    }
    return make_columns("wear_cycle", columns)


def _collect_readings(result: Result) -> Variables:
    """Return the measured readings at the drive frequency, and what the sensors would indicate in the computed motion."""
    readings = find_readings(result)
    if readings is None:
        return {}
    rows, computed = readings
    measured_columns = {"measured_input": ([row.input for row in rows], "m s-2", "input")}
    level = structure.drive_sizes.find_max_acceleration(result.plan.model.rig.drive.signal)
    text = "largest acceleration of the drive"
    columns = {"computed_input": ([float(level)], "m s-2", text)}
    for name, unit in SENSOR_UNITS.items():
        values = [getattr(row, name) for row in rows]
        measured_columns[f"measured_{name}"] = (np.array(values, float), unit, f"measured {name}")
        if name in computed:
            one = computed[name]
            text = f"{name} that the sensor would indicate"
            columns[f"computed_{name}"] = ([one.value], unit, text)
            if one.error is not None:
                columns[f"computed_{name}_error"] = ([one.error], unit, f"error of computed_{name}")
    return make_columns("measured_row", measured_columns) | make_columns("computed", columns)


def find_readings(result: Result) -> tuple[list[inputs.measured.MeasuredRow], Quantities] | None:
    """Return the measured rows at the drive frequency, and the computed readings of the sensors.

    Returns
    -------
    tuple or None
        Rows of the table of the scene, and the readings `acceleration` and `displacement`. None if the
        scene names no table, if the drive has no frequency, or if no row is measured at it.
    """
    model = result.plan.model
    if model.measured is None or model.rig is None or model.rig.drive.frequency is None:
        return None
    path, gains, kind, cutoff = model.measured
    frequency = model.rig.drive.frequency
    table = inputs.measured.read_table(path)
    rows = [row for row in table if abs(row.frequency - frequency) <= MAX_FREQUENCY_DIFFERENCE_HZ]
    if not rows:
        return None

    # computed readings are the measures times the gains of the sensors; an instrument that filters or averages reads less
    names = ("absolute_acceleration_peak", "relative_displacement_amplitude")
    measures = dict(zip(SENSOR_UNITS, map(result.measures.get, names), strict=True))
    factors = dict(zip(SENSOR_UNITS, gains))
    peak = measures["acceleration"]
    signal = model.rig.drive.signal
    if kind != "peak" and isinstance(signal, SineDrive) and peak is not None and peak.value:
        reading = response.spectrum.read_instrument(result.window, signal, peak.value, kind, cutoff)
        factors["acceleration"] *= reading / peak.value

    computed = {}
    for name, measure in measures.items():
        if measure is not None and measure.value is not None:
            error = None if measure.error is None else measure.error * factors[name]
            computed[name] = Quantity(measure.value * factors[name], SENSOR_UNITS[name], error)
    return rows, computed


def _collect_accuracy(result: Result) -> Variables:
    """Return the error of the run and of its coarser runs over their CPU time, if the time steps limit the accuracy."""
    runs = compute_accuracy_curve(result)
    if not runs:
        return {}
    text = "largest error of the main measures, as the tolerance that it meets"
    columns = {
        "accuracy_steps": ([run.steps for run in runs], "1", "steps per cycle"),
        "accuracy_seconds": ([run.seconds for run in runs], "s", "CPU time of the motion"),
        "accuracy_error": ([run.error for run in runs], "1", text),
    }
    return make_columns("accuracy_run", columns)
