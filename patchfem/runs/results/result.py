"""The result of a run, with the parts that every kind of run shares."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...core import Outcome
from ...formatting import rewrite_powers_of_ten
from ...response import rows
from . import patch_rows

FRAMES = 16  # of the interface, in the last cycle
COUNTS = ("steps_per_cycle", "harmonics", "shear_modes", "elements")
_BEFORE = re.compile(r"/[^:]*/(?=[^/:]+: )")  # of an absolute path at the start of a remark


@dataclass(frozen=True, eq=False, slots=True)
class Result:
    """Everything that a run found.

    plan: the Plan that was run; measures: name -> Measure; response: kept histories or None; patch: the solved patch or
    None; fields: (frame, x) arrays by name with `time`; seconds by part; extra: engine, steps, notes for the report.
    """

    plan: object
    outcome: Outcome
    measures: dict
    response: object
    window: object
    patch: object
    fields: dict
    seconds: dict
    warnings: list
    extra: dict

    def __repr__(self) -> str:
        counts = [
            f"{len(found) or 'no'} {word}{'s' * (len(found) != 1)}"
            for found, word in ((self.measures, "measure"), (self.warnings, "warning"))
        ]
        return (
            f"Result of {self.plan.model.source.path.name}, {self.outcome}: {self.outcome.sentence}\n"
            f"  {' and '.join(counts)}, {self.seconds.get('total', 0.0):.2f} s"
        )


def with_meanings(measures: dict, apart: str) -> dict:
    """The measures by name, with their meanings.

    apart: what a number behind a name counts, "interface" or "strip".
    """
    return {name: replace(m, text=meaning(name, apart)) for name, m in measures.items()}


def meaning(name: str, apart: str = "interface") -> str:
    """Meaning of a measure by its name in a summary, in one sentence without a stop.

    slip_amplitude_2 is that of the second interface, or of what `apart` names.
    """
    if name in patch_rows.TABLE:
        return patch_rows.TABLE[name].text

    first = rows.of_first(name)
    row = patch_rows.TABLE.get(first) or rows.row_of(name)
    return row.text + ("" if first == name else f"; of {apart} {name.removeprefix(first + '_')}")


def at_rest(patch) -> dict:
    """Fields of the pressed patch without motion: normal_stress [Pa], gap [m] and status, (1, n) each.

    They are those of its finest solution, on the points of a trace where it has these.
    """
    return _pressed_frame(patch.fine or patch.on_mesh)


def _pressed_frame(surface) -> dict:
    """Fields of a pressed Surface, (1, n) each."""
    return {
        "time": np.zeros(1),
        "normal_stress": surface.sigma_n[None],
        "gap": surface.gap[None],
        "status": (surface.sigma_n > 0).astype(np.int8)[None],
    }


def surface_of(patch, fields: dict):
    """The Surface of a pressed patch on whose points its fields are given; None without a patch.

    A motion moves the nodes of the mesh. Without one the fields are those of `at_rest`.
    """
    if patch is None or patch.fine is None or "shear_stress" in fields:
        return patch and patch.on_mesh
    return patch.fine


def frames_of(patch, time, tau, local, slide) -> dict:
    """Frames of the interface: the pressed state first, then the given ones; status 0 open, 1 stick, 2 slip.

    slide (f,): motion of the upper holder [m] in the given frames.
    """
    first = _pressed_frame(patch.on_mesh)
    count = len(time) + 1
    tau = np.concatenate([np.zeros((1, tau.shape[1])), tau])
    slip = np.concatenate([np.zeros((1, tau.shape[1])), local])
    moved = np.abs(np.diff(slip, axis=0, prepend=slip[:1]))
    moved[:2] = 0.0  # the first moving frame has no frame before it to slip from
    status = np.where(
        patch.active, np.where(moved > 1e-2 * max(moved.max(), 1e-300), 2, 1), 0
    ).astype(np.int8)
    return {
        "time": np.concatenate([[0.0], time]),
        "normal_stress": np.repeat(first["normal_stress"], count, axis=0),
        "gap": np.repeat(first["gap"], count, axis=0),
        "shear_stress": tau,
        "slip": slip,
        "status": status,
        "holder_slide": np.concatenate([[0.0], slide]),
    }


def on_a_mesh_of_known_error(model, patch, coarse) -> bool:
    """Whether there is a coarser patch to tell the error of a motion that hangs on the mesh of its own; coarse: patches
    on coarser meshes, None where there is none. True of a motion that hangs on none."""
    if patch is None or coarse[0] is not None:
        return True
    return not (
        model.partial_slip
        or model.load_varies
        or (model.rig is not None and model.rig.friction.strips_slide_apart)
    )


def without_errors(found: dict, estimate: bool) -> dict:
    """The measures as they are, or without their errors where none were estimated."""
    return found if estimate else {k: replace(m, error=None) for k, m in found.items()}


def choices(result) -> dict:
    """Engine, steps per cycle or those that a tolerance chose, cycles and window of a run, shear modes or elements
    behind the pieces' shear, how bonds are summed, and interface nodes and strips of its patch,
    and the length [m] that its profile is averaged over.

    map: "events" or "yields" that a steady motion was found by. A choice that the run did not make is left out.
    """
    extra, patch, out = result.extra, result.patch, {}
    if (engine := extra.get("engine")) is not None:
        out["engine"] = engine
    if (found := extra.get("map")) is not None:
        out["map"] = found
    steps = extra.get("steps")
    if steps is not None:
        out["steps_per_cycle"] = int(steps)
    out |= {name: int(extra[name]) for name in COUNTS if extra.get(name) is not None}
    if (local := extra.get("step_tolerance")) is not None:
        out |= {"step_tolerance": float(local), "steps": int(extra["steps_taken"])}
    if (summed := extra.get("quadrature")) is not None:
        out["quadrature"] = summed
    if (window := extra.get("window")) is not None:
        out["window_cycles"] = int(window)
    for face in extra.get("faces", ()):
        out[rows.of_number("interface_nodes", face.number)] = int(face.patch.x.size)
    if patch is not None:
        out["interface_nodes"] = int(patch.x.size)
        if patch.averaging is not None:
            out["profile_averaging"] = float(patch.averaging)
        if result.plan.model.patch.interface.strips is not None:
            out["strips"] = int(result.plan.model.patch.interface.strips[0])
    return out


def measure_engines(result) -> dict:
    """Return by name of each measure that has a value what computed it, in words.

    A static measure of a patch names how it was found on the meshes of the patch (`patch_rows`); another measure has
    the engine of the run.
    """
    engines = {
        name: measure.engine or result.extra.get("engine", "")
        for name, measure in result.measures.items()
        if measure.value is not None
    }
    return {name: engine for name, engine in engines.items() if engine}


def without_folders(texts, path: Path) -> list:
    """Remarks in which a file is named without its folder where that is absolute, and numbers are written for people;
    path: of the scene, beside which files lie."""
    return without_folders_of(path)(texts)


def without_folders_of(path: Path) -> Callable[[Iterable[str]], list]:
    """`without_folders` of many remarks on scenes at one path."""
    folders = [
        f"{folder}/" for folder in (path.parent, path.parent.absolute()) if folder.is_absolute()
    ]

    def told(texts) -> list:
        out = []
        for text in texts:
            for folder in folders:
                text = text.replace(folder, "")
            out.append(
                rewrite_powers_of_ten(
                    _BEFORE.sub("", text, count=1) if text.startswith("/") else text
                )
            )
        return out

    return told
