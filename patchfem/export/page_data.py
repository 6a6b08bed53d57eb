"""Data for the page and the pictures of a run, as arrays and strings in SI units."""

import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..core import PatchfemError, SineDrive
from ..inputs import loops, measured
from ..response import spectrum
from ..runs.accuracy_curve import compute_accuracy_curve
from ..runs.results.result import Result, patch_surface
from ..structure import drive_sizes
from .histories import largest_multiplier
from .pages.driven import describe_drive, run_command
from .pages.released import describe_release
from .pages.sentences import verdict_sentence
from .summary import count_cycles, package_versions, summarise_run


@dataclass(frozen=True, eq=False, slots=True)
class SceneText:
    """Scene of a run as text: as written, with all defaults, and the command-line keys."""

    name: str
    text: str
    resolved: str
    sets: tuple = ()
    driven: str = ""
    command: str = ""


@dataclass(frozen=True, eq=False, slots=True)
class Verdict:
    """Summary of a run with the sentence on its outcome.

    Attributes
    ----------
    summary : dict
        Content of summary.json.
    sentence : str
        How the run ended.
    cycles : float or None
        Cycles of the drive; None for a run without cycles.
    released : str
        Motion of a released output.
    steady : dict or None
        `regime` and `multiplier` of a steady motion that was found directly.
    engine : str
    means : dict
        {measure: its definition}.
    """

    summary: dict
    sentence: str
    cycles: float | None = None
    released: str = ""
    steady: dict | None = None
    engine: str = ""
    means: dict = field(default_factory=dict)

    def is_part_of_cycle(self) -> bool:
        """Return whether the run ended before its first cycle was complete."""
        return self.cycles is not None and self.cycles < 1 - 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class PressedPatch:
    """Solved patch that a page shows; the fields are empty if the run has no patch.

    Attributes
    ----------
    x : (m,) ndarray or None
        Positions along the interface [m]; None if there is no patch.
    width : float or None
        [m].
    fields : dict
        {name: (f, m)} over the frames at `time` (f,).
    faces : list
        (x, fields, name) of each interface that has a patch of its own.
    """

    x: np.ndarray | None = None
    width: float | None = None
    fields: dict = field(default_factory=dict)
    faces: list = field(default_factory=list)

    def touches(self) -> bool:
        """Return whether the two pieces touch anywhere."""
        return (
            self.x is not None
            and bool(self.fields)
            and bool(np.any(self.fields["normal_stress"][0] > 0))
        )


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """Histories of a run that its page shows.

    Attributes
    ----------
    history : dict
        `time`, `displacement` and `force` of the whole run; `measured` (time, force) if a file has
        them.
    loop : dict
        `slide`, `force` and `time` of the friction loop; `each`: (name, slide, force) of several
        interfaces.
    window : dict or None
        The last cycles of a rig; None for a bench.
    period : float or None
        [s].
    recorded : tuple or None
        (file name, slide, force) of a measured loop.
    """

    history: dict
    loop: dict
    window: dict | None = None
    period: float | None = None
    recorded: tuple | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Wear:
    """Wear of a patch that its page shows.

    history: measures over the cycles; states: profiles; period: of a cycle [s].
    """

    history: dict
    states: dict
    period: float


@dataclass(frozen=True, eq=False, slots=True)
class Evaluations:
    """Curves, levels, spectra and decay of a run, each of them None if the run has none."""

    curve: object = None
    decay: object = None
    spectra: object = None
    levels: list | None = None
    wear: Wear | None = None
    accuracy: object = None


