"""Result of a run, with the parts that all kinds of runs have in common.

In: the output of an engine. Out: `Result`, frames of the interface, definitions of measures, and
the numerical settings of the run.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import Outcome
from ...formatting import rewrite_powers_of_ten
from ...response import rows
from . import patch_rows
from .patch_rows import Arrays, Measures, Values

N_FRAMES = 16  # Number of frames of the interface fields in the last cycle.
# Change of slip / largest change; above it, a node without friction limit slips.
MIN_SLIP_FRACTION = 1e-2
TRACTION_ROUND_OFF = 1e-9  # relative rounding error of the tractions and slips of elements
# Entries of `Result.extra` that are settings, with the names under which they are shown.
SHOWN_SETTINGS = {
    "engine": "engine",
    "map": "map",
    "steps": "steps_per_cycle",
    "steps_per_cycle": "steps_per_cycle",
    "harmonics": "harmonics",
    "shear_modes": "shear_modes",
    "elements": "elements",
    "quadrature": "quadrature",
    "window": "window_cycles",
}
# Folder of an absolute path at the start of a remark.
_FOLDER_OF_PATH = re.compile(r"/[^:]*/(?=[^/:]+: )")


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
    def set_key(cls, key: str, value: float, more: str = "") -> "Advice":
        """Return the advice to set a key to a number.

        Parameters
        ----------
        key : str
            Key as the scene writes it, "table.key".
        value : float
            Number in the unit of the key.
        more : str
            Words that follow the value.
        """
        return cls(f"set {key} = {value}{more}", key, value)


class Finding(NamedTuple):
    """What a run found about the accuracy of its measures.

    - words: sentence without the advice.
    - advice: Advice, or None.
    """

    words: str
    advice: Advice | None = None

    @property
    def sentence(self) -> str:
        """Sentence of the warning."""
        return self.words if self.advice is None else f"{self.words}; {self.advice.text}"


@dataclass(frozen=True, eq=False, slots=True)
class RunInputs:
    """Inputs of a run: plan, solved patch, callbacks and whether to estimate errors.

    - plan: Plan to run.
    - patch: solved patch of [contact], or None.
    - coarse: the patch on coarser meshes; None for a missing one.
    - seconds: CPU seconds by step of the run; the run adds its own.
    - warnings: sentences on the scene and the patch.
    - say, progress: callbacks for a line of text and for the completed fraction, or None.
    - estimate: whether to estimate the errors from coarser runs.
    - stiffer: rig and patch with a stiffer joint (`joint.FreeRig`), if a joint was subtracted from the
      modes; else None.
    - faces: pressed interfaces (`interfaces.Face`), with their worn surfaces.
    """

    plan: object
    patch: object
    coarse: tuple
    seconds: Values
    warnings: list[str]
    say: Callable | None
    progress: Callable | None
    estimate: bool
    stiffer: object = None
    faces: tuple = ()


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """Result of a run: measures, histories, fields, warnings and settings.

    - plan: Plan that was run.
    - outcome: how the run ended.
    - measures: Measure by name.
    - response, window: stored histories, and those of the last cycles; None without motion.
    - patch: solved patch, or None.
    - fields: arrays (frame, x) by name, with `time`.
    - seconds: CPU seconds by step of the run.
    - warnings: sentences.
    - extra: engine, steps, notes and other data for the report.
    - findings: `Finding`s on measures that miss the tolerance; `warnings` has their sentences.
    - faces: interfaces of a rig that have a patch of their own (`interfaces.Face`), with their fields.
    - yielding_faces: notes on surfaces that yield under the peak pressure, by Strength.
    """

    plan: object
    outcome: Outcome
    measures: Measures
    response: object
    window: object
    patch: object
    fields: Arrays
    seconds: Values
    warnings: list[str]
    extra: dict
    findings: tuple[Finding, ...] = ()
    faces: tuple = ()
    yielding_faces: dict = field(default_factory=dict)

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
    if name in patch_rows.TABLE:
        return patch_rows.TABLE[name].text

    first = rows.remove_interface_number(name)
    row = patch_rows.TABLE.get(first) or rows.find_definition(name)
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
    """Return the surface at whose points the fields of a patch are given; None without a patch.

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


