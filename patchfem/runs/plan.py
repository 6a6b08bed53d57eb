"""Plan of a scene before it is run: engine, sizes, stiffnesses and dimensionless groups, and the memory of the run.

In: a Scene or a Model. Out: a `Plan`. Nothing is solved, except for the contact search by which an automatic mesh is graded,
and for the patch of a joint that was bolted when the modes were measured. Read `_make_plan` first. The second part adds up
the memory of the run (`list_memory_parts`), and refuses a run that needs more than is free or than the scene allows.
"""

import mmap
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import inf, prod
from pathlib import Path
from typing import Any, NamedTuple

from .. import friction, inputs, structure
from ..core import Missing, PatchfemError, add_interface_number, array_dataclass
from ..effects import EFFECTS, law_has_trait
from ..model.model import Model, build
from ..model.source import locate_errors, name_key
from ..scene import refuse_attribute
from ..scene.overrides import BaseScene
from . import joint, refine
from .bench import engine as of_bench
from .interfaces import bond_lists
from .patch import plan as patch_plan
from .results.patch_rows import Values
from .rig import engines
from .rig import plan as of_rig

DIMENSIONLESS_GROUPS = {  # definition and SI unit of each group by its name
    "D": (
        "D: friction limit (static, if there are two) divided by the largest force of the drive, both on the first mode",
        "1",
    ),
    "D_kinetic": ("D with the kinetic friction limit", "1"),
    "knee": (
        "acceleration of the drive above which friction alone does not limit the amplitude at resonance",
        "m s-2",
    ),
    "knee_force": (
        "force of the drive above which friction alone does not limit the amplitude at resonance",
        "N",
    ),
    "drive_amplitude_over_bond_length": (
        "displacement amplitude of the drive divided by the bond length",
        "1",
    ),
    "amplitude_over_bond_length": ("amplitude of the slide divided by the bond length", "1"),
    "slip_length": ("elastic slide of the pieces before the whole patch slips", "m"),
    "tilt_over_first_opening": (
        "tilt divided by the tilt at which an edge starts to lift off",
        "1",
    ),
    "share_of_the_spread": ("factor of eq. 2.15 for the spread across the width", "1"),
}


