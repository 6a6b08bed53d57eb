"""Table of the charts, of the CSV files of curves and of the tables of each kind of answer.

A chart is a row: it names variables of the answer, and it is shown if the answer has them. A new chart is a new row.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Chart:
    """Chart of an answer.

    Attributes
    ----------
    title : str
    x : str
        Variable of the horizontal axis. Several names, separated by spaces: the first one that the answer has.
    y : tuple of str
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
    marks : tuple of str
        Variables whose values are vertical lines.
    y2 : tuple of str
        Variables of a second vertical axis.
    lines : tuple of str
        Further variables of the vertical axis, drawn as lines beside points.
    labels : tuple of str
        Names of the horizontal and the vertical axis; "" for the name of the variable, "*" for its description.
    caption : str
    """

    title: str
    x: str
    y: tuple[str, ...]
    style: str = "line"
    span: str = "all"
    log: str = ""
    by: str = ""
    marks: tuple[str, ...] = ()
    y2: tuple[str, ...] = ()
    lines: tuple[str, ...] = ()
    labels: tuple[str, str] = ("", "")
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Stack:
    """Columns of a CSV file for several groups of variables, one group below the other.

    heading: of the column with the name of the group; groups: their names; names: NAME has the values of GROUP_NAME.
    """

    heading: str
    groups: tuple[str, ...]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns of a CSV file for all variables of a dimension, with or without units in their headings."""

    dimension: str
    has_units: bool = True


@dataclass(frozen=True, slots=True)
class Entries:
    """Columns of a CSV file for a list of objects in the details of an answer.

    source: key of the list; texts: keys of texts in each object, where an object `labels` gives a column for each of its
    keys; nested: key of the quantities in each object, "" if they are its own keys. A quantity has three columns, NAME,
    NAME_low and NAME_high.
    """

    source: str
    texts: tuple[str, ...]
    nested: str = ""


@dataclass(frozen=True, slots=True)
class Column:
    """Column of a table.

    key: key in each row of the details, or name of a variable; title: heading; style: "text", "name" for words with
    underscores, "quantity" with the unit, the error and the interval of its row, "rounded" for three digits, or "percent"
    for a relative change.
    """

    key: str
    title: str
    style: str = "text"


@dataclass(frozen=True, slots=True)
class Table:
    """Table of an answer.

    title: heading; source: path of a list of objects in `details`, such as "limits" or "cases/failed", or the name of a
    dimension of `data`; columns: what it shows.
    """

    title: str
    source: str
    columns: tuple[Column, ...]