GRADUAL_SLIP = SlipRule()  # slip rule, after earlier cycles, of a law without friction limit


def make_interface_frames(patch, time, tau, node_slip, slide, rule=GRADUAL_SLIP) -> Arrays:
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


def compute_status(active, tau, slip, rule=GRADUAL_SLIP) -> np.ndarray:
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
    min_fraction = MIN_SLIP_FRACTION if rule.limit is None else TRACTION_ROUND_OFF
    slips = moved > min_fraction * max(moved.max(), 1e-300)
    if rule.limit is not None and not rule.starts_at_rest:
        slips[1] = np.abs(tau[1]) >= (1 - TRACTION_ROUND_OFF) * rule.limit
    return np.where(active, np.where(slips, 2, 1), 0).astype(np.int8)


def can_estimate_mesh_error(model, patch, coarse) -> bool:
    """Return whether the mesh error of a motion can be estimated.

    This requires the patch on a coarser mesh, unless the motion does not depend on the mesh.

    Parameters
    ----------
    model : Model
        Model of a bench or a rig.
    patch : Patch or None
        The patch on its finest mesh; None for a single point ([normal]).
    coarse : sequence
        Patches on coarser meshes; None for a missing one.
    """
    if patch is None or coarse[0] is not None:
        return True
    return not (
        model.partial_slip
        or model.load_varies
        or (model.rig is not None and model.rig.friction.strips_slide_apart)
    )


def collect_used_settings(result) -> dict:
    """Return a dict of the numerical settings that a run used.

    These are the engine, the steps per cycle or the harmonics, the cycles of the window, shear modes
    or elements of the pieces, the summation method for bonds, nodes and strips of the patch, and
    the averaging length [m] of its profile. map: "shooting" if the steady motion was found by Newton's
    method on the map of a period.
    """
    patch = result.patch

    # Settings that the engine does not have are left out; the others are names or counts.
    settings = {}
    for key, name in SHOWN_SETTINGS.items():
        value = result.extra.get(key)
        if value is not None:
            settings[name] = value if isinstance(value, str) else int(value)

    # Resolution of the pressed interfaces.
    for face in result.faces:
        settings[rows.add_interface_number("interface_nodes", face.number)] = int(face.patch.x.size)
    if patch is not None:
        settings["interface_nodes"] = int(patch.x.size)
        if patch.averaging is not None:
            settings["profile_averaging"] = float(patch.averaging)
        strips = result.plan.model.patch.interface.strips
        if strips is not None:
            settings["strips"] = int(strips.count)
    return settings


def engine_by_measure(result) -> dict[str, str]:
    """Return a dict of the engine or method that computed each measure of a run.

    For static measures of a patch it is the method on its meshes (`patch_rows`), for all others the
    engine of the run.
    """
    engines = {}
    for name, measure in result.measures.items():
        engine = measure.engine or result.extra.get("engine", "")
        if engine and measure.value is not None:
            engines[name] = engine
    return engines


def shorten_file_names(texts, path: Path) -> list[str]:
    """Shorten absolute file names and rewrite powers of ten in remarks.

    path: path of the scene; file names become relative to its folder.
    """
    return make_file_name_shortener(path)(texts)


def make_file_name_shortener(path: Path) -> Callable[[Iterable[str]], list[str]]:
    """Return a function that shortens file names in remarks on the scenes of one folder."""
    folders = (path.parent, path.parent.absolute())
    prefixes = [f"{folder}/" for folder in folders if folder.is_absolute()]

    def shorten(texts) -> list[str]:
        """Shorten absolute file names and rewrite powers of ten in remarks."""
        short_texts = []
        for text in texts:
            for prefix in prefixes:
                text = text.replace(prefix, "")
            if text.startswith("/"):
                text = _FOLDER_OF_PATH.sub("", text, count=1)
            short_texts.append(rewrite_powers_of_ten(text))
        return short_texts

    return shorten