@array_dataclass
class Plan:
    """Model with the engine that will run it and the numbers of its unknowns.

    - model: model of the run.
    - engine: name of the engine; "static" for a patch without motion.
    - unknowns: numbers of unknowns of mesh and motion by name.
    - chain: stiffness [N/m], or "rigid", of each element in series between modes and interface.
    - groups: dimensionless groups by name.
    - verdict: sentences on the run.
    - draws_curve: whether a response curve is drawn; without it only its peak is computed, as for a case of a sweep.
    - n_cases: number of cases of the table [sweep] of the scene; `run` refuses a plan with more than 1, that of the first.
    """

    model: Model
    engine: str
    unknowns: dict[str, int]
    chain: "of_rig.Chain"
    groups: Values
    verdict: tuple[str, ...]
    draws_curve: bool = True
    n_cases: int = 1

    @property
    def kind(self) -> str:
        """Kind of the run: "patch", "bench", "rig" or "linear"."""
        return self.model.kind

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in the scene."""
        return self.model.source.effects

    @property
    def not_in_scene(self) -> tuple[str, ...]:
        """Names of the effects that the scene does not contain."""
        return self.model.absent

    def __repr__(self) -> str:
        sizes = []
        for name, count in self.unknowns.items():
            sizes.append(f"{count} {name.removesuffix('_about').replace('_', ' ')}")
        sizes = ", ".join(sizes)
        lines = [
            f"Plan of {self.model.source.path.name}: {self.kind}, engine {self.engine}, {sizes or 'one point'}"
        ]
        return "\n".join([*lines, *(f"  {text}" for text in self.verdict)])

    __getattr__ = refuse_attribute

    def modes(self, chain: "of_rig.Chain") -> list[dict[str, str | float | None]]:
        """Return name, free and stuck frequency [Hz] of each mode of a rig.

        `chain` has the stiffnesses [N/m] in series between modes and interface (`Plan.chain`).
        """
        return of_rig.mode_frequencies(self.model.rig, chain) if self.model.rig is not None else []

    def as_json(self) -> dict[str, Any]:
        """Return the plan as the object that `patchfem plan --json` prints."""
        return {
            "kind": self.kind,
            "effects": [{"effect": e, "equations": EFFECTS[e].equations} for e in self.effects],
            "not_in_scene": list(self.not_in_scene),
            "engine": self.engine,
            "unknowns": self.unknowns,
            "steps": None,
            "seconds": None,
            "bytes": None,
            "stiffness_chain": self.chain,
            "groups": self.groups,
            "verdict": list(self.verdict),
            "modes": self.modes(self.chain),
            "compile_seconds": None,
        }


def plan(source) -> Plan:
    """Plan the run of a Scene or a Model.

    Parameters
    ----------
    source : Scene or Model
        What to run.

    Raises
    ------
    PatchfemError
        If the scene cannot be run, with the position of the error in the scene, or if it has a [sweep] and so means many
        models.
    """
    model = source if isinstance(source, Model) else build(source)
    with locate_errors(model.source):
        return _make_plan(model)


def plan_first_case(source) -> Plan:
    """Plan the run of a Scene or a Model; of a Scene with a table [sweep] plan the first case, and say so.

    Parameters and errors are those of `plan`, but a [sweep] is allowed. `run` refuses the plan of a first case.
    """
    if isinstance(source, Model) or not source.sweep:
        return plan(source)

    # A key that only [sweep] names has its first value in each scene of the file; others get theirs.
    first = [f"{axis.key}={axis.texts[0]}" for axis in source.sweep]
    count = prod(len(axis.texts) for axis in source.sweep)
    case = plan(build(BaseScene(source).override(first)))
    sentence = f"this is the first of {count} cases of [sweep], {', '.join(first)}; `--set` of its keys chooses another one"
    return replace(case, verdict=(sentence, *case.verdict), n_cases=count)


def refuse_first_case(run_plan: Plan) -> None:
    """Raise PatchfemError if a plan is that of the first of several cases of a table [sweep]."""
    if run_plan.n_cases == 1:
        return
    raise PatchfemError(
        f"this plan shows the first of {run_plan.n_cases} cases, and its run would leave out the others; use `patchfem "
        "sweep` or pf.sweep, or choose a case by the keys of [sweep] when you make the plan",
        "sweep",
    )


def _make_plan(model: Model) -> Plan:
    """Collect what `plan` states of a Model: its stiffnesses, dimensionless groups, numbers of unknowns and verdict."""
    if model.measured is not None:
        with name_key("measured.file"):  # An invalid table is reported before anything runs.
            inputs.measured.read_table(model.measured.path)

    # The stiffness of the joint is subtracted from the measured modes of a bolted rig first.
    values: Values = {}
    if model.has_bolted_patch:
        before = model.bolted_joint
        model, patches, _ = joint.solve_without_joint(model)
        values = {name: measure.value for name, measure in patches[0].measures.items()}
    sentences = model.describe_removed_joint()
    if values:
        # A run has these modes of the structure alone, but subtracts the joint of its own meshes from the measured ones.
        given = {"build_rig": before.build_rig, "subtracted": before.subtracted}
        model = model.with_bolted(model.bolted_joint._replace(**given))
    rig = model.rig

    # Links in series, groups and numbers of unknowns: of the structure, the patch, the interfaces and the law.
    chain = {"holder": "rigid", "pieces_shear": "rigid", "asperities": "rigid"}
    groups: Values = {}
    unknowns: dict[str, int] = {}
    engine = "static"
    patch_sentences = []
    if model.patches:
        unknowns = patch_plan.count_unknowns(model)
    if rig is not None:
        engine = engines.choose_engine(model).name
        chain = of_rig.structure_stiffnesses(rig) | chain
        groups = of_rig.compute_dimensionless_groups(model) if model.kind == "rig" else {}
        unknowns["modes"] = len(rig.structure.frequencies)
        sentences += engines.describe_unused_settings(model, engine)
    elif model.moves:
        sizes = of_bench.count_bench_sizes(model)
        engine = sizes.engine
        unknowns |= sizes.unknowns
        groups = of_bench.compute_dimensionless_groups(model)

    if model.patch is not None:
        chain |= patch_plan.stiffness_chain(model.patch)
        chain |= patch_plan.find_solved_links(chain, values)
        groups |= patch_plan.compute_patch_groups(model)
        patch_sentences += patch_plan.describe_tilt(groups, model.patch)
    if model.has_interface_patches:
        links, shear_sentences = _describe_interface_patches(rig.friction)
        chain |= links
        patch_sentences += shear_sentences

    # Stiffness of the law, and the part of the force that the pad carries; the bonds beyond its edges have the rest
    if model.friction is not None and model.nominal_load > 0:
        chain |= _find_law_stiffnesses(model)
    if model.spread_share is not None:
        groups["share_of_the_spread"] = model.spread_share

    # What the numbers say of the motion
    if rig is not None:
        sentences += of_rig.describe_stick(rig, groups, chain)
    sentences += [*patch_sentences, *_describe_grooves(model)]
    if "slip_length" in groups:
        sentences.append(patch_plan.describe_shear(model.patch, groups["slip_length"]))
    return Plan(model, engine, unknowns, chain, groups, tuple(sentences))


def _describe_interface_patches(friction_model) -> "tuple[of_rig.Chain, list[str]]":
    """Return the stiffnesses in series [N/m] of the interfaces of a rig that have a patch, and sentences on their slip."""
    chain = {}
    sentences = []
    for number, interface in enumerate(friction_model.interfaces):
        if interface.patch is None:
            continue
        for name, link in patch_plan.stiffness_chain(interface.patch).items():
            if link != "rigid":
                chain[add_interface_number(name, number)] = link

        # The whole patch slips when its pieces are sheared by mu_s N/k.
        slip_force = interface.numbers.static * interface.load
        slip_length = slip_force / interface.patch.pieces.shear_stiffness
        name = friction_model.names[number]
        sentences.append(patch_plan.describe_shear(interface.patch, slip_length, name))
    return chain, sentences


def _find_law_stiffnesses(model: Model) -> "of_rig.Chain":
    """Return the stiffnesses [N/m] of the grooves and of the friction laws in stick, by name.

    The names are "grooves", "bonds" for the law of the first interface, and "bonds_2", ... for the others. A law without
    a finite stiffness has a text.
    """
    loads = [(model.friction, model.nominal_load)]
    if model.rig is not None:
        for interface in model.rig.friction.interfaces[1:]:
            loads.append((interface.numbers, bond_lists.find_interface_load(model, interface)))
    stiffnesses = {}
    if model.grooves is not None:
        stiffnesses["grooves"] = model.grooves.stiffness(model.nominal_load)
    for number, (law, load) in enumerate(loads):
        stiffness = "none: it creeps"
        if not law_has_trait(law.law, "creeps"):
            stiffness = friction.record.stick_stiffness(law, load)
        name = add_interface_number("bonds", number)
        stiffnesses[name] = "rigid until it slips" if stiffness == inf else stiffness
    return stiffnesses


def _describe_grooves(model: Model) -> list[str]:
    """Return a list with a sentence on the grooves that the load climbs."""
    load = model.nominal_load
    if model.grooves is None or not load > 0:
        return []
    grooves = model.grooves
    mu = model.friction.static
    return [
        f"at their bottom the grooves act as a spring of stiffness N k^2 A = {grooves.stiffness(load):.4g} N/m; on their "
        f"steepest flank the contact resists a force of up to {grooves.max_force(load, mu):.4g} N; without grooves "
        f"friction would resist up to mu N = {mu * load:.4g} N"
    ]


# ---- memory of a run

NEGLIGIBLE_BYTES = 50e6  # memory of a run beside that of the program which always fits
BYTES_PER_STATIC_NODE = 4.6e3  # per node of the pieces of a static patch, to condense them
BYTES_PER_MOVING_NODE = 8.1e3  # the same, with the frames of a motion
BYTES_PER_SLIDE_SAMPLE = 250.0  # per sample of a prescribed slide
# Bytes per entry of an n x n array of n modes, of which there are matrices, mode shapes and those of the eigenvalue solver
BYTES_PER_MODE_PAIR = 125.0
BYTES_PER_DRIVE_ROW = 400.0  # per row of a recorded drive
EVENT_DRIVEN_SAMPLES_PER_STORED_CYCLE = (
    400  # samples that the engine `event_driven` stores of a cycle
)
# Expected reversals per cycle, which are stored also for the cycles before the window
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
    - reversal: per value of a reversal that is stored before the window [bytes]; measured: 0.8 to 1.5 times this.
    """

    sample: float
    cycle: float
    reversal: float


