"""Memory of a run, the memory that this process may use, and the refusal of runs that need more.

In: a Plan. Out: the contributions to its memory, the available memory, and the reason for a refusal with the scene key to
change.
"""

import os
from pathlib import Path
from typing import NamedTuple

from ..core import Missing
from ..points import checkpoint, time_march
from .plan import Plan
from .rig import engines, numerics

FIXED_BYTES = 160e6  # packages and compiled code [bytes]
# Per node of the pieces [bytes]: to condense them in a static run, and with the frames of a motion.
NODE_BYTES = {True: 4.6e3, False: 8.1e3}
STRIP_NODE_BYTES = 3e3  # per strip and interface node [bytes]
SHEAR_NODE_BYTES = 24.0  # per shear mode and interface node [bytes]
SLIDE_SAMPLE_BYTES = 250.0  # per sample of a prescribed slide [bytes]
MODE_PAIR_BYTES = 125.0  # per pair of modes: matrices, mode shapes and eigenvalue solver [bytes]
HARMONIC_PAIR_BYTES = 94.0  # per pair of unknowns of harmonic balance: Jacobian and factors [bytes]
DRIVE_ROW_BYTES = 400.0  # per row of a recorded drive [bytes]
HYBRID_SAMPLES_PER_CYCLE = 400  # stored samples of a cycle of the engine `hybrid`
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


HISTORY_BYTES = {
    "hybrid": HistoryBytes(80.0, 140.0, 16.0),
    "march": HistoryBytes(45.0, 50.0, 18.0),
}


def list_parts(plan: Plan) -> list[MemoryPart]:
    """Return the contributions to the memory of a run, from the largest to the smallest."""
    model = plan.model
    counts = plan.unknowns
    points = counts.get("interface_points", 0)

    # All pressed interfaces count: the one of [contact] and those of the rig.
    patches = [model.patch]
    if model.rig is not None:
        patches += [interface.patch for interface in model.rig.friction.interfaces]
    patches = [patch for patch in patches if patch is not None]
    layers = [patch.interface.strips for patch in patches]
    strips = max((1 if layer is None else layer.count for layer in layers), default=0)

    finer = "make contact.element_size larger"
    if any(patch.mesh.file for patch in patches):
        finer = "give contact.mesh fewer nodes on the interface"

    n_bonds = counts.get("bond_list_about")
    list_bytes = time_march.count_list_bytes(n_bonds) if n_bonds else 0.0
    n_shear = counts.get("shear_modes", 0)

    parts = [
        MemoryPart(FIXED_BYTES, "packages and compiled code"),
        MemoryPart(
            NODE_BYTES[model.kind == "patch"] * counts.get("elastic_unknowns_about", 0) / 2,
            f"{points} nodes of the interface",
            finer,
        ),
        MemoryPart(
            STRIP_NODE_BYTES * strips * points,
            f"{strips} strips of them",
            "lower contact.strips.count",
        ),
        # Bonds and shear modes exist only where the friction law or the pieces need them.
        MemoryPart(list_bytes, "the list of bonds", "raise accuracy.tail or accuracy.merge"),
        MemoryPart(
            SHEAR_NODE_BYTES * n_shear * points,
            f"{n_shear} shear modes",
            "lower accuracy.shear_modes",
        ),
    ]

    # The histories of a motion count by its stored samples.
    if model.rig is not None:
        parts += _list_parts_of_motion(plan)
    elif model.slide is not None:
        remedy = _advise_fewer_samples(model, "slide.cycles")
        if model.slide.kind == "file":
            remedy = "give fewer rows in slide.file"
        parts.append(
            MemoryPart(
                SLIDE_SAMPLE_BYTES * plan.samples, f"{plan.samples} samples of the slide", remedy
            )
        )
    return sorted(parts, reverse=True)


