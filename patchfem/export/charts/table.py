"""Table of the charts, of the CSV files of curves and of the tables of each kind of answer.

A chart is a row: it names variables of the answer, and it is shown if the answer has them. A new chart is a new row.
The columns of CSV files and tables are written as their heading line: "HEADING = NAME", or NAME alone if both are equal.
"""

import re
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class Chart:
    """Chart of an answer; several names in a string are separated by spaces.

    Attributes
    ----------
    title : str
    x : str
        Variable of the horizontal axis. Several names: the first one that the answer has.
    y : str
        Variables of the vertical axis. "NAME@X" is drawn against its own variable X.
    style : str
        "line", "points", "area", "map" (colours over x and the first dimension), "overlay" (a line for each element of the
        first dimension), "bars" (horizontal bars of the values of a dimension) or "film" (a map with a slider). Of a sweep:
        "relative" (measures divided by their first value), "menu" (one measure at a time), "maps" (the same over two keys)
        or "shares" (of the variance).
    span : str
        "all", "cycles" (last three cycles), "run" (all cycles, if there are more) or "contact" (the loaded part of x).
    log : str
        Logarithmic axes: "", "x", "y" or "xy"; "auto" decides by the values, also for the other axis of "x auto".
    by : str
        Variable of codes that colour the points.
    marks : str
        Variables whose values are vertical lines.
    lines : str
        Further variables of the vertical axis, drawn as lines beside points.
    x_label, y_label : str
        Names of the axes; "" for the name of the variable, "*" for its description.
    caption : str
    """

    title: str
    x: str = ""
    y: str = ""
    style: str = "line"
    span: str = "all"
    log: str = ""
    by: str = ""
    marks: str = ""
    lines: str = ""
    x_label: str = ""
    y_label: str = ""
    caption: str = ""


def parse_charts(table: str) -> tuple[Chart, ...]:
    """Return the charts of a table: the title, and below it the fields, which are indented.

    A long field goes on in lines that are indented further. TypeError for a field that a chart has not.
    """
    charts = []
    for row in re.split(r"\n(?=\S)", table.strip()):
        title, *parts = re.split(r"\n    (?=\S)", row)
        pairs = (" ".join(part.split()).split(" = ", 1) for part in parts)
        charts.append(Chart(title, **dict(pairs)))
    return tuple(charts)


class Column(NamedTuple):
    """Column of a CSV file or of a table.

    heading; name: variable of the answer, or key in each row of its details; style: "" or, for a table, "name" for words
    with underscores, "quantity" with the unit, the error and the interval of its row, "rounded" for three digits, or
    "percent" for a relative change.
    """

    heading: str
    name: str
    style: str = ""


def parse_columns(line: str) -> list[Column]:
    """Return the columns of a heading line such as "x, height = before, at = value:quantity"."""
    columns = []
    for part in line.split(", "):
        heading, _, source = part.partition(" = ")
        name, _, style = (source or heading).partition(":")
        columns.append(Column(heading.partition(":")[0], name, style))
    return columns


class CsvFile(NamedTuple):
    """CSV file of an answer.

    columns: heading line, where a heading may end in a unit of CSV_UNITS; source: "" for variables, a dimension for all of
    its variables, "curves" for the curves of a backbone below each other, or the key of a list of objects in the details,
    whose texts the columns name; nested: key of the quantities in each of these objects, "" if they are its own keys. A
    quantity has the columns NAME, NAME_low and NAME_high.
    """

    columns: str
    source: str = ""
    nested: str = ""


class Table(NamedTuple):
    """Table of an answer.

    title: heading; source: path of a list of objects in `details`, such as "limits" or "cases/failed", or the name of a
    dimension of `data`; columns: heading line, where "NAME:STYLE" has the style of a `Column`.
    """

    title: str
    source: str
    columns: str