# Memory of the histories by engine
HISTORY_BYTES = {
    "event_driven": HistoryBytes(80.0, 140.0, 16.0),
    "march": HistoryBytes(45.0, 50.0, 18.0),
}


def list_memory_parts(plan: Plan) -> list[MemoryPart]:
    """Return the contributions to the memory of a run, from the largest to the smallest."""
    model = plan.model
    points = plan.unknowns.get("interface_points", 0)
    nodes = plan.unknowns.get("elastic_unknowns_about", 0) / 2

    remedy = "make contact.element_size larger"
    if any(patch.mesh.file for patch in model.patches):
        remedy = "give contact.mesh fewer nodes on the interface"
    size = nodes * (BYTES_PER_MOVING_NODE if model.moves else BYTES_PER_STATIC_NODE)
    parts = [
        MemoryPart(refine.PROGRAM_BYTES, "packages and compiled code"),
        MemoryPart(size, f"{points} nodes of the interface", remedy),
    ]

    # The histories of a motion count by its stored samples, which the scene may set by the steps.
    steps_key = "accuracy.steps_per_cycle" * (model.accuracy.steps_per_cycle is not None)
    if model.slide is not None:
        remedy = f"lower {steps_key or 'slide.cycles'}"
        if model.slide.kind == "file":
            remedy = "give fewer rows in slide.file"
        n_samples = of_bench.count_bench_sizes(model).samples
        size = BYTES_PER_SLIDE_SAMPLE * n_samples
        parts.append(MemoryPart(size, f"{n_samples} samples of the slide", remedy))
    elif model.rig is not None:
        parts += _list_memory_parts_of_motion(plan, steps_key)
    return sorted(parts, reverse=True)


