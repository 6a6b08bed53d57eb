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
        "relative" (measures divided by their first value), "menu" (one measure at a time), "maps" (the same over two keys) or
        "shares" (of the variance).
    span : str
        "all", "cycles" (last three cycles), "run" (all cycles, if there are more) or "contact" (the loaded part of x).
    log : str
        Logarithmic axes: "", "x", "y" or "xy"; "auto" decides by the values.
    by : str
        Variable of codes that colour the points.
    marks : tuple of str
        Variables whose values are vertical lines.
    y2 : tuple of str
        Variables of a second vertical axis.
    labels : tuple of str
        Names of the horizontal and the vertical axis; "" for the name of the variable.
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
    labels: tuple[str, str] = ("", "")
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Column:
    """Column of a table.

    key: key in each row of the details, or name of a variable; title: heading; style: "text", "name" for words with underscores, "quantity" for a number
    with the unit, the error and the interval of its row, or "percent" for a relative change.
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
BACKBONE: tuple[Chart, ...] = ()
COMPARE: tuple[Chart, ...] = ()
PROFILE: tuple[Chart, ...] = ()
FIT: tuple[Chart, ...] = ()
COST: tuple[Chart, ...] = ()

CHARTS: dict[str, tuple[Chart, ...]] = {
    **dict.fromkeys(("patch", "bench", "rig", "linear"), RUN),
    "sweep": SWEEP,
    "backbone": BACKBONE,
    "compare": COMPARE,
    "profile": PROFILE,
    "fit": FIT,
    "cost": COST,
}

# CSV files: kind of answer -> file -> {heading of a column: variable}
CURVES: dict[str, dict[str, dict[str, str]]] = {}

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
            Column("key", "key"),
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
}
