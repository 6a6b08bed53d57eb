"""Table of the charts, of the CSV files of curves and of the tables of each kind of answer.

A chart is a row: it names variables of the answer, and it is shown if the answer has them. A new chart is a new row.
The columns of CSV files and tables are written as their heading line: "HEADING = NAME", or NAME alone if both are equal.
"""

from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class Chart:
    """Chart of an answer.

    Several names in a string are separated by spaces.

    Attributes
    ----------
    title : str
        Heading of the chart.
    x : str
        Variable of the horizontal axis. Several names: the first one that the answer has.
    y : str
        Variables of the vertical axis. "NAME@X" is drawn against its own variable X.
    style : str
        "line", "points", "area", "map" (colours over x and the first dimension), "face" (a map of the last frame over x and
        y), "overlay" (a line for each element of the first dimension) or "film" (a map with a slider). Of a sweep:
        "relative" (measures divided by their first value), "menu" (one measure at a time) or "maps" (the same over two
        keys).
    span : str
        "all", "cycles" (last three cycles), "run" (all cycles, if there are more) or "contact" (the loaded part of x).
    log : str
        Logarithmic axes: "", "x", "y" or "xy". "auto" decides by the values, also for the other axis of "x auto".
    by : str
        Variable of codes that colour the points of the first variable.
    marks : str
        Variables whose values are vertical lines.
    lines : str
        Further variables of the vertical axis, drawn as lines beside points.
    thin : str
        Variables of the vertical axis that are drawn thin, below the others, which are bold.
    x_label, y_label : str
        Names of the axes, or "" for the name of the variable, "*" for its description.
    caption : str
        Sentence below the chart, or "" for none.
    """

    title: str
    x: str
    y: str
    style: str = "line"
    span: str = "all"
    log: str = ""
    by: str = ""
    marks: str = ""
    lines: str = ""
    thin: str = ""
    x_label: str = ""
    y_label: str = ""
    caption: str = ""


class Column(NamedTuple):
    """Column of a CSV file or of a table.

    - heading: text above the column.
    - name: variable of the answer, or key in each row of its details.
    - style: "" for values as they are. In a table also "name" for words with underscores, "quantity" for a value with the
      unit, the error and the interval of its row, "rounded" for three digits, and "percent" for a relative change. In a CSV
      file also "bare" for a heading without the unit.
    """

    heading: str
    name: str
    style: str = ""


def parse_columns(line: str) -> list[Column]:
    """Return the columns of a heading line such as "x, height = before, at = value:quantity".

    Each part is NAME, HEADING = NAME or HEADING = NAME:STYLE, as the fields of `Column`. Without a heading the name is
    used.
    """
    columns = []
    for part in line.split(", "):
        heading, _, source = part.partition(" = ")
        name, _, style = (source or heading).partition(":")
        columns.append(Column(heading.partition(":")[0], name, style))
    return columns


class CsvFile(NamedTuple):
    """CSV file of an answer.

    - source: its rows (`columns.list_rows`).
    - columns: heading line (`parse_columns`), or "" for all columns of the rows. A heading may end in a unit of
      CSV_UNITS_PER_SI_UNIT. The name `labels` stands for the texts of an object, each of which has a column.
    - has_intervals: whether the columns NAME, NAME_low and NAME_high of all quantities of the rows follow.
    """

    source: str
    columns: str
    has_intervals: bool = False


class Table(NamedTuple):
    """Table of an answer.

    - title: heading.
    - source: its rows (`columns.list_rows`).
    - columns: heading line (`parse_columns`). The heading "*" is the description of the variable.
    """

    title: str
    source: str
    columns: str


