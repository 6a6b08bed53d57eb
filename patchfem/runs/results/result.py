"""Result of a run, with the parts that all kinds of runs have in common.

In: the output of an engine. Out: `Result`, frames of the interface, definitions of measures, and
the numerical settings of the run.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ... import measures as run_measures
from ...core import (
    Measure,
    Outcome,
    Response,
    add_interface_number,
    array_dataclass,
    remove_interface_number,
)
from ...formatting import rewrite_powers_of_ten
from ...scene import refuse_attribute
from . import patch_rows
from .patch_rows import Arrays, Measures, Values

N_INTERFACE_FRAMES = 16  # Number of frames of the interface fields in the last cycle.
TRACTION_ROUND_OFF = 1e-9  # relative rounding error of the tractions and slips of elements
# Outcomes of motions without a periodic cycle.
UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
    Outcome.NOT_CONVERGED,
)
# Folder of an absolute path at the start of a remark; on Windows a path starts with the letter of its drive.
_FOLDER_OF_PATH = re.compile(r"(?:[A-Za-z]:[\\/]|/)[^:]*[\\/](?=[^\\/:]+: )")


class Advice(NamedTuple):
    """What a user may do about a finding.

    - text: clause with the key and its value.
    - key: key of the scene, "" if no key helps.
    - value: proposed value; None if the key is to be left out or changed otherwise.
    - axis: axis of the resolution that the key refines, such as "mesh" or "steps".
    """

    text: str
    key: str = ""
    value: float | None = None
    axis: str = ""

    @classmethod
    def set_key(cls, key: str, value: float) -> "Advice":
        """Return the advice to set a key, "table.key", to a number in the unit of the key."""
        return cls(f"set {key} = {value}", key, value)


class AccuracyFinding(NamedTuple):
    """What a run found about the accuracy of its measures.

    - words: sentence without the advice.
    - advice: Advice, or None.
    """

    words: str
    advice: Advice | None = None

    @property
    def sentence(self) -> str:
        """Finding as a sentence, with its advice, if there is any, after a semicolon."""
        return self.words if self.advice is None else f"{self.words}; {self.advice.text}"


class Shortage(NamedTuple):
    """Refinement that a limit of the scene ended before the main measures met the tolerance.

    - axis: axis that was not refined further, such as "mesh" or "steps".
    - needed: expected CPU time [s] of a run that meets the tolerance, or memory [bytes] of the next pass.
    - key: scene key of the limit.
    """

    axis: str
    needed: float
    key: str = "accuracy.max_seconds"


@array_dataclass
class RunInputs:
    """Inputs of a run: plan, pressed interfaces, and the limits and callbacks of its caller.

    - plan: Plan to run.
    - faces: pressed interfaces (`interfaces.PressedFace`), with their worn surfaces.
    - seconds: CPU seconds by step of the run; the run adds its own.
    - warnings, notes: sentences on the scene and the patch.
    - control: `refine.RunControl`, what the caller has set.
    - stiffer: rig and patch with a stiffer joint, if a joint was subtracted from the modes; else None.
    """

    plan: object
    faces: tuple
    seconds: Values
    warnings: list[str]
    notes: list[str]
    control: object
    stiffer: object = None

    @property
    def patches(self) -> Sequence:
        """Patch of the table [contact] on its meshes, from fine to coarse; None for a missing one."""
        has_table = self.plan.model.patch is not None
        return self.faces[0].patches if has_table else (None, None, None)

    @property
    def patch(self):
        """Patch of the table [contact] on its finest mesh; None without that table."""
        return self.patches[0]

    @property
    def coarse(self) -> Sequence:
        """Patch of the table [contact] on coarser meshes."""
        return self.patches[1:]

    @property
    def n_coarse(self) -> int:
        """Number of coarser meshes on which the patch of the table [contact] is solved."""
        return sum(patch is not None for patch in self.coarse)

    @property
    def has_error_meshes(self) -> bool:
        """Whether each patch on whose mesh the motion depends is solved on a coarser mesh too."""
        depends = self.plan.model.motion_depends_on_mesh
        moving = [face for face in self.faces if depends or face.depends_on_pressure]
        return all(face.patches[1] is not None for face in moving)


class Settings(NamedTuple):
    """Numerical settings that a run used, each None if its engine does not have it.

    - engine: name of the engine.
    - map: "shooting" if the steady motion was found by Newton's method on the map of a period.
    - steps_per_cycle: resolution in time.
    - shear_modes, elements: number of shear modes or of parallel elements of the pieces.
    - quadrature: summation method for bonds.
    - window_cycles: cycles of the window.
    """

    engine: str | None = None
    map: str | None = None
    steps_per_cycle: int | None = None
    shear_modes: int | None = None
    elements: int | None = None
    quadrature: str | None = None
    window_cycles: int | None = None


class SteadyData(NamedTuple):
    """Regime and stability of a periodic motion, and the response curve of which it is the largest.

    - regime: name of the motion, such as "stick-slip".
    - multipliers (m,): Floquet multipliers.
    - residual: change over a period relative to the motion; NaN if unknown.
    - curve: columns of the response curve by name (`steady.curves.tabulate_curve`); None for a single frequency.
    - width: half-power width of the curve; None for a single frequency, or if the curve is not drawn.
    """

    regime: str
    multipliers: np.ndarray
    residual: float = np.nan
    curve: Arrays | None = None
    width: Measure | None = None


class MotionData(NamedTuple):
    """What a run knows of its motion beside measures and histories, each empty or None if there is nothing.

    - settings: Settings.
    - energies: energies [J] and counters by name.
    - step_runs: `errors.StepRun` of the run and of its runs with fewer steps, from fine to coarse.
    - levels: `events.DriveLevel` of each drive level.
    - events: stick-slip Events.
    - decay: DecayCurve of a release.
    - spectra: Spectra under a random drive.
    - steady: SteadyData of a periodic motion.
    """

    settings: Settings = Settings()
    energies: Values = MappingProxyType({})
    step_runs: "tuple[run_measures.errors.StepRun, ...]" = ()
    levels: "tuple[run_measures.events.DriveLevel, ...]" = ()
    events: "run_measures.events.Events | None" = None
    decay: "run_measures.decay_curve.DecayCurve | None" = None
    spectra: "run_measures.stationary.Spectra | None" = None
    steady: SteadyData | None = None


class StoredHistories(NamedTuple):
    """Histories of a motion; None without motion.

    - response, window: stored histories, and those of the last cycles.
    - period: period of the drive [s]; None of a bench.
    """

    response: Response | None = None
    window: Response | None = None
    period: float | None = None


class WornStates(NamedTuple):
    """States of wear, of which some have frames before those of the last cycle.

    - columns: measures over the cycles of wear (j,) by name.
    - n_frames: number of states with a frame.
    - period: time of a cycle [s].
    """

    columns: Arrays
    n_frames: int
    period: float


class ContactData(NamedTuple):
    """Pressed pieces of a run, and their fields.

    - patch: solved patch, or None.
    - fields: arrays (frame, x) by name, with `time`.
    - faces: interfaces of a rig that have a patch of their own (`interfaces.PressedFace`), with their fields.
    - wear: WornStates of the patch, or None.
    """

    patch: object = None
    fields: Arrays = MappingProxyType({})
    faces: tuple = ()
    wear: WornStates | None = None


class Statements(NamedTuple):
    """What a run says in words.

    - warnings, notes: sentences.
    - findings: `AccuracyFinding`s on measures that miss the tolerance; `warnings` has their sentences.
    - yielding_faces: notes on surfaces that yield under the peak pressure, by Strength.
    - shortage: Shortage if accuracy.max_seconds or accuracy.max_memory ended the refinement, else None.
    """

    warnings: list[str]
    notes: list[str]
    findings: tuple[AccuracyFinding, ...] = ()
    yielding_faces: dict = MappingProxyType({})
    shortage: Shortage | None = None


@array_dataclass
class Result:
    """Result of a run: measures, histories, fields, warnings and settings.

    The fields of its records `statements`, `contact` and `histories`, and `motion.settings`, are attributes too.

    - plan: Plan that was run.
    - outcome: how the run ended.
    - measures: Measure by name.
    - seconds: CPU seconds by step of the run.
    - statements: Statements.
    - contact: ContactData.
    - histories: StoredHistories.
    - motion: MotionData.
    """

    plan: object
    outcome: Outcome
    measures: Measures
    seconds: Values
    statements: Statements
    contact: ContactData = ContactData()
    histories: StoredHistories = StoredHistories()
    motion: MotionData = MotionData()

    __getattr__ = refuse_attribute

    warnings = property(lambda self: self.statements.warnings)
    notes = property(lambda self: self.statements.notes)
    findings = property(lambda self: self.statements.findings)
    yielding_faces = property(lambda self: self.statements.yielding_faces)
    shortage = property(lambda self: self.statements.shortage)
    patch = property(lambda self: self.contact.patch)
    fields = property(lambda self: self.contact.fields)
    faces = property(lambda self: self.contact.faces)
    wear = property(lambda self: self.contact.wear)
    response = property(lambda self: self.histories.response)
    window = property(lambda self: self.histories.window)
    settings = property(lambda self: self.motion.settings)

    def with_changes(self, **values) -> "Result":
        """Return a Result with other values of its fields or of those of `statements` and `contact`."""
        for name in ("statements", "contact"):
            record = values.get(name, getattr(self, name))
            own = {key: values.pop(key) for key in record._fields if key in values}
            values[name] = record._replace(**own)
        return replace(self, **values)

    def __repr__(self) -> str:
        measures = _format_count(len(self.measures), "measure")
        warnings = _format_count(len(self.warnings), "warning")
        return (
            f"Result of {self.plan.model.source.path.name}, {self.outcome}: {self.outcome.sentence}\n"
            f"  {measures} and {warnings}, {self.seconds.get('total', 0.0):.2f} s"
        )


def _format_count(count: int, word: str) -> str:
    """Return a count with its noun, such as "no warnings" or "2 warnings"."""
    return f"{count or 'no'} {word}{'s' * (count != 1)}"


def describe_measure(name: str, numbered_kind: str = "interface") -> str:
    """Return the definition of a measure in one sentence without full stop.

    A numbered name such as slip_amplitude_2 belongs to the second interface, or to the second of
    the objects that `numbered_kind` names.
    """
    if name in patch_rows.PATCH_TABLE:
        return patch_rows.PATCH_TABLE[name].text

    first = remove_interface_number(name)
    row = patch_rows.PATCH_TABLE.get(first) or run_measures.rows.find_definition(name)
    return row.text + (
        "" if first == name else f"; of {numbered_kind} {name.removeprefix(first + '_')}"
    )


def collect_rest_frame(patch) -> Arrays:
    """Return the fields of a solved patch without motion as a single frame (1, n).

    The fields are normal_stress [Pa], gap [m] and status of the finest solution, which is on the
    points of a profile if there is one.
    """
    return _make_surface_frame(patch.finest_surface)


def _make_surface_frame(surface) -> Arrays:
    """Return pressure, gap and contact status (1, n) at the points of a surface."""
    return {
        "time": np.zeros(1),
        "normal_stress": surface.sigma_n[None],
        "gap": surface.gap[None],
        "status": (surface.sigma_n > 0).astype(np.int8)[None],
    }


def patch_surface(patch, fields: Arrays):
    """Return the points at which the fields of a patch are given, with pressure and gap; None without a patch.

    After a motion these are the nodes of the mesh, otherwise the points of `collect_rest_frame`.
    """
    if patch is None:
        return None
    return patch.surface if "shear_stress" in fields else patch.finest_surface


class SlipRule(NamedTuple):
    """Rule by which the nodes of an interface count as slipping in a frame.

    - limit (m,): traction [Pa] at which a node slips, of a law that reaches it exactly; None for
      other laws, whose slip changes a little at every node.
    - starts_at_rest: whether the first frame of the motion follows the pressed pieces, without
      earlier cycles between them.
    """

    limit: np.ndarray | None = None
    starts_at_rest: bool = False


# Slip rule for laws without a friction limit, if earlier cycles precede the first frame
GRADUAL_SLIP_RULE = SlipRule()


def make_interface_frames(patch, time, tau, node_slip, slide, rule=GRADUAL_SLIP_RULE) -> Arrays:
    """Return the fields of an interface in all frames of a motion, after the pressed state.

    Parameters
    ----------
    patch : Patch
        Solved patch of the interface.
    time : (f,)
        [s].
    tau, node_slip : (f, m)
        Traction [Pa] and slip [m] of the nodes.
    slide : (f,)
        Displacement of the upper holder [m].
    rule : SlipRule
        What counts as slip.

    Returns
    -------
    dict
        Arrays (f + 1, m); status as in `compute_status`.
    """
    first = _make_surface_frame(patch.surface)
    count = len(time) + 1
    tau = np.concatenate([np.zeros((1, tau.shape[1])), tau])
    slip = np.concatenate([np.zeros((1, node_slip.shape[1])), node_slip])
    return {
        "time": np.concatenate([[0.0], time]),
        "normal_stress": np.repeat(first["normal_stress"], count, axis=0),
        "gap": np.repeat(first["gap"], count, axis=0),
        "shear_stress": tau,
        "slip": slip,
        "status": compute_status(patch.active, tau, slip, rule),
        "holder_slide": np.concatenate([[0.0], slide]),
    }


def compute_status(active, tau, slip, rule=GRADUAL_SLIP_RULE) -> np.ndarray:
    """Return the contact status of the nodes in each frame: 0 for open, 1 for stick, 2 for slip.

    A node slips if its slip has changed since the previous frame. In the first frame of a motion after earlier
    cycles, it slips if its traction is at the friction limit.

    Parameters
    ----------
    active : (m,) or (f, m)
        Whether a node carries load.
    tau, slip : (f, m)
        Traction [Pa] and slip [m]; the first frame is that of the pressed pieces.
    rule : SlipRule
        What counts as slip.
    """
    moved = np.abs(np.diff(slip, axis=0, prepend=slip[:1]))
    if not rule.starts_at_rest:
        moved[1] = 0.0
    # Change of slip / largest change; above it, a node without friction limit slips.
    min_fraction = 1e-2 if rule.limit is None else TRACTION_ROUND_OFF
    slips = moved > min_fraction * max(moved.max(), 1e-300)
    if rule.limit is not None and not rule.starts_at_rest:
        slips[1] = np.abs(tau[1]) >= (1 - TRACTION_ROUND_OFF) * rule.limit
    return np.where(active, np.where(slips, 2, 1), 0).astype(np.int8)


def collect_used_settings(result) -> dict[str, str | float]:
    """Return the numerical settings that a run used, by name.

    Besides those of `Settings`, they contain the resolution of its patches: the nodes of each interface, and the length [m]
    over which its profile is averaged.
    """
    patch = result.patch
    used = result.settings._asdict()
    settings = {name: value for name, value in used.items() if value is not None}

    # Resolution of the pressed interfaces.
    for face in result.faces:
        settings[add_interface_number("interface_nodes", face.number)] = int(face.patch.x.size)
    if patch is not None:
        settings["interface_nodes"] = int(patch.x.size)
        if patch.averaging is not None:
            settings["profile_averaging"] = float(patch.averaging)
    return settings


def engine_by_measure(result) -> dict[str, str]:
    """Return a dict of the engine or method that computed each measure of a run.

    For static measures of a patch it is the method on its meshes (`patch_rows`), for all others the
    engine of the run.
    """
    engines = {}
    for name, measure in result.measures.items():
        engine = measure.engine or result.settings.engine
        if engine and measure.value is not None:
            engines[name] = engine
    return engines


def shorten_file_names(texts: Iterable[str], path: Path) -> list[str]:
    """Shorten absolute file names and rewrite powers of ten in remarks.

    File names become relative to the folder of the scene, whose path is `path`.
    """
    folders = (path.parent, path.parent.absolute())
    prefixes = [str(folder / "x")[:-1] for folder in folders if folder.is_absolute()]
    short_texts = []
    for text in texts:
        for prefix in prefixes:
            text = text.replace(prefix, "")
        if match := _FOLDER_OF_PATH.match(text):
            text = text[match.end() :]
        short_texts.append(rewrite_powers_of_ten(text))
    return short_texts
