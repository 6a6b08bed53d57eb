"""Plan of a scene, before anything runs: engine, sizes, cost, stiffness chain and groups.

In: a Scene or a Model. Out: a `Plan`; no mesh is assembled and nothing is solved.
"""

from dataclasses import dataclass, replace
from math import inf

from .. import compiled, cost_model
from ..core import Missing, PatchfemError
from ..effects import EFFECTS, law_has_trait
from ..formatting import format_length
from ..friction import record
from ..friction.bonds import spread
from ..inputs import measured
from ..model.model import Model, build
from ..model.source import locate_errors
from ..response import rows
from ..structure import drive_sizes
from . import memory
from .bench import engine as of_bench
from .cost import Cost, MemoryPart
from .patch import plan as patch_plan
from .rig import engines
from .rig import plan as of_rig
from .tolerance_forecast import EMPTY_FORECAST, Forecast, forecast_tolerance
from .wear import plan as of_wear

PACKAGE_BYTES = 80e6  # memory of the packages that every run imports [bytes]
MAX_CPU_SECONDS = 1e6  # largest predicted CPU time [s] of a run that is started, twelve days
SKIPPING_ENGINES = (
    "march",
    "exact",
    "piecewise",
)  # engines that skip the cycles of a periodic motion
MIN_SKIPPED_CYCLES = 100  # number of cycles from which a plan says that cycles may be skipped
UPPER_LIMIT_NOTE = (
    "the computing time is an upper limit: as soon as the motion repeats itself, the remaining cycles are not "
    "computed one by one"
)
GROUPS = {  # meaning and SI unit of each dimensionless group
    "D": (
        "D: friction limit (static, if there are two) divided by the largest force of the drive",
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


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """Model with the engine that will run it, the numbers of unknowns and the predicted cost.

    - model, kind: model and kind of its run.
    - effects: names of the effects in the scene.
    - not_in_scene: effects that the scene does not contain.
    - cost: cost of the run, its memory with the largest part first.
    - chain: stiffness [N/m] or "rigid" of each link of the stiffness chain.
    - groups: dimensionless groups by name.
    - verdict: sentences.
    - compile_seconds: CPU seconds of compiling in addition to `seconds`, if no run of this kind has
      left compiled code.
    - tolerance: whether the tolerance will be missed.
    """

    model: Model
    kind: str
    effects: tuple
    not_in_scene: tuple
    cost: Cost
    chain: dict
    groups: dict
    verdict: tuple
    compile_seconds: float = 0.0
    tolerance: Forecast = EMPTY_FORECAST

    @property
    def engine(self) -> str:
        """Name of the engine; "static" for a patch without motion."""
        return self.cost.engine or "static"

    @property
    def unknowns(self) -> dict:
        """Numbers of unknowns of the mesh and the motion, as a dict."""
        return self.cost.sizes

    @property
    def steps(self) -> int:
        """Number of time steps, including those of the coarse runs."""
        return self.cost.steps

    @property
    def seconds(self) -> float:
        """Predicted CPU seconds of the run on one core."""
        return round(self.cost.seconds, 2)

    @property
    def bytes(self) -> int:
        """Predicted memory at the peak of the run."""
        return self.cost.bytes

    def __repr__(self) -> str:
        sizes = []
        for name, count in self.unknowns.items():
            sizes.append(f"{count} {name.removesuffix('_about').replace('_', ' ')}")
        sizes = ", ".join(sizes)
        lines = [
            f"Plan of {self.model.source.path.name}: {self.kind}, engine {self.engine}, {sizes or 'one point'}, "
            f"{self.steps} steps, about {self.seconds:.1f} s{describe_compile_time(self.compile_seconds)} and "
            f"{self.bytes / 1e6:.0f} MB"
        ]
        return "\n".join([*lines, *(f"  {text}" for text in self.verdict)])

    def modes(self, chain: dict) -> list:
        """Name, free and stuck frequency [Hz] of each mode of a rig."""
        return of_rig.mode_frequencies(self.model.rig, chain) if self.model.rig is not None else []

    def as_json(self) -> dict:
        """Return the plan as the object that `patchfem plan --json` prints."""
        return {
            "kind": self.kind,
            "effects": [{"effect": e, "equations": EFFECTS[e].equations} for e in self.effects],
            "not_in_scene": list(self.not_in_scene),
            "engine": self.engine,
            "unknowns": self.unknowns,
            "steps": self.steps,
            "seconds": self.seconds,
            "bytes": self.bytes,
            "stiffness_chain": self.chain,
            "groups": self.groups,
            "verdict": list(self.verdict),
            "modes": self.modes(self.chain),
            "memory": {part.what: int(part.bytes) for part in self.cost.parts},
            "compile_seconds": self.compile_seconds,
            "tolerance": self.tolerance.as_json(),
        }


def describe_compile_time(seconds: float) -> str:
    """Return a phrase on the compile time, or "" if nothing is compiled."""
    return f" (and {seconds:.0f} s once for compiling)" if seconds else ""


def plan(asked) -> Plan:
    """Plan a Scene or a Model without making a mesh or a solution.

    Parameters
    ----------
    asked : Scene or Model

    Raises
    ------
    PatchfemError
        With its position in the scene, if nothing can run it.
    """
    model = asked if isinstance(asked, Model) else build(asked)
    with locate_errors(model.source):
        return _make_plan(model)


def _make_plan(model: Model) -> Plan:
    """Choose engine and settings of a Model and predict the cost of its run."""
    if model.measured is not None:
        try:
            # an invalid table of measured responses is reported before anything runs
            measured.read_table(model.measured.path)
        except PatchfemError as error:
            error.key = error.key or "measured.file"
            raise
    chain = {"holder": "rigid", "pieces_shear": "rigid", "asperities": "rigid"}
    groups = {}
    if model.rig is not None and model.rig.structure.without_joint is not None:
        model = replace(
            model,
            rig=of_rig.remove_expected_joint(
                model.rig, patch_plan.stiffness_chain(model.patch) | _interface_links(model)
            ),
        )
    on_motion = []
    on_patch = []
    on_law = []
    if model.rig is not None:
        chain = of_rig.structure_stiffnesses(model.rig) | chain
        groups |= of_rig.compute_dimensionless_groups(model) if model.kind == "rig" else {}
        on_motion += engines.describe_unused_settings(model, engines.choose_engine(model).name)
    if model.patch is not None:
        chain |= patch_plan.stiffness_chain(model.patch)
        groups |= patch_plan.compute_groups(model)
        on_patch += patch_plan.describe_patch_plan(groups, model.patch)
    interfaces = model.rig.friction.interfaces if model.rig is not None else ()
    for number, interface in enumerate(interfaces):
        if interface.patch is not None:
            for name, link in patch_plan.stiffness_chain(interface.patch).items():
                if link != "rigid":
                    chain[rows.add_interface_number(name, number)] = link
            on_patch += patch_plan.describe_interface_patch(
                model.rig.friction.names[number], interface
            )
    cost = _predict_cost(model)
    on_law += cost.words
    if model.kind == "bench":
        groups = of_bench.compute_dimensionless_groups(model) | groups
    if model.friction is not None:
        chain |= _interface_links(model)
        groups |= _law_groups(model)
        on_law += _describe_grooves(model)
    if model.rig is not None:
        on_motion += of_rig.describe_stick(model.rig, groups, chain)
    if (
        cost.engine in SKIPPING_ENGINES
        and drive_sizes.is_sinusoidal(model.rig.drive.signal)
        and model.rig.drive.cycles >= MIN_SKIPPED_CYCLES
    ):
        on_law.append(UPPER_LIMIT_NOTE)
    foreseen = forecast_tolerance(model)
    on_motion = [*([foreseen.sentence()] if foreseen.causes else []), *on_motion]
    is_compiled = cost.compile_seconds == 0 or compiled.has_run(
        compiled_kind(model, cost.engine, cost.sizes)
    )
    return Plan(
        model,
        model.kind,
        model.source.effects,
        model.absent,
        cost,
        chain,
        groups,
        tuple(_write_verdict(model, groups, cost.parts, (on_motion, on_patch, on_law))),
        0.0 if is_compiled else cost.compile_seconds,
        foreseen,
    )


def _predict_cost(model: Model) -> Cost:
    """Return the predicted cost of a run, including all coarse runs.

    The memory parts are ordered from the largest to the smallest.
    """
    pressing = Cost()
    if model.patch is not None or model.has_interface_patches:
        pressing = patch_plan.predict_cost(model)
    points = pressing.sizes.get("interface_points", 1)
    motion = Cost()
    if model.rig is not None:
        motion = of_rig.predict_cost(model, points)
    elif model.kind == "bench":
        motion = of_bench.predict_cost(model, points)
    total = (
        Cost({"start": cost_model.START_SECONDS}, (MemoryPart(PACKAGE_BYTES, "packages"),))
        + pressing
        + motion
    )
    if model.wear is not None and model.patch is not None:
        total += of_wear.predict_cost(
            model, points, motion.times["motion"] + motion.times.get("histories", 0.0)
        )
    return replace(
        total, parts=tuple(sorted((part for part in total.parts if part.bytes > 0), reverse=True))
    )


def compiled_kind(model: Model, engine: str, unknowns: dict) -> str:
    """Return a text that identifies the compiled code that a run needs.

    Two runs of one kind run the same code.

    Parameters
    ----------
    model : Model
    engine : str
        Name of the engine.
    unknowns : dict
        Number of unknowns by name.
    """
    rig = model.rig
    f = model.friction
    laws = [] if f is None else [f]
    if rig is not None:
        laws = [interface.numbers for interface in rig.friction.interfaces]
    words = [
        engine,
        *sorted({f"{law.law} {law.reading} {law.order not in (None, 0, 1)}" for law in laws}),
    ]
    if rig is not None:
        words += [
            f"{min(2, len(rig.structure.frequencies))} {min(2, len(rig.friction.interfaces))}",
            "sines" * bool(rig.drive.signal.segments),
        ]
    flags = {
        "soft": bool(model.partial_slip),
        "grooves": model.grooves is not None,
        "varies": model.load_varies,
        "list": "bond_list_about" in unknowns,
    }
    return ", ".join([*words, *(name for name, holds in flags.items() if holds)])


def _write_verdict(model: Model, groups: dict, parts: tuple, said: tuple) -> list:
    """Write the sentences of a plan on what the run will do and what it lacks.

    said: sentences on the motion, the patch and the friction law.
    """
    sentences = list(said[0])
    if text := memory.reason_for_refusal(parts):
        sentences.append(f"`run` will refuse this scene: {text}")
    elif text := memory.describe_largest_part(parts):
        sentences.append(text)
    sentences += [*said[1], *said[2]]
    if "slip_length" in groups:
        about = f"by {format_length(groups['slip_length'], 3)} or more before the whole patch slips"
        sentence = (
            f"the pieces are rigid in shear in this scene; elastic pieces would shear {about}; add "
            "[contact.shear] to include this shear"
        )
        if model.patch.interface.has_shear:
            sentence = f"the pieces shear elastically {about}"
        sentences.append(sentence)
    if model.kind == "rig" and model.partial_slip and model.rig.friction.load_varies:
        sentences.append(
            f"the normal load changes with the motion, so {model.partial_slip} is computed with the tangential modes of "
            "all nodes; the numerical error is estimated from a second run with half as many modes"
        )
    return sentences


def refuse_large_run(what: Plan) -> None:
    """Raise Missing if a run needs too much memory or CPU time."""
    memory.refuse_insufficient_memory(what.cost.parts)
    if what.seconds > MAX_CPU_SECONDS:
        key = ""
        if what.model.accuracy.steps_per_cycle is not None:
            key = "accuracy.steps_per_cycle or "
        if what.kind == "bench":
            key += "slide.cycles"
        elif what.model.rig is not None:
            key += "drive.cycles"
        raise Missing(
            f"the run would need a computing time of about {what.seconds:.2g} s ({what.steps:.2g} time "
            f"steps), more than the limit of {MAX_CPU_SECONDS:.0e} s; lower {key or 'the number of elements'}",
            "",
        )


def _interface_links(model: Model) -> dict:
    """Return the stiffnesses in series at the interface: grooves and bonds."""
    load = model.nominal_load
    if not load > 0:
        return {}
    links = {}
    if model.grooves is not None:
        links["grooves"] = model.grooves.stiffness(load)
    links["bonds"] = _law_stiffness(model.friction, load)
    others = model.rig.friction.interfaces[1:] if model.rig is not None else ()
    for number, interface in enumerate(others, 2):
        interface_load = load if interface.load is None else interface.load
        links[f"bonds_{number}"] = _law_stiffness(interface.numbers, interface_load)
    return links


def _law_stiffness(law, load: float):
    """Return the stiffness [N/m] of a friction law in stick, or a text."""
    if law_has_trait(law.law, "creeps"):
        return "none: it creeps"
    stiffness = record.stick_stiffness(law, load)
    return "rigid until it slips" if stiffness == inf else stiffness


def _law_groups(model: Model) -> dict:
    """Return the dimensionless groups of the friction law as a dict."""
    if model.spread is None:
        return {}

    return {"share_of_the_spread": spread.carried_fraction(model.pad, model.spread)}


def _describe_grooves(model: Model) -> list:
    """Return the sentence of a plan on the grooves that the load climbs."""
    load = model.nominal_load
    if model.grooves is None or not load > 0:
        return []
    g = model.grooves
    mu = model.friction.static
    return [
        f"at their bottom the grooves act as a spring of stiffness N k^2 A = {g.stiffness(load):.4g} N/m; on their "
        f"steepest flank the contact resists a force of up to {g.max_force(load, mu):.4g} N; without grooves "
        f"friction would resist up to mu N = {mu * load:.4g} N"
    ]