@dataclass(frozen=True, eq=False, slots=True)
class Measured:
    """Measured responses that are compared with a run.

    Attributes
    ----------
    rows : list
        Rows of the table.
    gains : tuple
        Indicated per true amplitude, of the accelerometer and of the displacement gauge.
    frequency, input : float or None
        Of the drive [Hz], [m s-2].
    reading : str
        Amplitude measure that the accelerometer indicates, such as "peak".
    reading_factor : float
        Indicated amplitude relative to the peak.
    """

    rows: list
    gains: tuple
    frequency: float | None = None
    input: float | None = None
    reading: str = "peak"
    reading_factor: float = 1.0

    def is_comparable(self) -> bool:
        """Return whether the drive signal has a frequency, so that measured rows can be compared with the run."""
        return self.input is not None and self.frequency is not None

    def factors(self) -> tuple:
        """Return the readings of the sensors per unit of peak acceleration and of peak displacement."""
        acceleration, displacement = self.gains
        return acceleration * self.reading_factor, displacement


@dataclass(frozen=True, eq=False, slots=True)
class RunData:
    """Data that the page of a run shows."""

    source: SceneText
    verdict: Verdict
    versions: dict
    patch: PressedPatch = field(default_factory=PressedPatch)
    motion: Motion | None = None
    evaluations: Evaluations = field(default_factory=Evaluations)
    measured: Measured | None = None


def collect_run_data(result: Result) -> RunData:
    """Collect the data of the page of a run."""
    source = result.plan.model.source
    tables = tomllib.loads(source.resolved)
    motion = None
    if result.response is not None:
        motion = (
            _bench_motion(result, tables) if result.plan.kind == "bench" else _rig_motion(result)
        )
    return RunData(
        source=SceneText(
            source.path.stem,
            source.text,
            source.resolved,
            source.sets,
            describe_drive(tables),
            run_command(source.path, source.sets),
        ),
        verdict=_collect_verdict(result),
        versions=package_versions(),
        patch=_collect_patch(result),
        motion=motion,
        evaluations=_collect_evaluations(result),
        measured=_measured_responses(result),
    )


def _collect_verdict(result: Result) -> Verdict:
    """Return the summary and the outcome of a run."""
    summary = summarise_run(result)
    steady = None
    if "regime" in result.extra:
        steady = {"regime": result.extra["regime"], "multiplier": largest_multiplier(result.extra)}
    return Verdict(
        summary=summary,
        sentence=verdict_sentence(summary),
        cycles=count_cycles(result),
        released=describe_release(result),
        steady=steady,
        engine=result.extra.get("engine", ""),
        means={name: measure.text for name, measure in result.measures.items()},
    )


def _collect_patch(result: Result) -> PressedPatch:
    """Return the solved patch of a run with its fields."""
    faces = [
        (face.surface.x, face.fields, f"interface {face.name}")
        for face in result.extra.get("faces", ())
    ]
    if result.patch is None:
        return PressedPatch(fields=result.fields, faces=faces)
    fields = result.fields
    # The first frames show the states of the wear, later ones the worn patch.
    if "wear" in result.extra:
        count = result.extra["wear_shown"]["states"]
        fields = {name: rows[count:] for name, rows in fields.items()}
        fields["time"] = fields["time"] - fields["time"][0]
    return PressedPatch(
        patch_surface(result.patch, result.fields).x,
        result.plan.model.patch.pieces.width,
        fields,
        faces,
    )


def _collect_evaluations(result: Result) -> Evaluations:
    """Return the curves, levels, spectra and decay of a run."""
    extra = result.extra
    levels = None
    wear = None
    if "levels" in extra:
        names = ("drive", "stuck", "values", "errors", "unit", "outcome")
        levels = [{name: getattr(level, name) for name in names} for level in extra["levels"]]
    if "wear" in extra:
        count = extra["wear_shown"]["states"]
        states = {name: rows[: count + 1] for name, rows in result.fields.items()}
        wear = Wear(extra["wear"], states, extra["wear_shown"]["period"])
    return Evaluations(
        extra.get("curve"),
        extra.get("decay"),
        extra.get("spectra"),
        levels,
        wear,
        compute_accuracy_curve(result),
    )