RUN = parse_charts("""
Wear over the cycles
    x = wear_cycle
    y = wear_worn_depth_max
    caption = Largest worn depth, both pieces together.
Pressure while it wears
    x = x
    y = wear_normal_stress
    style = overlay
    span = contact
    caption = Normal stress after the cycles that the colours name.
Worn depth
    x = x
    y = wear_worn_depth
    style = overlay
    caption = Worn depth of both pieces together after the cycles that the colours name.
Friction loop
    x = loop_slide
    y = loop_friction_force measured_force@measured_slide
    x_label = slide
    y_label = friction force
    caption = Friction force against the slide of the interface in the last cycle, or over the whole run without
        cycles.
Displacement
    x = time
    y = relative_displacement
    span = cycles
    caption = Last cycles: displacement of the output relative to the base; on a bench that of the upper piece.
Acceleration
    x = time
    y = absolute_acceleration base_acceleration
    span = cycles
    y_label = acceleration
    caption = Last cycles: acceleration of the output, base motion included, and of the base.
Friction force
    x = time
    y = friction_force
    span = cycles
    caption = Last cycles: resultant of the frictional shear stress.
Steady motions
    x = curve_frequency
    y = curve_amplitude
    by = curve_regime
    marks = curve_fold
    caption = Half the peak-to-peak motion at the output over the drive frequency; vertical lines: the curve
        turns back.
Steady motions
    x = curve_level
    y = curve_amplitude
    log = auto
    by = curve_regime
    marks = curve_fold
    caption = Half the peak-to-peak motion at the output over the drive; vertical lines: the curve turns back.
Frequency of the decay
    x = decay_amplitude
    y = decay_frequency
    log = x
    caption = Frequency of the released output against its amplitude.
Damping of the decay
    x = decay_amplitude
    y = decay_damping
    log = x
    caption = Damping ratio, structure and friction together, against the amplitude.
Frequency response H1
    x = frequency
    y = gain
    log = xy
    marks = gain_peak
    caption = Displacement of the output divided by the acceleration of the base; the vertical line is the peak.
Coherence
    x = frequency
    y = coherence
    log = x
    caption = Coherence of drive and output.
Spectral density
    x = frequency
    y = absolute_acceleration_spectrum base_acceleration_spectrum
    log = xy
    y_label = spectral density
    caption = One-sided spectral densities of the accelerations of output and base.
Levels of the drive
    x = level_drive
    y = level_relative_displacement_amplitude
    style = points
    by = level_stuck
    x_label = drive
    y_label = amplitude
    caption = Amplitude at the end of each level; each level starts from the final state of the one before.
Against the measurement: acceleration
    x = measured_input
    y = measured_acceleration computed_acceleration@computed_input
    style = points
    x_label = base acceleration
    y_label = indicated acceleration
    caption = Readings at the drive frequency, and what the sensors would indicate in the computed motion.
Against the measurement: displacement
    x = measured_input
    y = measured_displacement computed_displacement@computed_input
    style = points
    x_label = base acceleration
    y_label = indicated displacement
    caption = Readings at the drive frequency, and what the sensors would indicate in the computed motion.
Pressure on the interface
    x = x
    y = normal_stress
    style = area
    span = contact
    caption = Normal stress at the end of the run, compression positive; only the part in contact.
Shear stress on the interface
    x = x
    y = shear_stress
    style = map
    span = contact
    caption = Frictional shear stress over x and the frames of the last cycle.
Where it sticks and slips
    x = x
    y = status
    style = map
    span = contact
    caption = State of each node in the frames of the last cycle.
Gap
    x = x
    y = gap
    caption = Gap between the loaded surfaces at the end of the run.
Whole run
    x = time
    y = relative_displacement
    span = run
    caption = Before the last cycles only reversals are stored.
Energy
    x = time
    y = energy_dissipated energy_stored
    y_label = energy
    caption = Energy dissipated by friction since the start, and elastic energy of the interface.
Accuracy against time
    x = accuracy_seconds
    y = accuracy_error
    style = points
    log = xy
    x_label = CPU time
    y_label = error of the worst main measure
    caption = Estimated error of this run (right) and of the coarser runs, as the tolerance that it would meet.
""")

