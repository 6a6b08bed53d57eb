"""Plan of a scene before it is run: engine, sizes, cost, stiffnesses and dimensionless groups.

In: a Scene or a Model. Out: a `Plan`. Nothing is solved, except for the contact search by which an
automatic mesh is graded, and for the patch of a joint that was bolted when the modes were measured.
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
from . import joint, memory
from .bench import engine as of_bench
from .cost import Cost, MemoryPart
from .patch import plan as patch_plan
from .rig import engines
from .rig import plan as of_rig
from .tolerance_forecast import EMPTY_FORECAST, Forecast, forecast_tolerance
from .wear import plan as of_wear

PACKAGE_BYTES = 80e6  # Memory of the packages that every run imports [bytes].
MAX_CPU_SECONDS = 1e6  # Largest predicted CPU time [s] of a run that is started; twelve days.
SKIPPING_ENGINES = (
    "march",
    "hybrid",
)  # Engines that skip cycles once the motion is periodic.
# Smallest number of cycles at which a plan mentions that cycles may be skipped.
MIN_SKIPPED_CYCLES = 100
UPPER_LIMIT_NOTE = (
    "the computing time is an upper limit: as soon as the motion repeats itself, the remaining cycles are not "
    "computed one by one"
)
GROUPS = {  # Definition and SI unit of each group.
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

    - model, kind: model, and the kind of its run.
    - effects: names of the effects in the scene.
    - not_in_scene: effects that the scene does not contain.
    - cost: predicted cost of the run; its memory contributions from the largest to the smallest.
    - chain: stiffness [N/m], or "rigid", of each element in series between modes and interface.
    - groups: dimensionless groups by name.
    - verdict: sentences on the run.
    - compile_seconds: CPU seconds of compiling in addition to `seconds`, if no earlier run has
      compiled this code.
    - tolerance: forecast whether the run misses the tolerance.
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
        """Numbers of unknowns of mesh and motion by name."""
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
        """Predicted peak memory of the run [bytes]."""
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
        """Return name, free and stuck frequency [Hz] of each mode of a rig."""
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
    """Return a phrase on the compile time; "" if nothing is compiled."""
    return f" (and {seconds:.0f} s once for compiling)" if seconds else ""


def plan(source) -> Plan:
    """Plan the run of a Scene or a Model.

    Parameters
    ----------
    source : Scene or Model

    Raises
    ------
    PatchfemError
        If the scene cannot be run, with the position of the error in the scene.
    """
    model = source if isinstance(source, Model) else build(source)
    with locate_errors(model.source):
        return _make_plan(model)


def _make_plan(model: Model) -> Plan:
    """Collect what `plan` states of a Model: its effects, stiffnesses, groups of numbers, cost and verdict."""
    if model.measured is not None:
        try:
            # An invalid table of measured responses is reported before anything runs.
            measured.read_table(model.measured.path)
        except PatchfemError as error:
            error.key = error.key or "measured.file"
            raise
    chain = {"holder": "rigid", "pieces_shear": "rigid", "asperities": "rigid"}
    groups = {}
    rig = model.rig
    motion_sentences = []
    if model.has_bolted_patch:
        build_rig = rig.structure.bolted.build_rig
        model, patches, _ = joint.solve_without_joint(model)
        values = {name: measure.value for name, measure in patches[0].measures.items()}
        # The run subtracts the joint again, because its comparison run needs the solved patch.
        bolted = model.rig.structure.bolted._replace(build_rig=build_rig)
        rig = replace(model.rig, structure=replace(model.rig.structure, bolted=bolted))
        model = replace(model, rig=rig)
    motion_sentences += model.describe_removed_joint()
    patch_sentences = []
    law_sentences = []
    if rig is not None:
        chain = of_rig.structure_stiffnesses(rig) | chain
        groups |= of_rig.compute_dimensionless_groups(model) if model.kind == "rig" else {}
        motion_sentences += engines.describe_unused_settings(
            model, engines.choose_engine(model).name
        )
    if model.patch is not None:
        chain |= patch_plan.stiffness_chain(model.patch)
        if model.has_bolted_patch:
            chain |= patch_plan.find_solved_links(chain, values)
        groups |= patch_plan.compute_patch_groups(model)
        patch_sentences += patch_plan.describe_patch_plan(groups, model.patch)
    interfaces = rig.friction.interfaces if rig is not None else ()
    for number, interface in enumerate(interfaces):
        if interface.patch is not None:
            for name, link in patch_plan.stiffness_chain(interface.patch).items():
                if link != "rigid":
                    chain[rows.add_interface_number(name, number)] = link
            patch_sentences += patch_plan.describe_interface_patch(
                rig.friction.names[number], interface
            )
    cost = _predict_cost(model)
    law_sentences += cost.words
    if model.kind == "bench":
        groups = of_bench.compute_dimensionless_groups(model) | groups
    if model.friction is not None:
        chain |= _interface_stiffnesses(model)
        groups |= _compute_law_groups(model)
        law_sentences += _describe_grooves(model)
    if rig is not None:
        motion_sentences += of_rig.describe_stick(rig, groups, chain)
    if (
        cost.engine in SKIPPING_ENGINES
        and drive_sizes.is_sinusoidal(rig.drive.signal)
        and rig.drive.cycles >= MIN_SKIPPED_CYCLES
    ):
        law_sentences.append(UPPER_LIMIT_NOTE)
    # The forecast solves a contact, which a run with too little memory could not afford.
    forecast = Forecast(model.accuracy.tolerance, ())
    refusal = memory.reason_for_refusal(cost.parts)
    memory_sentence = memory.describe_largest_part(cost.parts)
    if refusal:
        memory_sentence = f"`run` will refuse this scene: {refusal}"
    else:
        forecast = forecast_tolerance(model)
    motion_sentences = [*([forecast.sentence()] if forecast.causes else []), *motion_sentences]
    is_compiled = cost.compile_seconds == 0 or compiled.has_run(
        compiled_code_key(model, cost.engine, cost.sizes)
    )
    return Plan(
        model,
        model.kind,
        model.source.effects,
        model.absent,
        cost,
        chain,
        groups,
        tuple(
            _arrange_sentences(
                model, groups, memory_sentence, (motion_sentences, patch_sentences, law_sentences)
            )
        ),
        0.0 if is_compiled else cost.compile_seconds,
        forecast,
    )


def _predict_cost(model: Model) -> Cost:
    """Predict the cost of a run, including all coarse runs.

    The memory contributions are sorted from the largest to the smallest.
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


