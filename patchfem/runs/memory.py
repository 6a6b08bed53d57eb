"""Memory of a run and the code that it compiles, from its sizes, and the memory that the process may still take."""

import os
from pathlib import Path
from typing import NamedTuple

from .. import compiled
from ..core import Missing
from ..dynamics import resume
from ..dynamics.events import cost as events_cost
from ..dynamics.march import capacity
from ..model.model import Model
from .rig import costs, engines
from .rig import plan as of_rig

PACKAGES = 80e6  # bytes of what every run imports
FULL = 125.0  # per pair of coordinates: matrices, shapes and what diagonalises them
WAVE = 94.0  # per pair of sines and cosines of harmonic balance: its Jacobian and the factors of its error
# per number of a kept sample, by the engine (those of events if it is not named): the window, the response, what is
# read off it; of random records of 4e5 to 2e6 samples, 0.8 to 1.2 of what they took
KEPT, KEPT_BY = 32.0, {"smooth": 80.0, "march": 45.0}
# per cycle of a run, by the engine: extremes, phasors and places of all cycles, of the run and of its coarser runs; of
# single modes over 1e6 to 1e7 cycles, 0.8 to 1.3 of what they took
CYCLE, CYCLE_BY = 85.0, {"smooth": 140.0, "march": 50.0}
# per number of a turn kept from before the last cycles, four turns a cycle as long as they are fewer than all that are
# kept; of 1e5 to 1e6 cycles, 0.8 to 1.5 of what they took
TURN, TURN_BY, TURNS = 6.0, {"smooth": 16.0, "march": 18.0}, 4.0
SLIDE = 250.0  # per sample of a bench
ROW = 400.0  # per row of a recorded drive
MAPPED, CODE = 60e6, 150e6  # of address space beside what is used: packages, and the compiler's library
CODE_PART = "compiled code"
NAMED = 0.3  # of the memory, from which a plan names the part that takes most
CURES = {"contact.element_size": "make contact.element_size larger", "contact.mesh": "give contact.mesh fewer nodes on "
         "the interface", "accuracy.tail": "raise accuracy.tail or accuracy.merge", "structure": "give fewer modes",
         "slide.file": "give fewer rows in slide.file", "drive.file": "give fewer rows in drive.file"}


class EngineCode(NamedTuple):
    """What the code of an engine takes besides the program: bytes, seconds of CPU until it runs, and those of the first
    run of its kind, in which it compiles; 0 of code that is not compiled."""

    bytes: float
    seconds: float
    compile: float = 0.0


NONE = EngineCode(0.0, 0.0)
STEPS, SHEARED = EngineCode(58e6, 0.15, 3.5), EngineCode(58e6, 0.15, 7.0)  # a march; one with shear modes of a patch
LINEAR = EngineCode(58e6, 0.0)  # nothing of it is compiled
FOLLOWED = EngineCode(58e6, 0.15, 2.0)  # a slide, or a method of few kernels
SMOOTH, PIECES, BALANCE = EngineCode(74e6, 0.15, 9.0), EngineCode(82e6, 0.15, 12.0), EngineCode(1e8, 0.3, 3.0)
CODES = {"static": NONE, "bench, closed form": NONE, "bench, law step by step": NONE, "bench, two directions": NONE,
         **dict.fromkeys(("bench, parallel elements", "bench, recursion"), FOLLOWED),
         "smooth": SMOOTH, "exact": PIECES, "piecewise": PIECES, "harmonic": BALANCE}


def code(model: Model, engine: str) -> EngineCode:
    """The code of the engine that will run a model."""
    rig = model.rig
    if rig is None:
        return CODES.get(engine, STEPS)
    if engine in of_rig.OF_EVENTS and not rig.interfaces:  # a linear motion in closed form
        return LINEAR
    engine = engines.steady_by(model).like if engines.ENGINES[engine].steady else engine
    return CODES.get(engine, SHEARED if model.soft else STEPS)


def compiled_kind(model: Model, engine: str, unknowns: dict) -> str:
    """What the compiled code of a run hangs on, in words: two runs of one kind run by the same code."""
    rig, f = model.rig, model.friction
    laws = [one.numbers for one in rig.interfaces] if rig is not None else [f] if f is not None else []
    words = [engine, *sorted({f"{one.law} {one.reading} {one.order not in (None, 0, 1)}" for one in laws})]
    if rig is not None:
        words += [f"{min(2, len(rig.frequencies))} {min(2, len(rig.interfaces))}", "sines" * bool(rig.drive.segments)]
    flags = {"soft": bool(model.soft), "grooves": model.grooves is not None, "varies": model.load_varies,
             "list": "bond_list_about" in unknowns}
    return ", ".join([*words, *(name for name, holds in flags.items() if holds)])