def _bench_motion(result: Result, tables: dict) -> Motion:
    """Return the histories of a bench run for its page."""
    response = result.response
    history = {"time": response.time, "displacement": response.slide, "force": response.force}
    loop = _trace_loop(result)
    recorded = None
    recorded_loop = _read_recorded_loop(
        result.plan.model.source.path.parent, tables["slide"], response
    )
    if recorded_loop is not None:
        time, slide, force = recorded_loop
        history["measured"] = time, force
        recorded = Path(tables["slide"]["file"]).name, slide, force
    return Motion(history, loop, recorded=recorded)


def _trace_loop(result: Result) -> dict:
    """Return slide, force and time of the friction loop, with the jumps of the force of a rigid interface.

    The force after a sample acts from the sample on, so a jump is drawn at the slide of the sample before it.
    """
    window = result.window
    loop = {"slide": window.slide, "force": window.force, "time": window.time}
    if not result.plan.model.sticks_rigidly:
        return loop
    rows = np.arange(window.force.size)
    before = np.flatnonzero(np.diff(np.sign(window.force)))
    rows_of_force = np.insert(rows, before + 1, before + 1)
    rows = np.insert(rows, before + 1, before)
    return {
        "slide": window.slide[rows],
        "force": window.force[rows_of_force],
        "time": window.time[rows],
    }


def _read_recorded_loop(folder: Path, slide: dict, response) -> tuple | None:
    """Read times [s], displacements [m] and forces [N] from the slide file; None if it contains no forces."""
    if slide["kind"] != "file":
        return None
    try:
        recorded_loop = loops.read_loop(folder / slide["file"])
    except PatchfemError:
        # The file contains no loop; errors in its path were reported when the path was read.
        return None
    if recorded_loop.time is None:
        return None
    load = (
        1.0
        if recorded_loop.quantity == "force"
        else np.interp(recorded_loop.time, response.time, response.load)
    )
    return recorded_loop.time, recorded_loop.displacement, recorded_loop.reading * load


def _rig_motion(result: Result) -> Motion:
    """Return the histories of a rig run for its page."""
    response = result.response
    window = result.window
    rig = result.plan.model.rig
    loop = _trace_loop(result)
    if rig.friction.names and "slides" in window.extra:
        loop["each"] = list(
            zip(rig.friction.names, window.extra["slides"].T, window.extra["forces"].T)
        )
        for k, (name, interface) in enumerate(zip(rig.friction.names, rig.friction.interfaces)):
            if interface.lateral:
                loop["each"].append(
                    (
                        f"{name}, across: {interface.lateral}",
                        window.extra["lateral_slides"][:, k],
                        window.extra["lateral_forces"][:, k],
                    )
                )
    return Motion(
        history={"time": response.time, "displacement": response.output, "force": response.force},
        loop=loop,
        window={
            "time": window.time,
            "displacement": window.output,
            "acceleration": window.acceleration,
            "base": window.base_acceleration,
            "force": window.force,
            "slide": window.slide,
        },
        period=result.extra["period"],
    )


def _measured_responses(result: Result) -> Measured | None:
    """Return the measured responses that the scene contains, or None if it contains none."""
    model = result.plan.model
    if model.measured is None:
        return None
    path, gains, kind, cutoff = model.measured
    responses = Measured(measured.read_table(path), gains)
    rig = model.rig
    if rig is None:
        return responses
    responses = replace(
        responses,
        frequency=rig.drive.frequency,
        input=drive_sizes.find_max_acceleration(rig.drive.signal),
    )
    acceleration = result.measures.get("absolute_acceleration_peak")
    if kind == "peak" or not isinstance(rig.drive.signal, SineDrive) or acceleration is None:
        return responses
    peak = acceleration.value
    return replace(
        responses,
        reading=kind,
        reading_factor=spectrum.read_instrument(result.window, rig.drive.signal, peak, kind, cutoff)
        / peak,
    )