RUN_CHARTS = (
    Chart(
        "Wear over the cycles",
        "wear_cycle",
        "wear_worn_depth_max",
        caption="Largest worn depth, both pieces together.",
    ),
    Chart(
        "Pressure while it wears",
        "x",
        "wear_normal_stress",
        "overlay",
        span="contact",
        caption="Normal stress after the cycles that the colours name.",
    ),
    Chart(
        "Worn depth",
        "x",
        "wear_worn_depth",
        "overlay",
        caption="Worn depth of both pieces together after the cycles that the colours name.",
    ),
    Chart(
        "Friction loop",
        "loop_slide",
        "loop_friction_force measured_force@measured_slide",
        x_label="slide",
        y_label="friction force",
        caption="Friction force against the slide of the interface in the last cycle, or over the whole run without cycles.",
    ),
    Chart(
        "Displacement",
        "time",
        "relative_displacement",
        span="cycles",
        caption="Last cycles: displacement of the output relative to the base; on a bench that of the upper piece.",
    ),
    Chart(
        "Acceleration",
        "time",
        "absolute_acceleration base_acceleration",
        span="cycles",
        y_label="acceleration",
        caption="Last cycles: acceleration of the output, base motion included, and of the base.",
    ),
    Chart(
        "Friction force",
        "time",
        "friction_force",
        span="cycles",
        caption="Last cycles: resultant of the frictional shear stress.",
    ),
    Chart(
        "Steady motions",
        "curve_frequency",
        "curve_amplitude",
        by="curve_regime",
        marks="curve_fold",
        caption="Half the peak-to-peak motion at the output over the drive frequency; vertical lines: the curve turns back.",
    ),
    Chart(
        "Steady motions",
        "curve_level",
        "curve_amplitude",
        log="auto",
        by="curve_regime",
        marks="curve_fold",
        caption="Half the peak-to-peak motion at the output over the drive; vertical lines: the curve turns back.",
    ),
    Chart(
        "Frequency of the decay",
        "decay_amplitude",
        "decay_frequency",
        log="x",
        caption="Frequency of the released output against its amplitude.",
    ),
    Chart(
        "Damping of the decay",
        "decay_amplitude",
        "decay_damping",
        log="x",
        caption="Damping ratio, structure and friction together, against the amplitude.",
    ),
    Chart(
        "Frequency response H1",
        "frequency",
        "gain",
        log="xy",
        marks="gain_peak",
        caption="Displacement of the output divided by the acceleration of the base; the vertical line is the peak.",
    ),
    Chart("Coherence", "frequency", "coherence", log="x", caption="Coherence of drive and output."),
    Chart(
        "Spectral density",
        "frequency",
        "absolute_acceleration_spectrum base_acceleration_spectrum",
        log="xy",
        y_label="spectral density",
        caption="One-sided spectral densities of the accelerations of output and base.",
    ),
    Chart(
        "Levels of the drive",
        "level_drive",
        "level_relative_displacement_amplitude",
        "points",
        by="level_stuck",
        x_label="drive",
        y_label="amplitude",
        caption="Amplitude at the end of each level; each level starts from the final state of the one before.",
    ),
    Chart(
        "Against the measurement: acceleration",
        "measured_input",
        "measured_acceleration computed_acceleration@computed_input",
        "points",
        x_label="base acceleration",
        y_label="indicated acceleration",
        caption="Readings at the drive frequency, and what the sensors would indicate in the computed motion.",
    ),
    Chart(
        "Against the measurement: displacement",
        "measured_input",
        "measured_displacement computed_displacement@computed_input",
        "points",
        x_label="base acceleration",
        y_label="indicated displacement",
        caption="Readings at the drive frequency, and what the sensors would indicate in the computed motion.",
    ),
    Chart(
        "Worn depth over the face",
        "x",
        "wear_worn_depth",
        "face",
        y_label="worn depth",
        caption="Worn depth of both pieces together after all cycles.",
    ),
    Chart(
        "Pressure over the face",
        "x",
        "normal_stress",
        "face",
        caption="Normal stress of the cells at the end of the run, compression positive.",
    ),
    Chart(
        "Pressure on the interface",
        "x",
        "normal_stress",
        "area",
        span="contact",
        caption="Normal stress at the end of the run, compression positive; only the part in contact. The drawn values are "
        "means over the elements beside a node; the measure pressure_peak is the maximum of the continuous pressure.",
    ),
    Chart(
        "Shear stress on the interface",
        "x",
        "shear_stress",
        "map",
        span="contact",
        caption="Frictional shear stress over x and the frames of the last cycle.",
    ),
    Chart(
        "Where it sticks and slips",
        "x",
        "status",
        "map",
        span="contact",
        caption="State of each node in the frames of the last cycle. A node slips in a frame where its own shear stress is "
        "at the friction limit; stick_fraction is that of the contact as a whole (mean slip weighted by the pressure).",
    ),
    Chart(
        "Open, stick and slip over the face",
        "x",
        "reversal_status",
        "face",
        caption="State of the cells at the last reversal of the slide.",
    ),
    Chart(
        "Slip per cycle over the face",
        "x",
        "slip_per_cycle",
        "face",
        caption="Path of the slip of each cell in a cycle.",
    ),
    Chart(
        "Gap over the face",
        "x",
        "gap",
        "face",
        caption="Gap between the loaded surfaces at the end of the run.",
    ),
    Chart("Gap", "x", "gap", caption="Gap between the loaded surfaces at the end of the run."),
    Chart(
        "Whole run",
        "time",
        "relative_displacement",
        span="run",
        caption="Before the last cycles only reversals are stored.",
    ),
    Chart(
        "Energy",
        "time",
        "energy_dissipated energy_stored",
        y_label="energy",
        caption="Energy dissipated by friction since the start, and elastic energy of the interface.",
    ),
    Chart(
        "Accuracy against time",
        "accuracy_seconds",
        "accuracy_error",
        "points",
        log="xy",
        x_label="CPU time",
        y_label="error of the worst main measure",
        caption="Estimated error of this run (right) and of the coarser runs, as the tolerance that it would meet.",
    ),
)