def compile_seconds(model: Model, engine: str, unknowns: dict) -> float:
    """CPU seconds in which the first run of this kind compiles; 0 where one has run, or nothing of it is compiled."""
    seconds = code(model, engine).compile
    if seconds:
        return 0.0 if _short(model, engine) or compiled.has_run(compiled_kind(model, engine, unknowns)) else seconds
    return 0.0


def _short(model: Model, engine: str) -> bool:
    """Whether this is a run from event to event that is over soon as Python."""
    if model.rig is None or engine not in of_rig.OF_EVENTS:
        return False

    return _as_python(model) <= compiled.PATIENCE


def _is_loop_kept(model: Model) -> bool:
    """Return whether machine code of the loop from event to event is kept for the modes of a rig."""
    from ..dynamics.events.histories import is_loop_kept  # a plan without a rig does not load the engine

    return is_loop_kept(model.rig.modes, model.rig.drive)


def _as_python(model: Model) -> float:
    """CPU seconds of a run from event to event as Python, which is not compiled where they are few; of a density all
    its cells, which its error may ask for."""
    count, stiffness = costs.expected_elements(model)
    each = events_cost.python_seconds(model.rig.modes, model.rig.drive, stiffness, count if stiffness else 0)
    return model.rig.cycles * each * 2**costs.pairs_of(model)


class Need(NamedTuple):
    """A part of the memory of a run: bytes, what for in words, and the key of the scene that drives it, or ""."""

    bytes: float
    what: str
    key: str


def needs(model: Model, engine: str, steps: int, unknowns: dict, numerics=None, pressed: float = 0.0) -> tuple:
    """The parts of the memory of a run at its peak, the largest first.

    engine, steps, unknowns: of its `Plan`; numerics: the choices of a coupled run; pressed: bytes of its patch.

    The numbers above were measured on runs of one kind each, with 2001 nodes, 5000 cycles, 1000 harmonics and 2000
    masses as the largest; files and page take less than what they show.
    """
    points = unknowns.get("interface_points", 0)
    runs = code(model, engine)
    if _short(model, engine) and not _is_loop_kept(model):
        runs = NONE  # such a run as Python takes 86 MB, and 152 MB with machine code, which loads the library of LLVM
    parts = [Need(PACKAGES, "packages", ""), Need(runs.bytes, CODE_PART if runs.compile else "code", "")]
    if points:
        asked = [model.patch] if model.patch is not None else [one.patch for one in model.rig.interfaces if one.patch]
        key = "contact.mesh" if any(one.mesh for one in asked) else "contact.element_size"
        parts.append(Need(pressed, f"{points} nodes of the interface", key))
        strips = max(one.strips[0] if one.strips else 1 for one in asked)
        parts.append(Need(3000.0 * strips * points, f"{strips} strips of them", "contact.strips.count"))
        modes = unknowns.get("shear_modes", 0)
        parts.append(Need(24.0 * modes * points, f"{modes} shear modes", "accuracy.shear_modes"))
    if engine.startswith("bench"):
        parts.append(Need(SLIDE * steps / 2, f"{steps // 2} samples of the slide", _samples_key(model)))
    if model.rig is not None:
        parts += _of_rig(model, engine, steps, numerics)
    if "bond_list_about" in unknowns:
        parts.append(Need(capacity.most_bytes(unknowns["bond_list_about"]), "the list of bonds", "accuracy.tail"))
    return tuple(sorted((part for part in parts if part.bytes > 0), reverse=True))


def largest(parts: tuple) -> str:
    """What takes most of the memory that a key of the scene sets, with this key, in words; "" where that is little."""
    most = next((part for part in parts if part.key), None)
    if most is None or most.bytes < NAMED * sum(part.bytes for part in parts):
        return ""
    return f"{most.bytes / 1e6:.0f} MB of the memory are for {most.what}; {most.key} sets their size"


def _samples_key(model: Model) -> str:
    if model.slide.kind == "file":
        return "slide.file"
    return "accuracy.steps_per_cycle" if model.accuracy.steps_per_cycle else "slide.cycles"