def _list_memory_parts_of_motion(plan: Plan, steps_key: str) -> list[MemoryPart]:
    """Return the contributions of the modes, the drive and the stored histories of a rig to its memory.

    `steps_key` is the key with which the scene sets the steps per cycle, or "". Lists of bonds are not counted, because
    their length is limited.
    """
    drive = plan.model.rig.drive
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
    settings = engines.choose_numerics(plan.model)
    history = HISTORY_BYTES[plan.engine]
    steps = settings.steps if plan.engine == "march" else EVENT_DRIVEN_SAMPLES_PER_STORED_CYCLE
    samples = max(2, settings.window) * steps
    width = 2.0 * n_modes + 12 + 6 * len(plan.model.rig.friction.interfaces)
    n_reversals = min(REVERSALS_PER_CYCLE * drive.cycles, structure.drive_sizes.MAX_EARLY_SAMPLES)
    length = "drive.duration" if drive.waveform.is_random else "drive.cycles"
    size = history.sample * width * samples
    earlier = history.cycle * drive.cycles + history.reversal * width * n_reversals
    what = f"the histories of {drive.cycles:.3g} cycles"
    return [
        *parts,
        MemoryPart(size, f"{samples} samples of the last cycles", f"lower {steps_key or length}"),
        MemoryPart(earlier, what, f"lower {length}"),
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
    # A line of version 2 is 0::/PATH. The limit of a group holds for all groups in it.
    inner = group
    with suppress(OSError, ValueError):
        for line in (process / "self/cgroup").read_text("utf-8").splitlines():
            if line.startswith("0::/"):
                inner = group / line.removeprefix("0::/")
    free = [1024 * _read_number(process / "meminfo", "MemAvailable:")]
    for folder in (inner, *inner.parents):
        used = _read_number(folder / "memory.current") - _read_number(
            folder / "memory.stat", "inactive_file"
        )
        free.append(_read_number(folder / "memory.max") - used)

    # An unknown number is not finite.
    known = min((total for total in free if total < inf), default=inf)
    used = _read_number(process / "self/statm", place=1) * mmap.PAGESIZE
    return known + (used if used < inf else 0.0)


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
    # A run that fits into what is free and allowed goes on without a word; one that hardly needs more than the program that
    # asks for it fits, and the free memory is not looked up.
    parts = list_memory_parts(plan)
    total = sum(part.bytes for part in parts)
    given = plan.model.accuracy.max_memory
    allowed = given or refine.DEFAULT_MAX_BYTES
    if total <= min(refine.PROGRAM_BYTES + NEGLIGIBLE_BYTES, allowed):
        return
    free = free_bytes()
    if total <= min(free, allowed):
        return

    limit = f"accuracy.max_memory allows {allowed / 1e9:.3g} GB"
    other_remedy = ", or raise accuracy.max_memory"
    if total > free:
        limit = f"only {max(free, 0.0) / 1e9:.2g} GB are free"
        other_remedy = ""

    # A remedy is named for the largest part that the scene determines, if it is a noticeable one.
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