RUN = (
    Chart(
        "Wear over the cycles",
        "wear_cycle",
        ("wear_worn_depth_max",),
        caption="Largest worn depth, both pieces together.",
    ),
    Chart(
        "Pressure while it wears",
        "x",
        ("wear_normal_stress",),
        "overlay",
        "contact",
        caption="Normal stress after the cycles that the colours name.",
    ),
    Chart(
        "Worn depth",
        "x",
        ("wear_worn_depth",),
        "overlay",
        caption="Worn depth of both pieces together after the cycles that the colours name.",
    ),
    Chart(
        "Friction loop",
        "loop_slide",
        ("loop_friction_force", "measured_force@measured_slide"),
        labels=("slide", "friction force"),
        caption="Friction force against the slide of the interface in the last cycle, or over the whole run without cycles.",
    ),
    Chart(
        "Displacement",
        "time",
        ("relative_displacement",),
        span="cycles",
        caption="Last cycles: displacement of the output relative to the base; on a bench that of the upper piece.",
    ),
    Chart(
        "Acceleration",
        "time",
        ("absolute_acceleration", "base_acceleration"),
        span="cycles",
        labels=("", "acceleration"),
        caption="Last cycles: acceleration of the output, base motion included, and of the base.",
    ),
    Chart(
        "Friction force",
        "time",
        ("friction_force",),
        span="cycles",
        caption="Last cycles: resultant of the frictional shear stress.",
    ),
    Chart(
        "Steady motions",
        "curve_frequency",
        ("curve_amplitude",),
        by="curve_regime",
        marks=("curve_fold",),
        caption="Half the peak-to-peak motion at the output over the drive frequency; vertical lines: the curve turns back.",
    ),
    Chart(
        "Steady motions",
        "curve_level",
        ("curve_amplitude",),
        by="curve_regime",
        marks=("curve_fold",),
        log="auto",
        caption="Half the peak-to-peak motion at the output over the drive; vertical lines: the curve turns back.",
    ),
    Chart(
        "Frequency of the decay",
        "decay_amplitude",
        ("decay_frequency",),
        log="x",
        caption="Frequency of the released output against its amplitude.",
    ),
    Chart(
        "Damping of the decay",
        "decay_amplitude",
        ("decay_damping",),
        log="x",
        caption="Damping ratio, structure and friction together, against the amplitude.",
    ),
    Chart(
        "Frequency response H1",
        "frequency",
        ("gain",),
        log="xy",
        marks=("gain_peak",),
        caption="Displacement of the output divided by the acceleration of the base; the vertical line is the peak.",
    ),
    Chart(
        "Coherence", "frequency", ("coherence",), log="x", caption="Coherence of drive and output."
    ),
    Chart(
        "Spectral density",
        "frequency",
        ("absolute_acceleration_spectrum", "base_acceleration_spectrum"),
        log="xy",
        labels=("", "spectral density"),
        caption="One-sided spectral densities of the accelerations of output and base.",
    ),
    Chart(
        "Levels of the drive",
        "level_drive",
        ("level_relative_displacement_amplitude",),
        "points",
        by="level_stuck",
        labels=("drive", "amplitude"),
        caption="Amplitude at the end of each level; each level starts from the final state of the one before.",
    ),
    Chart(
        "Against the measurement: acceleration",
        "measured_input",
        ("measured_acceleration", "computed_acceleration@computed_input"),
        "points",
        labels=("base acceleration", "indicated acceleration"),
        caption="Readings at the drive frequency, and what the sensors would indicate in the computed motion.",
    ),
    Chart(
        "Against the measurement: displacement",
        "measured_input",
        ("measured_displacement", "computed_displacement@computed_input"),
        "points",
        labels=("base acceleration", "indicated displacement"),
        caption="Readings at the drive frequency, and what the sensors would indicate in the computed motion.",
    ),
    Chart(
        "Pressure on the interface",
        "x",
        ("normal_stress",),
        "area",
        "contact",
        caption="Normal stress at the end of the run, compression positive; only the part in contact.",
    ),
    Chart(
        "Shear stress on the interface",
        "x",
        ("shear_stress",),
        "map",
        "contact",
        caption="Frictional shear stress over x and the frames of the last cycle.",
    ),
    Chart(
        "Where it sticks and slips",
        "x",
        ("status",),
        "map",
        "contact",
        caption="State of each node in the frames of the last cycle.",
    ),
    Chart("Gap", "x", ("gap",), caption="Gap between the loaded surfaces at the end of the run."),
    Chart(
        "Whole run",
        "time",
        ("relative_displacement",),
        span="run",
        caption="Before the last cycles only reversals are stored.",
    ),
    Chart(
        "Energy",
        "time",
        ("energy_dissipated", "energy_stored"),
        labels=("", "energy"),
        caption="Energy dissipated by friction since the start, and elastic energy of the interface.",
    ),
    Chart(
        "Accuracy against time",
        "accuracy_seconds",
        ("accuracy_error",),
        "points",
        log="xy",
        labels=("CPU time", "error of the worst main measure"),
        caption="Estimated error of this run (right) and of the coarser runs, as the tolerance that it would meet.",
    ),
)

