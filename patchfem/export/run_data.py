"""Arrays of a run as variables with dimensions, units and descriptions: the content of result.nc.

In: a `Result` of `runs`. Out: {name: Variable}. A row of rows.toml says where a Result has an array; a new variable is a
new row. What has to be computed or selected first has a function of its own.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np

from .. import inputs, structure
from .. import measures as run_measures
from ..core import PatchfemError, SineDrive
from ..model import structure as structure_model
from ..runs.findings import compute_accuracy_curve
from ..runs.patch import area_motion
from ..runs.results.result import Result, patch_surface
from .answer import (
    Quantities,
    Quantity,
    Row,
    Variable,
    Variables,
    encode_texts,
    make_column,
    make_columns,
)
from .rows import VARIABLES, look_up, make_variables

# Largest difference of the drive frequencies of a run and of a measured row that belongs to it
MAX_FREQUENCY_DIFFERENCE_HZ = 0.5
RUN_ROWS = VARIABLES["run"]
# Quantities that the sensors of a rig measure, and their SI units
SENSOR_UNITS = {"acceleration": "m s-2", "displacement": "m"}
# Histories of the friction interface, which a linear run has not
FRICTION_HISTORIES = ("slide", "slide_velocity", "friction_force")


def collect_data(result: Result) -> Variables:
    """Return all arrays of a run, in SI units."""
    data = {}
    for name, row in RUN_ROWS.items():
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

    Names become strings. `row` has the places of the values in the run, with dimensions
    and unit.
    """
    found = (look_up(result, place) for place in row.places.split())
    values = next((one for one in found if one is not None), None)
    if values is None or not np.size(values):
        return {}
    if name == "event_kind":
        row = row._replace(meanings=run_measures.events.EVENT_KIND_NAMES)
    if row.unit == "" and not row.meanings:
        values = np.array([str(value) for value in values])
    return {name: make_column(name, values, row)}


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
        data = make_variables("run", modal_coordinate=motions)
        if result.plan.kind != "rig":
            return data

        count = response.time.size
        if rig.friction.names:
            loads = np.repeat([[one.load] for one in rig.friction.interfaces], count, axis=1)
        else:
            constant = np.full(count, result.measures["normal_load"].value)
            loads = response.extra.get("normal_load", constant)

    return data | make_variables("run", normal_load=loads)


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
    period = result.histories.period
    if period and result.plan.kind != "bench":
        keep = window.time >= window.time[-1] - period * (1 + 1e-9)
        slide = slide[..., keep]
        force = force[..., keep]

    if result.plan.model.sticks_rigidly and slide.ndim == 1:
        # the force of a sample acts from this sample on, so it jumps at the slide of the sample before
        before = np.flatnonzero(np.diff(np.sign(force)))
        slide = np.insert(slide, before + 1, slide[before])
        force = np.insert(force, before + 1, force[before + 1])
    loop = make_variables("run", loop_slide=slide, loop_friction_force=force)
    return loop | _collect_measured_loop(result)


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
    return make_variables(
        "run", measured_slide=loop.displacement, measured_force=loop.reading * load
    )


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
        data = make_variables("run", wear_frame=cycles)
        for name in ("normal_stress", "worn_depth"):
            data[f"wear_{name}"] = _make_field(name, fields[name][: count + 1], "wear_frame")
        fields = {name: values[count:] for name, values in fields.items()}
        fields["time"] = fields["time"] - fields["time"][0]
    data |= make_variables("run", unloaded_gap=surface.unloaded_gap)
    data |= _collect_frames(fields, surface)
    if result.patch.model.area is None:
        return data
    return _spread_over_face(data | _collect_reversal(result), result.patch)


def _collect_reversal(result: Result) -> Variables:
    """Return the state of the cells of a face at the last reversal and their slip per cycle; {} without partial slip."""
    reversal = area_motion.find_face_reversal(result, result.patch)
    if reversal is None:
        return {}
    return make_variables(
        "run", reversal_status=reversal.status, slip_per_cycle=reversal.slip_per_cycle
    )


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
    data = make_variables("run", x=surface.x, weight=surface.weight)
    data |= make_columns(frame, {f"{frame}_time": (fields["time"], "s", "time of the frame")})
    for name, row in RUN_ROWS.items():
        if row.dims == "frame x" and name in fields:
            data[name] = _make_field(name, fields[name], frame)
    return data


def _make_field(name: str, values, frame: str) -> Variable:
    """Return a field along x over frames.

    The `values` are in SI units. `name` is that of a row over "frame x", and `frame` the name of the dimension of the
    frames.
    """
    return make_column(name, values, RUN_ROWS[name]._replace(dims=f"{frame} x"))


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
    drives = [level.drive for level in levels]
    data = make_columns("level", {"level_drive": (drives, unit, drive_text)})
    data |= make_variables("run", level_stuck=[level.stuck for level in levels])

    measures = {}
    table = run_measures.rows.MOTION_TABLE
    for name in run_measures.events.LEVEL_MEASURES:
        if any(name in level.values for level in levels):
            unit = table[name].unit
            values = [level.values.get(name, np.nan) for level in levels]
            errors = [level.errors.get(name, np.nan) for level in levels]
            measures[f"level_{name}"] = (values, unit, table[name].text)
            measures[f"level_{name}_error"] = (errors, unit, f"error of level_{name}")
    return data | make_columns("level", measures)


def _collect_regimes(result: Result) -> Variables:
    """Return the regime at each point of a response curve, such as "stick-slip", its compliance, and its folds."""
    curve = None if result.motion.steady is None else result.motion.steady.curve
    if curve is None:
        return {}
    regimes = encode_texts("curve_point", curve["regime"], "regime of the steady motion")
    folds = np.asarray(curve.get("folds", ()), float)
    unit = "Hz" if np.ptp(curve["frequency"]) > 0 else "m s-2"
    errors = np.asarray(curve.get("fold_errors", np.full(folds.size, np.nan)), float)
    columns = (
        {"curve_fold": (folds, unit), "curve_fold_error": (errors, unit)} if folds.size else {}
    )
    rig = result.plan.model.rig
    if not rig.drive.signal.moving:
        forces = curve["level"] * rig.modes.mass
        columns["curve_compliance"] = curve["amplitude"] / forces, "m N-1"
    return {"curve_regime": regimes} | make_variables("run", **columns)


def _collect_frequency_response(result: Result) -> Variables:
    """Return magnitude and phase of the frequency response H1 of a random drive."""
    if result.motion.spectra is None:
        return {}
    gain = np.asarray(result.motion.spectra.gain)
    return make_variables("run", gain=np.abs(gain), phase=np.angle(gain))


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
    level = structure.drive_sizes.find_max_acceleration(result.plan.model.rig.drive.signal)
    measured = {"measured_input": [row.input for row in rows]}
    columns = {"computed_input": [float(level)]}
    for name in SENSOR_UNITS:
        measured[f"measured_{name}"] = [getattr(row, name) for row in rows]
        if name in computed:
            columns[f"computed_{name}"] = [computed[name].value]
            if computed[name].error is not None:
                columns[f"computed_{name}_error"] = [computed[name].error]
    return make_variables("run", **measured, **columns)


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
        reading = run_measures.spectrum.read_instrument(
            result.window, signal, peak.value, kind, cutoff
        )
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
    return make_variables(
        "run",
        accuracy_steps=[run.steps for run in runs],
        accuracy_seconds=[run.seconds for run in runs],
        accuracy_error=[run.error for run in runs],
    )