SWEEP = parse_charts("""
Main measures relative to the first case
    y = relative_displacement_amplitude absolute_acceleration_peak slip_amplitude loop_area friction_force_peak
        friction_ratio_peak onset_level normal_stiffness tangential_stiffness contact_fraction pressure_peak
        equivalent_damping
    style = relative
    caption = Values of settled and unsettled cases divided by that of the first case; the band is a change of 5
        %. Click on a name to hide its line.
One measure
    style = menu
    caption = Bars show the numerical error. Hollow points miss the tolerance, crosses mark cases that did not
        settle.
One measure over two keys
    style = maps
    caption = White cells have no value.
Shares of the variance
    style = shares
    caption = Fraction of the variance over the cases that a key contributes: alone (first-order Sobol index),
        and with its interactions (total index), with the interval of the latter.
""")
# The first method with a curve is recommended.
BACKBONE = parse_charts("""
Frequency
    x = balance_amplitude quasi_static_amplitude
    y = balance_frequency@balance_amplitude quasi_static_frequency@quasi_static_amplitude
    log = x
    x_label = amplitude at the output
    y_label = frequency
    caption = Where two methods are shown, use the first; its band contains the numerical error and the
        difference.
Damping ratio
    x = balance_amplitude quasi_static_amplitude
    y = balance_damping@balance_amplitude quasi_static_damping@quasi_static_amplitude
    log = x auto
    x_label = amplitude at the output
    y_label = damping ratio
    caption = Structure and friction together. Where two methods are shown, use the first, with its band.
Force of the phase resonance
    x = balance_amplitude quasi_static_amplitude
    y = balance_force@balance_amplitude quasi_static_force@quasi_static_amplitude
    log = x y
    x_label = amplitude at the output
    y_label = force at the output
    caption = Amplitude of a sinusoidal force at the output, in phase with the velocity there, that holds the
        amplitude.
""")
FIT = parse_charts("""
Measured and fitted loop
    x = slide
    y = force friction_ratio held_out
    style = points
    lines = fitted
    x_label = slide
    y_label = friction force
    caption = Rows of the record, and the fitted loop; rows that are held out are predicted.
Residuals
    x = row
    y = residual
    style = points
    x_label = row
    y_label = fitted - measured
    caption = A pattern along the rows is an error of the model; scatter around zero is noise of the record.
Frequency
    x = amplitude
    y = frequency
    style = points
    log = x
    lines = curve_frequency@curve_amplitude
    caption = Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.
Damping ratio
    x = amplitude
    y = damping
    style = points
    log = x auto
    lines = curve_damping@curve_amplitude
    y_label = damping ratio
    caption = Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.
Residuals of the frequency
    x = amplitude
    y = frequency_residual
    style = points
    log = x
    y_label = (fitted - measured) / interval
    caption = Distances in half-widths of the 95 % intervals.
Residuals of the damping ratio
    x = amplitude
    y = damping_residual
    style = points
    log = x
    y_label = (fitted - measured) / interval
    caption = Distances in half-widths of the 95 % intervals.
Computed against measured acceleration
    x = acceleration
    y = computed_acceleration
    style = points
    log = xy
    by = use
    lines = equal_acceleration@equal_acceleration
    x_label = measured acceleration
    y_label = computed acceleration
    caption = On the line both are equal. Rows that are held out are predicted.
Computed against measured displacement
    x = displacement
    y = computed_displacement
    style = points
    log = xy
    by = use
    lines = equal_displacement@equal_displacement
    x_label = measured displacement
    y_label = computed displacement
    caption = On the line both are equal. Rows that are held out are predicted.
Ratio of the acceleration against the input
    x = input
    y = acceleration_ratio
    style = points
    log = auto
    by = drive
    y_label = computed / measured acceleration
    caption = A trend with the input or the frequency is an error of the model.
Ratio of the displacement against the input
    x = input
    y = displacement_ratio
    style = points
    log = auto
    by = drive
    y_label = computed / measured displacement
    caption = A trend with the input or the frequency is an error of the model.
Worn depth against the coefficient
    x = coefficient
    y = depth
    style = points
    lines = curve_depth@curve_coefficient
    x_label = wear coefficient
    y_label = worn depth
    caption = Measured depth at the fitted coefficient, and the computed depth beyond it.
""")
COST = parse_charts("""
Error against time
    x = seconds
    y = largest_error
    style = points
    log = xy
    by = result
    lines = allowed_error@allowed_seconds
    x_label = CPU time
    y_label = error of the worst measure
    caption = Largest relative error of any measure in each run. The line is the tolerance of the scene.
Value against time
    x = seconds
    y = main_measure
    style = points
    log = x
    by = result
    x_label = CPU time
    y_label = *
    caption = The least accurate of the key measures in each run, with its numerical error.
""")
COMPARE = parse_charts("""
Both traces
    x = x
    y = before after
    marks = track_end
    x_label = x of the second trace
    y_label = height
    caption = The trace measured after wear, moved by shift, tilt and offset onto the one measured before.
        Vertical lines: ends of the tracks.
Worn depth
    x = x
    y = depth hidden_depth
    marks = track_end
    y_label = worn depth
    caption = Depth of the surface after wear below the one before. Vertical lines: ends of the worn parts.
Both traces, each about its own line
    x = x_before
    y = trace_before trace_after@x_after
    x_label = x
    y_label = height
    caption = No common place was found in the two traces.
Worn depth
    x = x
    y = depth_map
    style = map
    y_label = worn depth
    caption = Depth of the second surface below the first, once both are aligned; white: not measured.
Surface before
    x = x
    y = before_map
    style = map
    y_label = height
    caption = Before wear; white: not measured.
Surface after
    x = x
    y = after_map
    style = map
    y_label = height
    caption = After wear, aligned with the first surface; white: not measured.
Computed and measured wear
    x = x_patch
    y = measured_depth computed_depth
    x_label = x of the patch
    y_label = worn depth
    caption = Measured depth with its 95 % noise, and that of the run with the fitted wear coefficient.
Measured less computed wear
    x = x_patch
    y = depth_difference
    style = area
    x_label = x of the patch
    y_label = measured less computed
    caption = Above zero more wore off than computed.
Gap of the unloaded surfaces
    x = x
    y = gap_before gap_after
    y_label = gap
    caption = Gap between the pieces without load, wear included.
Pressure on the interface
    x = x_pressed_before x_pressed_after
    y = pressure_before@x_pressed_before pressure_after@x_pressed_after
    x_label = x of the patch
    y_label = normal stress
    caption = Normal stress of the pressed patch with each of the two surfaces; the mean over strips.
Friction loops
    x = slide_before slide_after
    y = force_before@slide_before force_after@slide_after
    x_label = slide
    y_label = friction force
    caption = Friction force against the slide of the interface in the last cycle.
Abbott curves
    x = material_ratio
    y = abbott_before abbott_after
    y_label = height
    caption = Height that a given fraction of the surface exceeds.
""")
PAIRS = parse_charts("""
Worn depth of the pairs
    x = line
    y = worn_depth_mean
    style = points
    x_label = line in the table
    y_label = mean worn depth
    caption = Mean worn depth of each pair with its 95 % interval.
Amplitude of the waves
    x = line
    y = amplitude_ratio
    style = points
    x_label = line in the table
    y_label = after / before
    caption = Amplitude of the waves from 60 to 110 um after wear divided by before, with 95 % intervals.
""")
PROFILE = parse_charts("""
Primary profile
    x = x
    y = primary waviness@x_rough
    y_label = height
    caption = Heights about the subtracted form, and the waviness beyond the cut-off.
Roughness profile
    x = x_rough
    y = roughness
    x_label = x
    y_label = height
    caption = Primary profile less waviness; half a cut-off is trimmed at each end.
Surface
    x = x
    y = height_map
    style = map
    y_label = height
    caption = Heights from which the parameters are computed.
Abbott curve
    x = material_ratio
    y = abbott
    style = overlay
    y_label = height
    caption = Height that a given fraction of the surface exceeds; of the roughness profile if there is a
        cut-off.
Power spectral density
    x = wavelength
    y = density
    log = xy
    caption = One-sided spectral density of the primary profile over the wavelength.
""")