SWEEP = (
    Chart(
        "Main measures relative to the first case",
        "",
        (
            "relative_displacement_amplitude",
            "absolute_acceleration_peak",
            "slip_amplitude",
            "loop_area",
            "friction_force_peak",
            "friction_ratio_peak",
            "onset_level",
            "normal_stiffness",
            "tangential_stiffness",
            "contact_fraction",
            "pressure_peak",
            "equivalent_damping",
        ),
        "relative",
        caption="Values of settled and unsettled cases divided by that of the first case; the band is a change of 5 %. "
        "Click on a name to hide its line.",
    ),
    Chart(
        "One measure",
        "",
        (),
        "menu",
        caption="Bars show the numerical error. Hollow points miss the tolerance, crosses mark cases that did not settle.",
    ),
    Chart("One measure over two keys", "", (), "maps", caption="White cells have no value."),
    Chart(
        "Shares of the variance",
        "",
        (),
        "shares",
        caption="Fraction of the variance over the cases that a key contributes: alone (first-order Sobol index), and with "
        "its interactions (total index), with the interval of the latter.",
    ),
)
# Methods of a backbone; the first one with a curve is recommended.
BACKBONE_METHODS = (
    "balance",
    "quasi-static",
    "decay",
)
_METHOD_CURVES = {
    name: tuple(
        f"{method}_{name}@{method}_amplitude".replace("-", "_") for method in BACKBONE_METHODS
    )
    for name in ("frequency", "damping", "force")
}
BACKBONE = (
    Chart(
        "Frequency",
        "balance_amplitude quasi_static_amplitude decay_amplitude",
        _METHOD_CURVES["frequency"],
        log="x",
        y2=("balance_force",),
        labels=("amplitude at the output", "frequency"),
        caption="Where two methods are shown, use the first; its band contains the numerical error and the difference.",
    ),
    Chart(
        "Damping ratio",
        "balance_amplitude quasi_static_amplitude decay_amplitude",
        _METHOD_CURVES["damping"],
        log="x auto",
        labels=("amplitude at the output", "damping ratio"),
        caption="Structure and friction together. Where two methods are shown, use the first, with its band.",
    ),
    Chart(
        "Force of the phase resonance",
        "balance_amplitude quasi_static_amplitude decay_amplitude",
        _METHOD_CURVES["force"],
        log="x y",
        labels=("amplitude at the output", "force at the output"),
        caption="Amplitude of a sinusoidal force at the output, in phase with the velocity there, that holds the amplitude.",
    ),
)
FIT = (
    Chart(
        "Measured and fitted loop",
        "slide",
        ("force", "friction_ratio", "held_out"),
        "points",
        lines=("fitted",),
        labels=("slide", "friction force"),
        caption="Rows of the record, and the fitted loop; rows that are held out are predicted.",
    ),
    Chart(
        "Residuals",
        "row",
        ("residual",),
        "points",
        labels=("row", "fitted - measured"),
        caption="A pattern along the rows is an error of the model; scatter around zero is noise of the record.",
    ),
    Chart(
        "Frequency",
        "amplitude",
        ("frequency",),
        "points",
        log="x",
        lines=("curve_frequency@curve_amplitude",),
        caption="Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.",
    ),
    Chart(
        "Damping ratio",
        "amplitude",
        ("damping",),
        "points",
        log="x auto",
        lines=("curve_damping@curve_amplitude",),
        labels=("", "damping ratio"),
        caption="Measured values with 95 % intervals, and the fitted curve with its 95 % band beyond them.",
    ),
    Chart(
        "Residuals of the frequency",
        "amplitude",
        ("frequency_residual",),
        "points",
        log="x",
        labels=("", "(fitted - measured) / interval"),
        caption="Distances in half-widths of the 95 % intervals.",
    ),
    Chart(
        "Residuals of the damping ratio",
        "amplitude",
        ("damping_residual",),
        "points",
        log="x",
        labels=("", "(fitted - measured) / interval"),
        caption="Distances in half-widths of the 95 % intervals.",
    ),
    *(
        Chart(
            f"Computed against measured {name}",
            name,
            (f"computed_{name}",),
            "points",
            log="xy",
            by="use",
            lines=(f"equal_{name}@equal_{name}",),
            labels=(f"measured {name}", f"computed {name}"),
            caption="On the line both are equal. Rows that are held out are predicted.",
        )
        for name in ("acceleration", "displacement")
    ),
    *(
        Chart(
            f"Ratio of the {name} against the input",
            "input",
            (f"{name}_ratio",),
            "points",
            by="drive",
            log="auto",
            labels=("", f"computed / measured {name}"),
            caption="A trend with the input or the frequency is an error of the model.",
        )
        for name in ("acceleration", "displacement")
    ),
    Chart(
        "Worn depth against the coefficient",
        "coefficient",
        ("depth",),
        "points",
        lines=("curve_depth@curve_coefficient",),
        labels=("wear coefficient", "worn depth"),
        caption="Measured depth at the fitted coefficient, and the computed depth beyond it.",
    ),
)
COST = (
    Chart(
        "Error against time",
        "seconds",
        ("largest_error",),
        "points",
        by="result",
        log="xy",
        lines=("allowed_error@allowed_seconds",),
        labels=("CPU time", "error of the worst measure"),
        caption="Largest relative error of any measure in each run. The line is the tolerance of the scene.",
    ),
    Chart(
        "Value against time",
        "seconds",
        ("main_measure",),
        "points",
        by="result",
        log="x",
        labels=("CPU time", "*"),
        caption="The least accurate of the key measures in each run, with its numerical error.",
    ),
)
COMPARE = (
    Chart(
        "Both traces",
        "x",
        ("before", "after"),
        marks=("track_end",),
        labels=("x of the second trace", "height"),
        caption="The trace measured after wear, moved by shift, tilt and offset onto the one measured before. Vertical "
        "lines: ends of the tracks.",
    ),
    Chart(
        "Worn depth",
        "x",
        ("depth", "hidden_depth"),
        marks=("track_end",),
        labels=("", "worn depth"),
        caption="Depth of the surface after wear below the one before. Vertical lines: ends of the worn parts.",
    ),
    Chart(
        "Both traces, each about its own line",
        "x_before",
        ("trace_before", "trace_after@x_after"),
        labels=("x", "height"),
        caption="No common place was found in the two traces.",
    ),
    Chart(
        "Worn depth",
        "x",
        ("depth_map",),
        "map",
        labels=("", "worn depth"),
        caption="Depth of the second surface below the first, once both are aligned; white: not measured.",
    ),
    Chart(
        "Surface before",
        "x",
        ("before_map",),
        "map",
        labels=("", "height"),
        caption="Before wear; white: not measured.",
    ),
    Chart(
        "Surface after",
        "x",
        ("after_map",),
        "map",
        labels=("", "height"),
        caption="After wear, aligned with the first surface; white: not measured.",
    ),
    Chart(
        "Computed and measured wear",
        "x_patch",
        ("measured_depth", "computed_depth"),
        labels=("x of the patch", "worn depth"),
        caption="Measured depth with its 95 % noise, and that of the run with the fitted wear coefficient.",
    ),
    Chart(
        "Measured less computed wear",
        "x_patch",
        ("depth_difference",),
        "area",
        labels=("x of the patch", "measured less computed"),
        caption="Above zero more wore off than computed.",
    ),
    Chart(
        "Gap of the unloaded surfaces",
        "x",
        ("gap_before", "gap_after"),
        labels=("", "gap"),
        caption="Gap between the pieces without load, wear included.",
    ),
    Chart(
        "Pressure on the interface",
        "x_pressed_before x_pressed_after",
        ("pressure_before@x_pressed_before", "pressure_after@x_pressed_after"),
        labels=("x of the patch", "normal stress"),
        caption="Normal stress of the pressed patch with each of the two surfaces; the mean over strips.",
    ),
    Chart(
        "Friction loops",
        "slide_before slide_after",
        ("force_before@slide_before", "force_after@slide_after"),
        labels=("slide", "friction force"),
        caption="Friction force against the slide of the interface in the last cycle.",
    ),
    Chart(
        "Abbott curves",
        "material_ratio",
        ("abbott_before", "abbott_after"),
        labels=("", "height"),
        caption="Height that a given fraction of the surface exceeds.",
    ),
)
PAIRS = (
    Chart(
        "Worn depth of the pairs",
        "line",
        ("worn_depth_mean",),
        "points",
        labels=("line in the table", "mean worn depth"),
        caption="Mean worn depth of each pair with its 95 % interval.",
    ),
    Chart(
        "Amplitude of the waves",
        "line",
        ("amplitude_ratio",),
        "points",
        labels=("line in the table", "after / before"),
        caption="Amplitude of the waves from 60 to 110 um after wear divided by before, with 95 % intervals.",
    ),
)
PROFILE = (
    Chart(
        "Primary profile",
        "x",
        ("primary", "waviness@x_rough"),
        labels=("", "height"),
        caption="Heights about the subtracted form, and the waviness beyond the cut-off.",
    ),
    Chart(
        "Roughness profile",
        "x_rough",
        ("roughness",),
        labels=("x", "height"),
        caption="Primary profile less waviness; half a cut-off is trimmed at each end.",
    ),
    Chart(
        "Surface",
        "x",
        ("height_map",),
        "map",
        labels=("", "height"),
        caption="Heights from which the parameters are computed.",
    ),
    Chart(
        "Abbott curve",
        "material_ratio",
        ("abbott",),
        "overlay",
        labels=("", "height"),
        caption="Height that a given fraction of the surface exceeds; of the roughness profile if there is a cut-off.",
    ),
    Chart(
        "Power spectral density",
        "wavelength",
        ("density",),
        log="xy",
        caption="One-sided spectral density of the primary profile over the wavelength.",
    ),
)

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