SWEEP_CHARTS = (
    Chart(
        "Main measures relative to the first case",
        "",
        "relative_displacement_amplitude absolute_acceleration_peak slip_amplitude loop_area friction_force_peak "
        "friction_ratio_peak onset_level normal_stiffness tangential_stiffness contact_fraction pressure_peak "
        "equivalent_damping",
        "relative",
        caption="Values of settled and unsettled cases divided by that of the first case; the band is a change of 5 %. "
        "Click on a name to hide its line.",
    ),
    Chart(
        "One measure",
        "",
        "",
        "menu",
        caption="Bars show the numerical error. Crosses mark cases that did not settle.",
    ),
    Chart("One measure over two keys", "", "", "maps", caption="White cells have no value."),
)
# Methods of a backbone; the first one with a curve is recommended.
BACKBONE_METHODS = ("balance", "quasi_static")


def _draw_methods(title: str, name: str, **options) -> Chart:
    """Return the chart of a quantity of a backbone over the amplitude, with the curves of all methods."""
    x = " ".join(f"{method}_amplitude" for method in BACKBONE_METHODS)
    y = " ".join(f"{method}_{name}@{method}_amplitude" for method in BACKBONE_METHODS)
    thin = " ".join(f"{method}_{name}" for method in BACKBONE_METHODS[1:])
    return Chart(title, x, y, thin=thin, x_label="amplitude at the output", **options)