CHARTS: dict[str, tuple[Chart, ...]] = {
    **dict.fromkeys(("patch", "bench", "rig", "linear"), RUN),
    "sweep": SWEEP,
    "backbone": BACKBONE,
    "compare": COMPARE,
    "pairs": PAIRS,
    "profile": PROFILE,
    "fit": FIT,
    "cost": COST,
}


CSV_FILES: dict[str, dict[str, CsvFile]] = {
    "compare": {
        "depth.csv": CsvFile("x, before, after, gap_before, gap_after, depth"),
        "predicted.csv": CsvFile(
            "x_patch, measured = measured_depth, measured_low = measured_depth_low, measured_high = measured_depth_high, "
            "computed = computed_depth, difference = depth_difference"
        ),
    },
    "pairs": {
        "pairs.csv": CsvFile("before, after, direction, labels, outcome, verdict, message", "pairs")
    },
    "profile": {
        "profile.csv": CsvFile("file", "profiles", "measures"),
        "primary.csv": CsvFile("x, z = primary"),
        "roughness.csv": CsvFile("x = x_rough, z = roughness"),
    },
    "backbone": {
        "backbone.csv": CsvFile(
            "amplitude [m] = amplitude, frequency [Hz] = frequency, frequency_error [Hz] = frequency_error, damping, "
            "damping_error, force [N] = force, force_error [N] = force_error, force_frequency [Hz] = force_frequency, "
            "frequency_low [Hz] = frequency_low, frequency_high [Hz] = frequency_high, damping_low, damping_high",
            "curves",
        )
    },
    "fit": {
        "fitted_curve.csv": CsvFile(
            "amplitude = curve_amplitude, frequency = curve_frequency, frequency_error = curve_frequency_error, "
            "damping = curve_damping, damping_error = curve_damping_error"
        ),
        # of a loop, of a curve, and of rows
        "fit.csv": CsvFile(
            "time, displacement = slide, force, friction_ratio, fitted, "
            "amplitude, frequency, frequency_error, damping, damping_error, frequency_fitted, "
            "damping_fitted, input [g] = input, acceleration [g] = acceleration, displacement [mil] = displacement, flag, "
            "computed acceleration [g] = computed_acceleration, "
            "computed displacement [mil] = computed_displacement, held"
        ),
    },
    "cost": {"cost.csv": CsvFile("", "run")},
}
CSV_UNITS = {"g": 1 / 9.80665, "mil": 1 / 25.4e-6}  # number of these units in one SI unit