def _list_parts_of_motion(plan: Plan) -> list[MemoryPart]:
    """Return the contributions of modes, drive, histories and harmonic balance of a rig."""
    model = plan.model
    rig = model.rig
    drive = rig.drive
    n_modes = plan.unknowns["modes"]
    n_interfaces = len(rig.friction.interfaces)
    n_rows = 0 if drive.signal.segments else len(getattr(drive.signal, "breaks", ()))
    parts = [
        MemoryPart(MODE_PAIR_BYTES * n_modes**2, f"{n_modes} modes", "give fewer modes"),
        MemoryPart(
            DRIVE_ROW_BYTES * n_rows,
            f"{n_rows} rows of the drive",
            "give fewer rows in drive.file, or lower drive.duration",
        ),
    ]
    if engines.ENGINES[plan.engine].finds_periodic_motion:
        harmonics = model.accuracy.harmonics or 0
        n_unknowns = 2.0 * harmonics * max(1, n_interfaces)
        size = HARMONIC_PAIR_BYTES * n_unknowns**2
        return [*parts, MemoryPart(size, f"{harmonics} harmonics", "lower accuracy.harmonics")]

    # Histories: all samples of the last cycles, and reversals and extremes of the cycles before.
    settings = numerics.choose_numerics(model)
    is_march = plan.engine == "march"
    history = HISTORY_BYTES[plan.engine]
    samples = max(2, settings.window) * (settings.steps if is_march else HYBRID_SAMPLES_PER_CYCLE)
    width = 2.0 * n_modes + 12 + 6 * n_interfaces
    turns = min(REVERSALS_PER_CYCLE * drive.cycles, checkpoint.MAX_EARLY_SAMPLES)
    length = "drive.duration" if drive.waveform.is_random else "drive.cycles"
    return [
        *parts,
        MemoryPart(
            history.sample * width * samples,
            f"{samples} samples of the last cycles",
            _advise_fewer_samples(model, length),
        ),
        MemoryPart(
            history.cycle * drive.cycles + history.turn * width * turns,
            f"the histories of {drive.cycles:.3g} cycles",
            f"lower {length}",
        ),
    ]


def _advise_fewer_samples(model, length: str) -> str:
    """Return the advice for the number of samples, which follows from a length of the run if the scene sets no steps."""
    return f"lower {'accuracy.steps_per_cycle' if model.accuracy.steps_per_cycle else length}"


def free_bytes() -> float:
    """Return the total memory [bytes] that this process may use; inf if none is known.

    The system and the control group of the process are considered.
    """
    used = _read_used_bytes()
    return min(_read_available_bytes() + used, free_in_control_group(used))


def _read_used_bytes() -> float:
    """Return the memory in use by this process [bytes]; 0 if unknown."""
    try:
        resident = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    except (OSError, ValueError):
        return 0.0
    return float(resident * os.sysconf("SC_PAGE_SIZE"))


def _read_available_bytes() -> float:
    """Return the available memory of the system [bytes]; inf if unknown."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            known = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(known["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return float("inf")


def free_in_control_group(
    used: float, groups: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")
) -> float:
    """Return the memory [bytes] that the control groups of this process allow.

    Memory that the process already uses is included.

    Parameters
    ----------
    used : float
        Memory in use by the process [bytes].
    groups : Path
        File that lists the control groups of the process.
    root : Path
        Root folder of the control group file system.

    Returns
    -------
    float
        Infinite if no group has a limit.
    """
    try:
        lines = [line.split(":", 2) for line in groups.read_text("utf-8", "replace").splitlines()]
    except OSError:
        return float("inf")
    free = float("inf")
    # The only hierarchy of version 2 has the number 0 and no names of controllers.
    for path in (line[2] for line in lines if line[:2] == ["0", ""]):
        group_folder = root / path.strip("/")
        for folder in (group_folder, *group_folder.parents):
            free = min(free, _remaining_bytes(folder) + used)
            if folder == root:
                break
    return free


def _remaining_bytes(folder: Path) -> float:
    """Return the memory [bytes] that a control group still allows; inf if unlimited.

    Inactive cached files count as free memory.
    """
    try:
        max_bytes = int((folder / "memory.max").read_text("ascii"))
        used_bytes = int((folder / "memory.current").read_text("ascii"))
        lines = (folder / "memory.stat").read_text("ascii").splitlines()
    # The limit is "max", which means unlimited, or a file is missing.
    except (OSError, ValueError):
        return float("inf")
    inactive = dict(line.split() for line in lines).get("inactive_file", 0)
    return float(max_bytes - used_bytes + int(inactive))


def reason_for_refusal(plan: Plan) -> str:
    """Return why a run needs more memory than is free, or "" if it does not."""
    parts = list_parts(plan)
    free = free_bytes()
    total = sum(part.bytes for part in parts)
    if total <= free:
        return ""
    text = f"about {total / 1e9:.3g} GB of memory are needed, but only {max(free, 0.0) / 1e9:.2g} GB are free"
    largest = next(part for part in parts if part.remedy)
    if largest.bytes < 0.1 * total:
        return f"{text}; free some memory, or run on a machine with more memory"
    return f"{text}; {largest.bytes / 1e9:.3g} GB of these are for {largest.what}: {largest.remedy}"


def refuse_insufficient_memory(plan: Plan) -> None:
    """Raise Missing if a run would need more memory than is free."""
    if text := reason_for_refusal(plan):
        raise Missing(text, "")