BACKBONE_CHARTS = (
    _draw_methods(
        "Frequency",
        "frequency",
        log="x",
        y_label="frequency",
        caption="Where two methods are shown, use the first; its band contains the numerical error and the difference.",
    ),
    _draw_methods(
        "Damping ratio",
        "damping",
        log="x auto",
        y_label="damping ratio",
        caption="Structure and friction together. Where two methods are shown, use the first, with its band.",
    ),
    _draw_methods(
        "Force of the phase resonance",
        "force",
        log="x y",
        y_label="force at the output",
        caption="Amplitude of a sinusoidal force at the output, in phase with the velocity there, that holds the amplitude.",
    ),
)
FIT_CHARTS = (
    Chart(
        "Measured and fitted loop",
        "slide",
        "force friction_ratio held_out",
        "points",
        lines="fitted",
        x_label="slide",
        y_label="friction force",
        caption="Rows of the record, and the fitted loop; rows that are held out are predicted.",
    ),
    Chart(
        "Residuals",
        "row",
        "residual",
        "points",
        x_label="row",
        y_label="fitted - measured",
        caption="A pattern along the fitted rows is an error of the model; scatter around zero is noise of the record.",
    ),
    Chart(
        "Frequency",
        "amplitude",
        "frequency",
        "points",
        log="x",
        lines="curve_frequency@curve_amplitude",
        caption="Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.",
    ),
    Chart(
        "Damping ratio",
        "amplitude",
        "damping",
        "points",
        log="x auto",
        lines="curve_damping@curve_amplitude",
        y_label="damping ratio",
        caption="Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.",
    ),
    Chart(
        "Residuals of the frequency",
        "amplitude",
        "frequency_residual",
        "points",
        log="x",
        y_label="(fitted - measured) / interval",
        caption="Distances in half-widths of the 95 % intervals.",
    ),
    Chart(
        "Residuals of the damping ratio",
        "amplitude",
        "damping_residual",
        "points",
        log="x",
        y_label="(fitted - measured) / interval",
        caption="Distances in half-widths of the 95 % intervals.",
    ),
    *(
        Chart(
            f"Computed against measured {name}",
            name,
            f"computed_{name}",
            "points",
            log="xy",
            by="use",
            lines=f"equal_{name}@equal_{name}",
            x_label=f"measured {name}",
            y_label=f"computed {name}",
            caption="On the line both are equal. Rows that are held out are predicted.",
        )
        for name in ("acceleration", "displacement")
    ),
    *(
        Chart(
            f"Ratio of the {name} against the input",
            "input",
            f"{name}_ratio",
            "points",
            log="auto",
            by="drive",
            y_label=f"computed / measured {name}",
            caption="A trend with the input or the frequency is an error of the model.",
        )
        for name in ("acceleration", "displacement")
    ),
    Chart(
        "Worn depth against the coefficient",
        "coefficient",
        "depth",
        "points",
        lines="curve_depth@curve_coefficient",
        x_label="wear coefficient",
        y_label="worn depth",
        caption="Measured depth at the fitted coefficient, and the computed depth beyond it.",
    ),
)
COST_CHARTS = (
    Chart(
        "Error against time",
        "seconds",
        "largest_error tolerance",
        "points",
        log="xy",
        by="result",
        x_label="CPU time",
        y_label="largest relative error",
        caption="Largest relative error of any main measure in each run, and the tolerance of this run at the same CPU "
        "time. A run meets its tolerance if its error is below it.",
    ),
    Chart(
        "Value against time",
        "seconds",
        "main_measure",
        "points",
        log="x",
        by="result",
        x_label="CPU time",
        y_label="*",
        caption="The least accurate of the main measures in each run, with its numerical error.",
    ),
    Chart(
        "Convergence",
        "point_seconds",
        "point_change",
        "points",
        log="xy",
        by="point_measure",
        x_label="CPU time",
        y_label="relative change from the finest run",
        caption="Difference of each main measure from its value in the finest run, over the CPU time. The table has the "
        "order that the finest three runs show.",
    ),
)
COMPARE_CHARTS = (
    Chart(
        "Both traces",
        "x",
        "before after",
        marks="track_end",
        x_label="x of the second trace",
        y_label="height",
        caption="The trace measured after wear, moved by shift, tilt and offset onto the one measured before. Vertical "
        "lines: ends of the tracks.",
    ),
    Chart(
        "Worn depth",
        "x",
        "depth hidden_depth",
        marks="track_end",
        y_label="worn depth",
        caption="Depth of the surface after wear below the one before; of traces with the 95 % noise of a single depth. "
        "Vertical lines: ends of the worn parts.",
    ),
    Chart(
        "Both traces, each about its own line",
        "x_before",
        "trace_before trace_after@x_after",
        x_label="x",
        y_label="height",
        caption="No common place was found in the two traces.",
    ),
    Chart(
        "Worn depth",
        "x",
        "depth_map",
        "map",
        y_label="worn depth",
        caption="Depth of the second surface below the first, once both are aligned; white: not measured.",
    ),
    Chart(
        "Surface before",
        "x",
        "before_map",
        "map",
        y_label="height",
        caption="Before wear; white: not measured.",
    ),
    Chart(
        "Surface after",
        "x",
        "after_map",
        "map",
        y_label="height",
        caption="After wear, aligned with the first surface; white: not measured.",
    ),
    Chart(
        "Computed and measured wear",
        "x_patch",
        "measured_depth computed_depth",
        x_label="x of the patch",
        y_label="worn depth",
        caption="Measured depth with its 95 % noise, and that of the run with the fitted wear coefficient.",
    ),
    Chart(
        "Measured less computed wear",
        "x_patch",
        "depth_difference",
        "area",
        x_label="x of the patch",
        y_label="measured less computed",
        caption="Above zero more wore off than computed.",
    ),
    Chart(
        "Gap of the unloaded surfaces",
        "x",
        "gap_before gap_after",
        y_label="gap",
        caption="Gap between the pieces without load, wear included.",
    ),
    Chart(
        "Pressure on the interface",
        "x_pressed_before x_pressed_after",
        "pressure_before@x_pressed_before pressure_after@x_pressed_after",
        x_label="x of the patch",
        y_label="normal stress",
        caption="Normal stress of the pressed patch with each of the two surfaces; of a face at y = 0.",
    ),
    Chart(
        "Friction loops",
        "slide_before slide_after",
        "force_before@slide_before force_after@slide_after",
        x_label="slide",
        y_label="friction force",
        caption="Friction force against the slide of the interface in the last cycle.",
    ),
    Chart(
        "Abbott curves",
        "material_ratio",
        "abbott_before abbott_after",
        y_label="height",
        caption="Height that a given fraction of the surface exceeds.",
    ),
)
PAIRS_CHARTS = (
    Chart(
        "Worn depth of the pairs",
        "line",
        "worn_depth_mean",
        "points",
        x_label="line in the table",
        y_label="mean worn depth",
        caption="Mean worn depth of each pair with its 95 % interval.",
    ),
    Chart(
        "Amplitude of the waves",
        "line",
        "amplitude_ratio",
        "points",
        x_label="line in the table",
        y_label="after / before",
        caption="Amplitude of the waves from 60 to 110 um after wear divided by before, with 95 % intervals.",
    ),
)
PROFILE_CHARTS = (
    Chart(
        "Primary profile",
        "x",
        "primary waviness@x_rough",
        y_label="height",
        caption="Heights about the subtracted form, and the waviness beyond the cut-off.",
    ),
    Chart(
        "Roughness profile",
        "x_rough",
        "roughness",
        x_label="x",
        y_label="height",
        caption="Primary profile less waviness; half a cut-off is trimmed at each end.",
    ),
    Chart(
        "Surface",
        "x",
        "height_map",
        "map",
        y_label="height",
        caption="Heights from which the parameters are computed.",
    ),
    Chart(
        "Abbott curve",
        "material_ratio",
        "abbott",
        "overlay",
        y_label="height",
        caption="Height that a given fraction of the surface exceeds; of the roughness profile if there is a cut-off.",
    ),
    Chart(
        "Power spectral density",
        "wavelength",
        "density",
        log="xy",
        caption="One-sided spectral density of the primary profile over the wavelength.",
    ),
)