# tables that stand below the charts
RUN_TABLES = (
    Table(
        "Against the measurement",
        "measured",
        "reading, measured, computed, computed / measured = ratio",
    ),
    Table(
        "Levels of the drive",
        "level",
        "drive = level_drive, amplitude = level_relative_displacement_amplitude, "
        "peak acceleration = level_absolute_acceleration_peak, distortion = level_acceleration_distortion, "
        "outcome = level_outcome, interface = level_stuck",
    ),
)
PAIR_COLUMNS = "worn_depth_mean, worn_volume, track_width, track_depth, amplitude_ratio"
_BOTH_SIDES = " = name, before, after, after / before = ratio, cut-off = cutoff"
TABLES: dict[str, tuple[Table, ...]] = {
    **dict.fromkeys(("patch", "bench", "rig", "linear"), RUN_TABLES),
    "sweep": (
        Table(
            "How far the key may go",
            "limits",
            "measure:name, changes by = change:percent, at (between the cases) = value:quantity",
        ),
        Table(
            "Peaks over the frequency",
            "peaks",
            "measure:name, at = case, frequency = peak_frequency, height = peak_height, half-power width = half_power_width",
        ),
        Table(
            "Where 90 % of the cases lie",
            "quantiles",
            "measure:name, 5 % are below = low, half are below = median, 95 % are below = high",
        ),
    ),
    "backbone": (
        Table(
            "Values of the key",
            "table",
            "value, frequency with a sticking contact = stuck_frequency, largest damping ratio = largest_damping, "
            "at = amplitude_of_largest_damping",
        ),
    ),
    "compare": (
        Table("Roughness inside and outside of the track", "track_roughness", _BOTH_SIDES),
        Table("Both runs", "measures", _BOTH_SIDES),
        Table("Scene pressed with each of the two surfaces", "pressed/measures", _BOTH_SIDES),
    ),
    "pairs": (
        Table("Means", "means", f"group, kind, direction, pairs, {PAIR_COLUMNS}"),
        Table("Each pair", "pairs", f"before, after, verdict, message, {PAIR_COLUMNS}"),
    ),
    "profile": (Table("Each file", "profiles", "file, Ra, Rq, Rz, RSm, Pa, Pq, Pt, Sa, Sq, Sz"),),
    "fit": (
        Table("Correlation of the fitted values", "pair", "values = pair, correlation:rounded"),
    ),
    "cost": (
        Table(
            "Runs",
            "run",
            "setting, interface nodes = nodes, steps per cycle = steps, CPU s = seconds:rounded, "
            "largest error = largest_error:rounded, of = worst_measure, value = main_measure, result",
        ),
    ),
}
