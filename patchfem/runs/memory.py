"""Memory of a run, the memory that this process may use, and the refusal of runs that need more.

In: a Plan. Out: the contributions to its memory, the free memory, and the reason for a refusal with the scene key to
change.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from .. import structure
from ..core import Missing
from . import refine
from .plan import Plan
from .rig import engines, numerics

BYTES_PER_STATIC_NODE = 4.6e3  # per node of the pieces of a static patch, to condense them [bytes]
BYTES_PER_MOVING_NODE = 8.1e3  # the same, with the frames of a motion [bytes]
BYTES_PER_SLIDE_SAMPLE = 250.0  # per sample of a prescribed slide [bytes]
# Per pair of modes: matrices, mode shapes and eigenvalue solver [bytes]
BYTES_PER_MODE_PAIR = 125.0
BYTES_PER_DRIVE_ROW = 400.0  # per row of a recorded drive [bytes]
HYBRID_SAMPLES_PER_STORED_CYCLE = 400  # stored samples of a cycle of the engine `hybrid`
# Expected number of reversals per cycle, which are also stored for the cycles before the window.
REVERSALS_PER_CYCLE = 4.0


class MemoryPart(NamedTuple):
    """Contribution to the peak memory of a run.

    - bytes: [bytes].
    - what: what needs it.
    - remedy: how it becomes smaller; "" if the scene does not determine it.
    """

    bytes: float
    what: str
    remedy: str = ""


class HistoryBytes(NamedTuple):
    """Memory of the histories that an engine stores.

    - sample: per value of a stored sample, with derived arrays [bytes]; measured: 0.8 to 1.2 times this for random records
      of 4e5 to 2e6 samples.
    - cycle: per cycle of a run and its coarse runs [bytes]; measured: 0.8 to 1.3 times this over 1e6 to 1e7 cycles.
    - turn: per value of a reversal that is stored before the window [bytes]; measured: 0.8 to 1.5 times this.
    """

    sample: float
    cycle: float
    turn: float


# Memory of the histories by engine
HISTORY_BYTES = {
    "hybrid": HistoryBytes(80.0, 140.0, 16.0),
    "march": HistoryBytes(45.0, 50.0, 18.0),
}


def list_parts(plan: Plan) -> list[MemoryPart]:
    """Return the contributions to the memory of a run, from the largest to the smallest."""
    model = plan.model
    points = plan.unknowns.get("interface_points", 0)
    nodes = plan.unknowns.get("elastic_unknowns_about", 0) / 2

    # Pressed are the contact of the scene, and the interfaces of a rig.
    interfaces = () if model.rig is None else model.rig.friction.interfaces
    patches = [model.patch, *(interface.patch for interface in interfaces)]
    patches = [patch for patch in patches if patch is not None]
    remedy = "make contact.element_size larger"
    if any(patch.mesh.file for patch in patches):
        remedy = "give contact.mesh fewer nodes on the interface"

    size = nodes * (BYTES_PER_STATIC_NODE if model.kind == "patch" else BYTES_PER_MOVING_NODE)
    parts = [
        MemoryPart(refine.PROGRAM_BYTES, "packages and compiled code"),
        MemoryPart(size, f"{points} nodes of the interface", remedy),
    ]
    # The histories of a motion count by its stored samples, which the scene may set by the steps.
    has_steps = model.accuracy.steps_per_cycle is not None
    if model.slide is not None:
        remedy = f"lower {'accuracy.steps_per_cycle' if has_steps else 'slide.cycles'}"
        if model.slide.kind == "file":
            remedy = "give fewer rows in slide.file"
        size = BYTES_PER_SLIDE_SAMPLE * plan.samples
        parts.append(MemoryPart(size, f"{plan.samples} samples of the slide", remedy))
    elif model.rig is not None:
        parts += _list_parts_of_motion(plan, has_steps=has_steps)
    return sorted(parts, reverse=True)


def _list_parts_of_motion(plan: Plan, *, has_steps: bool) -> list[MemoryPart]:
    """Return the contributions of the modes, the drive and the stored histories of a rig to its memory.

    `has_steps` tells whether the scene sets the steps per cycle. Lists of bonds are not counted, because their length is
    limited.
    """
    model = plan.model
    drive = model.rig.drive
    n_interfaces = len(model.rig.friction.interfaces)
    n_modes = plan.unknowns["modes"]
    # A drive of segments has breaks too, but no rows of a file.
    n_rows = 0 if drive.signal.segments else len(getattr(drive.signal, "breaks", ()))
    shorter = "give fewer rows in drive.file, or lower drive.duration"
    parts = [
        MemoryPart(BYTES_PER_MODE_PAIR * n_modes**2, f"{n_modes} modes", "give fewer modes"),
        MemoryPart(BYTES_PER_DRIVE_ROW * n_rows, f"{n_rows} rows of the drive", shorter),
    ]
    if engines.ENGINES[plan.engine].finds_periodic_motion:
        return parts

    # Histories: all samples of the last cycles, and reversals and extremes of the cycles before.
    settings = numerics.choose_numerics(model)
    history = HISTORY_BYTES[plan.engine]
    steps = settings.steps if plan.engine == "march" else HYBRID_SAMPLES_PER_STORED_CYCLE
    samples = max(2, settings.window) * steps
    width = 2.0 * n_modes + 12 + 6 * n_interfaces
    turns = min(REVERSALS_PER_CYCLE * drive.cycles, structure.drive_sizes.MAX_EARLY_SAMPLES)
    length = "drive.duration" if drive.waveform.is_random else "drive.cycles"

    return [
        *parts,
        MemoryPart(
            history.sample * width * samples,
            f"{samples} samples of the last cycles",
            f"lower {'accuracy.steps_per_cycle' if has_steps else length}",
        ),
        MemoryPart(
            history.cycle * drive.cycles + history.turn * width * turns,
            f"the histories of {drive.cycles:.3g} cycles",
            f"lower {length}",
        ),
    ]


def free_bytes(process: Path = Path("/proc"), group: Path = Path("/sys/fs/cgroup")) -> float:
    """Return the total memory [bytes] that this process may use; inf if none is known.

    It is the available memory of the system, at most that of the control groups (version 2) that contain the process,
    and what the process uses.

    Parameters
    ----------
    process : Path
        Folder with the state of the system and of its processes.
    group : Path
        Folder of the outermost control group.
    """
    free = 1024 * _read_number(process / "meminfo", "MemAvailable:")
    used = _read_number(process / "self/statm", place=1) * os.sysconf("SC_PAGE_SIZE")
    allowed = [_read_allowed(folder) for folder in _list_groups(process, group)]
    # An unknown number is not finite.
    known = [total for total in (free, *allowed) if total < float("inf")]
    return min(known, default=float("inf")) + (used if used < float("inf") else 0.0)


def _list_groups(process: Path, group: Path) -> list[Path]:
    """Return the folders of the outermost control group and of those within it that contain the process.

    The limit of each of them holds for all that it contains.
    """
    try:
        lines = (process / "self/cgroup").read_text("utf-8").splitlines()
    except (OSError, ValueError):
        lines = []
    folders = [group]
    for line in lines:
        # A line of version 2 is 0::/PATH.
        if line.startswith("0::/"):
            for name in line.removeprefix("0::/").split("/"):
                folders.append(folders[-1] / name)
    return folders


def _read_allowed(group: Path) -> float:
    """Return the memory [bytes] that a control group has left, with the cache of files; inf or nan if there is no limit."""
    cached = _read_number(group / "memory.stat", "inactive_file")
    return _read_number(group / "memory.max") - _read_number(group / "memory.current") + cached


def _read_number(path: Path, name: str = "", place: int = 0) -> float:
    """Return a number of a text file of the operating system, or nan if the file or the number does not exist.

    It is the word after `name`, or without a name the word with the index `place`.
    """
    try:
        words = path.read_text("ascii").split()
        return float(words[words.index(name) + 1 if name else place])
    except (OSError, ValueError, IndexError):
        return float("nan")


def refuse_insufficient_memory(plan: Plan, say: Callable[[str], None] | None = None) -> None:
    """Refuse a run that would need more memory than is free or than its scene allows.

    A run that needs more than the default of accuracy.max_memory, which the scene does not give, is not refused.

    Parameters
    ----------
    plan : Plan
        Plan of the run.
    say : callable, optional
        Callback for a sentence on a run that needs more than the default.

    Raises
    ------
    Missing
        With the largest contribution and its remedy.
    """
    parts = list_parts(plan)
    total = sum(part.bytes for part in parts)
    free = free_bytes()
    given = plan.model.accuracy.max_memory
    if total <= min(free, given or refine.DEFAULT_MAX_BYTES):
        return

    limit = f"accuracy.max_memory allows {(given or refine.DEFAULT_MAX_BYTES) / 1e9:.3g} GB"
    other_remedy = ", or raise accuracy.max_memory"
    if total > free:
        limit = f"only {max(free, 0.0) / 1e9:.2g} GB are free"
        other_remedy = ""
    text = f"about {total / 1e9:.3g} GB of memory are needed, but {limit}"
    largest = next(part for part in parts if part.remedy)
    if largest.bytes < 0.1 * total:
        text += "; free some memory, or run on a machine with more memory"
    else:
        size = f"{largest.bytes / 1e9:.3g} GB"
        text += f"; {size} of these are for {largest.what}: {largest.remedy}{other_remedy}"
    if total > free or given is not None:
        raise Missing(text, "")
    if say is not None:
        say(text)