CHARTS: dict[str, tuple[Chart, ...]] = {
    **dict.fromkeys(("patch", "bench", "rig", "linear"), RUN_CHARTS),
    "sweep": SWEEP_CHARTS,
    "backbone": BACKBONE_CHARTS,
    "compare": COMPARE_CHARTS,
    "pairs": PAIRS_CHARTS,
    "profile": PROFILE_CHARTS,
    "fit": FIT_CHARTS,
    "cost": COST_CHARTS,
}


CSV_FILES: dict[str, dict[str, CsvFile]] = {
    "compare": {
        "depth.csv": CsvFile("x", "x, before, after, gap_before, gap_after, depth"),
        "predicted.csv": CsvFile(
            "x_patch",
            "x_patch, measured = measured_depth, measured_low = measured_depth_low, measured_high = measured_depth_high, "
            "computed = computed_depth, difference = depth_difference",
        ),
    },
    "pairs": {
        "pairs.csv": CsvFile(
            "pairs", "before, after, direction, labels, outcome, verdict, message", True
        )
    },
    "profile": {
        "profile.csv": CsvFile("profiles", "file", True),
        "primary.csv": CsvFile("x", "x, z = primary"),
        "roughness.csv": CsvFile("x_rough", "x = x_rough, z = roughness"),
    },
    "backbone": {
        "backbone.csv": CsvFile(
            "curves",
            "labels, method, amplitude [m] = amplitude, frequency [Hz] = frequency, frequency_error [Hz] = frequency_error, "
            "damping, damping_error, force [N] = force, force_error [N] = force_error, "
            "force_frequency [Hz] = force_frequency, "
            "frequency_low [Hz] = frequency_low, frequency_high [Hz] = frequency_high, damping_low, damping_high",
        )
    },
    "fit": {
        "fitted_curve.csv": CsvFile(
            "curve_amplitude",
            "amplitude = curve_amplitude, frequency = curve_frequency, frequency_error = curve_frequency_error, "
            "damping = curve_damping, damping_error = curve_damping_error",
        ),
        # of a loop, of a curve, and of rows
        "fit.csv": CsvFile(
            "row",
            "time, displacement = slide, force, friction_ratio, fitted, "
            "amplitude, frequency, frequency_error, damping, damping_error, frequency_fitted, "
            "damping_fitted, input [g] = input, acceleration [g] = acceleration, displacement [mil] = displacement, flag, "
            "computed acceleration [g] = computed_acceleration, "
            "computed displacement [mil] = computed_displacement, held",
        ),
    },
    "cost": {"cost.csv": CsvFile("run", "")},
}
# Number of these units in one SI unit
CSV_UNITS_PER_SI_UNIT = {"g": 1 / 9.80665, "mil": 1 / 25.4e-6}

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
        "interface = level_stuck",
    ),
)
PAIR_TABLE_COLUMNS = "worn_depth_mean, worn_volume, track_width, track_depth, amplitude_ratio"
_CHANGE_COLUMNS = " = name, before, after, after / before = ratio, cut-off = cutoff"
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
            "Variance of a measure: first-order and total Sobol index of each key",
            "ranking",
            "measure = name, key, alone = first:rounded, with interactions = total:rounded, at least = low:rounded, "
            "at most = high:rounded",
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
            "cases",
            "value, frequency with a sticking contact = stuck_frequency, largest damping ratio = largest_damping, "
            "at = amplitude_of_largest_damping",
        ),
    ),
    "compare": (
        Table("Roughness inside and outside of the track", "track_roughness", _CHANGE_COLUMNS),
        Table("Both runs", "measures", _CHANGE_COLUMNS),
        Table("Scene pressed with each of the two surfaces", "pressed/measures", _CHANGE_COLUMNS),
    ),
    "pairs": (
        Table("Each pair", "pairs", f"before, after, verdict, message, {PAIR_TABLE_COLUMNS}"),
    ),
    "profile": (Table("Each file", "profiles", "file, Ra, Rq, Rz, RSm, Pa, Pq, Pt, Sa, Sq, Sz"),),
    "fit": (
        Table("Correlation of the fitted values", "pair", "values = pair, correlation:rounded"),
    ),
    "cost": (
        Table(
            "Runs",
            "run",
            "varied = knob:name, setting, interface nodes = nodes, steps per cycle = steps, CPU s = seconds:rounded, "
            "largest error = largest_error:rounded, of = worst_measure, * = main_measure, result",
        ),
        Table(
            "Convergence over one setting",
            "convergence",
            "varied = setting:name, measure:name, finest value = text, observed order = order:rounded, "
            "within 1 % from = for_1_percent, within 0.1 % from = for_1_permille",
        ),
    ),
}