def compiled_code_key(model: Model, engine: str, unknowns: dict) -> str:
    """Return a text that identifies the compiled code that a run needs.

    Runs with equal texts use the same code.

    Parameters
    ----------
    model : Model
    engine : str
        Name of the engine.
    unknowns : dict
        Numbers of unknowns by name.
    """
    rig = model.rig
    friction = model.friction
    laws = [] if friction is None else [friction]
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


def _arrange_sentences(
    model: Model, groups: dict, memory_sentence: str, sentence_groups: tuple
) -> list:
    """Return the sentences of a plan in their final order, with those on memory and shear.

    sentence_groups: sentences on the motion, on the patch, and on the friction law.
    """
    sentences = list(sentence_groups[0])
    if memory_sentence:
        sentences.append(memory_sentence)
    sentences += [*sentence_groups[1], *sentence_groups[2]]
    if "slip_length" in groups:
        shear_phrase = (
            f"by {format_length(groups['slip_length'], 3)} or more before the whole patch slips"
        )
        sentence = (
            f"the pieces are rigid in shear in this scene; elastic pieces would shear {shear_phrase}; add "
            "[contact.shear] to include this shear"
        )
        if model.patch.interface.has_shear:
            sentence = f"the pieces shear elastically {shear_phrase}"
        sentences.append(sentence)
    if model.kind == "rig" and model.partial_slip and model.rig.friction.load_varies:
        sentences.append(
            f"the normal load changes with the motion, so {model.partial_slip} is computed with the tangential modes of "
            "all nodes; the numerical error is estimated from a second run with half as many modes"
        )
    return sentences


def refuse_large_run(run_plan: Plan) -> None:
    """Raise Missing if a run needs too much memory or CPU time."""
    memory.refuse_insufficient_memory(run_plan.cost.parts)
    if run_plan.seconds > MAX_CPU_SECONDS:
        key = ""
        if run_plan.model.accuracy.steps_per_cycle is not None:
            key = "accuracy.steps_per_cycle or "
        if run_plan.kind == "bench":
            key += "slide.cycles"
        elif run_plan.model.rig is not None:
            key += "drive.cycles"
        raise Missing(
            f"the run would need a computing time of about {run_plan.seconds:.2g} s ({run_plan.steps:.2g} time "
            f"steps), more than the limit of {MAX_CPU_SECONDS:.0e} s; lower {key or 'the number of elements'}",
            "",
        )


def _interface_stiffnesses(model: Model) -> dict:
    """Return the stiffnesses of grooves and bonds, in series at the interface, by name."""
    load = model.nominal_load
    if not load > 0:
        return {}
    stiffnesses = {}
    if model.grooves is not None:
        stiffnesses["grooves"] = model.grooves.stiffness(load)
    stiffnesses["bonds"] = _law_stiffness(model.friction, load)
    others = model.rig.friction.interfaces[1:] if model.rig is not None else ()
    for number, interface in enumerate(others, 2):
        interface_load = load if interface.load is None else interface.load
        stiffnesses[f"bonds_{number}"] = _law_stiffness(interface.numbers, interface_load)
    return stiffnesses


def _law_stiffness(law, load: float):
    """Return the stiffness [N/m] of a friction law in stick; a text if it is infinite or undefined."""
    if law_has_trait(law.law, "creeps"):
        return "none: it creeps"
    stiffness = record.stick_stiffness(law, load)
    return "rigid until it slips" if stiffness == inf else stiffness


def _compute_law_groups(model: Model) -> dict:
    """Return the dimensionless groups of the friction law by name."""
    if model.spread is None:
        return {}

    return {"share_of_the_spread": spread.carried_fraction(model.pad, model.spread)}


def _describe_grooves(model: Model) -> list:
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