def _of_rig(model: Model, engine: str, steps: int, numerics) -> list:
    rig, n = model.rig, len(model.rig.frequencies)
    width = 2.0 * n + 12 + 6 * len(rig.interfaces)
    parts = [Need(FULL * n**2, f"{n} modes", "structure")]
    if engines.ENGINES[engine].steady:
        if model.accuracy.harmonics:
            size = 2.0 * model.accuracy.harmonics * max(1, len(rig.interfaces))
            parts.append(Need(WAVE * size**2, f"{model.accuracy.harmonics} harmonics", "accuracy.harmonics"))
    elif numerics is not None:
        window = of_rig.kept_samples(numerics)
        length_key = "drive.duration" if rig.waveform.is_random else "drive.cycles"
        key = "accuracy.steps_per_cycle" if model.accuracy.steps_per_cycle else length_key
        parts.append(Need(KEPT_BY.get(engine, KEPT) * width * window, f"{window:.0f} samples of the last cycles", key))
        turns = min(TURNS * rig.cycles, resume.MOST_KEPT)
        size = CYCLE_BY.get(engine, CYCLE) * rig.cycles + TURN_BY.get(engine, TURN) * width * turns
        parts.append(Need(size, f"the histories of {rig.cycles:.3g} cycles", length_key))
    rows = len(getattr(rig.drive, "breaks", ())) if not rig.drive.segments else 0
    rows_key = "drive.file" if "file" in rig.waveform.required_keys else "drive.duration"
    parts.append(Need(ROW * rows, f"{rows} rows of the drive", rows_key))
    return parts


def free_bytes(compiled: bool = False) -> float:
    """Memory [bytes] that this process may take in all, by the system, its group and its own limits; infinite where
    none of them tells. compiled: a compiler's library is mapped besides, which only the last counts."""
    used, mapped = own_bytes()
    beside = mapped - used + MAPPED + (CODE if compiled else 0.0)
    return min(_available() + used, _of_group(used), *(limit - beside for limit in _limits()))


def own_bytes(status: Path = Path("/proc/self/statm")) -> tuple:
    """(memory in use, address space) of this process [bytes]; zeros where the system does not tell."""
    try:
        size, resident = map(int, status.read_text("ascii").split()[:2])
    except (OSError, ValueError):
        return 0.0, 0.0
    page = os.sysconf("SC_PAGE_SIZE")
    return float(resident * page), float(size * page)


def _available() -> float:
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            known = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(known["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return float("inf")


def _limits() -> list:
    """Limits of the address space and of the data of this process [bytes], infinite where none is set."""
    try:
        import resource
    except ImportError:
        return [float("inf")]
    found = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    return [float("inf") if limit == resource.RLIM_INFINITY else float(limit) for limit in found]


def _of_group(used: float, groups: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")) -> float:
    """What the control group of this process and those above it leave [bytes], with what the process uses of it."""
    try:
        lines = [line.split(":", 2) for line in groups.read_text("utf-8", "replace").splitlines()]
    except OSError:
        return float("inf")
    free = float("inf")
    for _, kinds, path in (line for line in lines if len(line) == 3):
        old = "memory" in kinds.split(",")
        if not old and kinds:
            continue
        base = root / "memory" if old else root
        names = ("memory.limit_in_bytes", "memory.usage_in_bytes") if old else ("memory.max", "memory.current")
        place = base / path.strip("/")
        for folder in (place, *place.parents):
            free = min(free, _left(folder, *names) + used)
            if folder == base:
                break
    return free


def _left(folder: Path, limit: str, usage: str) -> float:
    """Limit less usage of one group, whose files that were read long ago count as free; infinite without a limit."""
    try:
        most, taken = int((folder / limit).read_text("ascii")), int((folder / usage).read_text("ascii"))
        known = dict(line.split() for line in (folder / "memory.stat").read_text("ascii").splitlines())
    except (OSError, ValueError):  # "max"
        return float("inf")
    return float(most - taken + int(known.get("total_inactive_file", known.get("inactive_file", 0))))


def refusal(parts: tuple, free: float | None = None) -> str:
    """Why a run of these parts cannot be: what it needs, what there is, what takes most and its key; or nothing."""
    free = free_bytes(any(part.what == CODE_PART for part in parts)) if free is None else free
    total = sum(part.bytes for part in parts)
    if total <= free:
        return ""
    most = next((part for part in parts if part.key), None)
    text = f"about {total / 1e9:.3g} GB of memory are needed, but only {max(free, 0.0) / 1e9:.2g} GB are free"
    if most is None or most.bytes < 0.1 * total:
        return f"{text}; free some memory, or run on a machine with more memory"
    return f"{text}; {most.bytes / 1e9:.3g} GB of these are for {most.what}: {CURES.get(most.key, f'lower {most.key}')}"


def refuse(parts: tuple) -> None:
    """Raise Missing where a run would need more memory than there is."""
    if text := refusal(parts):
        raise Missing(text, "")