# columns of the tables of pairs, and of several measured surfaces
PAIR_COLUMNS = ("worn_depth_mean", "worn_volume", "track_width", "track_depth", "amplitude_ratio")
FILE_COLUMNS = ("Ra", "Rq", "Rz", "RSm", "Pa", "Pq", "Pt", "Sa", "Sq", "Sz")

# CSV files: kind of answer -> file -> {heading of a column: variable}, groups of variables below each other, or all
# variables of a dimension. A heading may end in a unit of CSV_UNITS.
CURVES: dict[str, dict[str, dict[str, str] | Stack | Rows | Entries]] = {
    "compare": {
        "depth.csv": {
            "x": "x",
            "before": "before",
            "after": "after",
            "gap_before": "gap_before",
            "gap_after": "gap_after",
            "depth": "depth",
        },
        "predicted.csv": {
            "x_patch": "x_patch",
            "measured": "measured_depth",
            "measured_low": "measured_depth_low",
            "measured_high": "measured_depth_high",
            "computed": "computed_depth",
            "difference": "depth_difference",
        },
    },
    "pairs": {
        "pairs.csv": Entries(
            "pairs",
            ("before", "after", "direction", "labels", "outcome", "verdict", "message"),
        )
    },
    "profile": {
        "profile.csv": Entries("profiles", ("file",), "measures"),
        "primary.csv": {"x": "x", "z": "primary"},
        "roughness.csv": {"x": "x_rough", "z": "roughness"},
    },
    "backbone": {
        "backbone.csv": Stack(
            "method",
            BACKBONE_METHODS,
            (
                "amplitude",
                "frequency",
                "frequency_error",
                "damping",
                "damping_error",
                "force",
                "force_error",
                "force_frequency",
                "frequency_low",
                "frequency_high",
                "damping_low",
                "damping_high",
            ),
        )
    },
    "fit": {
        "fitted_curve.csv": {
            "amplitude": "curve_amplitude",
            "frequency": "curve_frequency",
            "frequency_error": "curve_frequency_error",
            "damping": "curve_damping",
            "damping_error": "curve_damping_error",
        },
        "fit.csv": {
            # of a loop
            "time": "time",
            "displacement": "slide",
            "force": "force",
            "friction_ratio": "friction_ratio",
            "fitted": "fitted",
            # of a curve
            "amplitude": "amplitude",
            "frequency": "frequency",
            "frequency_error": "frequency_error",
            "damping": "damping",
            "damping_error": "damping_error",
            "frequency_fitted": "frequency_fitted",
            "damping_fitted": "damping_fitted",
            # of rows
            "input [g]": "input",
            "acceleration [g]": "acceleration",
            "displacement [mil]": "displacement",
            "flag": "flag",
            "computed acceleration [g]": "computed_acceleration",
            "computed displacement [mil]": "computed_displacement",
            "held": "held",
        },
    },
    "cost": {"cost.csv": Rows("run", has_units=False)},
}
CSV_UNITS = {"g": 1 / 9.80665, "mil": 1 / 25.4e-6}  # number of these units in one SI unit

# tables that stand below the charts
RUN_TABLES = (
    Table(
        "Against the measurement",
        "measured",
        (
            Column("reading", "reading"),
            Column("measured", "measured"),
            Column("computed", "computed"),
            Column("ratio", "computed / measured"),
        ),
    ),
    Table(
        "Levels of the drive",
        "level",
        (
            Column("level_drive", "drive"),
            Column("level_relative_displacement_amplitude", "amplitude"),
            Column("level_absolute_acceleration_peak", "peak acceleration"),
            Column("level_acceleration_distortion", "distortion"),
            Column("level_outcome", "outcome"),
            Column("level_stuck", "interface"),
        ),
    ),
)
SWEEP_TABLES = (
    Table(
        "How far the key may go",
        "limits",
        (
            Column("measure", "measure", "name"),
            Column("change", "changes by", "percent"),
            Column("value", "at (between the cases)", "quantity"),
        ),
    ),
    Table(
        "Peaks over the frequency",
        "peaks",
        (
            Column("measure", "measure", "name"),
            Column("case", "at"),
            Column("peak_frequency", "frequency"),
            Column("peak_height", "height"),
            Column("half_power_width", "half-power width"),
        ),
    ),
    Table(
        "Where 90 % of the cases lie",
        "quantiles",
        (
            Column("measure", "measure", "name"),
            Column("low", "5 % are below"),
            Column("median", "half are below"),
            Column("high", "95 % are below"),
        ),
    ),
)
TABLES: dict[str, tuple[Table, ...]] = {
    **dict.fromkeys(("patch", "bench", "rig", "linear"), RUN_TABLES),
    "sweep": SWEEP_TABLES,
    "backbone": (
        Table(
            "Values of the key",
            "table",
            (
                Column("value", "value"),
                Column("stuck_frequency", "frequency with a sticking contact"),
                Column("largest_damping", "largest damping ratio"),
                Column("amplitude_of_largest_damping", "at"),
            ),
        ),
    ),
    "compare": tuple(
        Table(
            title,
            source,
            (
                Column("name", ""),
                Column("before", "before"),
                Column("after", "after"),
                Column("ratio", "after / before"),
                Column("cutoff", "cut-off"),
            ),
        )
        for title, source in (
            ("Roughness inside and outside of the track", "track_roughness"),
            ("Both runs", "measures"),
            ("Scene pressed with each of the two surfaces", "pressed/measures"),
        )
    ),
    "pairs": (
        Table(
            "Means",
            "means",
            (
                Column("group", "group"),
                Column("kind", "kind"),
                Column("direction", "direction"),
                Column("pairs", "pairs"),
                *(Column(name, name.replace("_", " ")) for name in PAIR_COLUMNS),
            ),
        ),
        Table(
            "Each pair",
            "pairs",
            (
                Column("before", "before"),
                Column("after", "after"),
                Column("verdict", "verdict"),
                Column("message", "message"),
                *(Column(name, name.replace("_", " ")) for name in PAIR_COLUMNS),
            ),
        ),
    ),
    "profile": (
        Table(
            "Each file",
            "profiles",
            (Column("file", "file"), *(Column(name, name) for name in FILE_COLUMNS)),
        ),
    ),
}
TABLES["fit"] = (
    Table(
        "Correlation of the fitted values",
        "pair",
        (Column("pair", "values"), Column("correlation", "correlation", "rounded")),
    ),
)
TABLES["cost"] = (
    Table(
        "Runs",
        "run",
        (
            Column("setting", "setting"),
            Column("nodes", "interface nodes"),
            Column("steps", "steps per cycle"),
            Column("seconds", "CPU s", "rounded"),
            Column("largest_error", "largest error", "rounded"),
            Column("worst_measure", "of"),
            Column("main_measure", "value"),
            Column("result", "result"),
        ),
    ),
)
