"""Plan of a scene before it is run: engine, sizes, stiffnesses and dimensionless groups.

In: a Scene or a Model. Out: a `Plan`. Nothing is solved, except for the contact search by which an
automatic mesh is graded, and for the patch of a joint that was bolted when the modes were measured.
"""

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any

from .. import friction, inputs
from ..core import PatchfemError, add_interface_number
from ..effects import EFFECTS, law_has_trait
from ..model.model import Model, build
from ..model.source import locate_errors
from ..scene import refuse_attribute
from . import joint
from .bench import engine as of_bench
from .patch import plan as patch_plan
from .results.patch_rows import Values
from .rig import engines
from .rig import plan as of_rig

if TYPE_CHECKING:
    from ..model.rig import BoltedJoint

DIMENSIONLESS_GROUPS = {  # Definition and SI unit of each group.
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


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """Model with the engine that will run it and the numbers of its unknowns.

    - model: model of the run.
    - engine: name of the engine; "static" for a patch without motion.
    - unknowns: numbers of unknowns of mesh and motion by name.
    - samples: number of samples that a bench keeps; 0 for other runs.
    - chain: stiffness [N/m], or "rigid", of each element in series between modes and interface.
    - groups: dimensionless groups by name.
    - verdict: sentences on the run.
    """

    model: Model
    engine: str
    unknowns: dict[str, int]
    samples: int
    chain: "of_rig.Chain"
    groups: Values
    verdict: tuple[str, ...]

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
        If the scene cannot be run, with the position of the error in the scene.
    """
    model = source if isinstance(source, Model) else build(source)
    with locate_errors(model.source):
        return _make_plan(model)


def _make_plan(model: Model) -> Plan:
    """Collect what `plan` states of a Model: its stiffnesses, dimensionless groups, numbers of unknowns and verdict."""
    if model.measured is not None:
        try:
            # An invalid table of measured responses is reported before anything runs.
            inputs.measured.read_table(model.measured.path)
        except PatchfemError as error:
            error.key = error.key or "measured.file"
            raise

    chain = {"holder": "rigid", "pieces_shear": "rigid", "asperities": "rigid"}
    groups = {}
    rig = model.rig
    motion_sentences = []

    # The stiffness of the joint is subtracted from the measured modes of a bolted rig first.
    if model.has_bolted_patch:
        bolted = rig.structure.bolted
        model, patches, _ = joint.solve_without_joint(model)
        motion_sentences += model.describe_removed_joint()
        values = {name: measure.value for name, measure in patches[0].measures.items()}
        model = _require_joint(model, bolted)
        rig = model.rig
    else:
        motion_sentences += model.describe_removed_joint()

    # Structure of the rig and contact of the patch.
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
        patch_sentences += patch_plan.describe_tilt(groups, model.patch)

    interfaces = rig.friction.interfaces if rig is not None else ()
    for number, interface in enumerate(interfaces):
        if interface.patch is not None:
            for name, link in patch_plan.stiffness_chain(interface.patch).items():
                if link != "rigid":
                    chain[add_interface_number(name, number)] = link
            # The whole patch slips when its pieces are sheared by mu_s N/k.
            slip_force = interface.numbers.static * interface.load
            slip_length = slip_force / interface.patch.pieces.shear_stiffness
            patch_sentences.append(
                patch_plan.describe_shear(interface.patch, slip_length, rig.friction.names[number])
            )

    # Sizes of the computation, by which time and memory are predicted.
    unknowns = {}
    if model.patch is not None or model.has_interface_patches:
        unknowns = patch_plan.count_unknowns(model)
    engine = "static"
    samples = 0
    if rig is not None:
        engine = engines.choose_engine(model).name
        unknowns |= of_rig.count_unknowns(model)
    if model.kind == "bench":
        engine, counts, samples = of_bench.count_bench_sizes(model)
        unknowns |= counts
        groups = of_bench.compute_dimensionless_groups(model) | groups

    # Laws, and what the numbers of the plan say of the motion.
    if model.friction is not None:
        chain |= _interface_stiffnesses(model)
        groups |= _compute_law_groups(model)
        law_sentences += _describe_grooves(model)
    if rig is not None:
        motion_sentences += of_rig.describe_stick(rig, groups, chain)

    sentences = [*motion_sentences, *patch_sentences, *law_sentences]
    if "slip_length" in groups:
        sentences.append(patch_plan.describe_shear(model.patch, groups["slip_length"]))
    return Plan(model, engine, unknowns, samples, chain, groups, tuple(sentences))


def _require_joint(model: Model, before: "BoltedJoint") -> Model:
    """Return a model with the modes of the structure alone, of which a run subtracts the joint again.

    The comparison run needs the solved patch, and each finer mesh has its own stiffness. `before` is the joint of the
    model before its patch was solved.
    """
    bolted = model.rig.structure.bolted
    bolted = bolted._replace(build_rig=before.build_rig, subtracted=before.subtracted)
    rig = replace(model.rig, structure=replace(model.rig.structure, bolted=bolted))
    return replace(model, rig=rig)


def _interface_stiffnesses(model: Model) -> "of_rig.Chain":
    """Return the stiffnesses [N/m] of the grooves and of the friction laws in stick, by name; {} without a load.

    The names are "grooves", "bonds" for the law of the first interface, and "bonds_2", ... for the others.
    """
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
    stiffness = friction.record.stick_stiffness(law, load)
    return "rigid until it slips" if stiffness == inf else stiffness


def _compute_law_groups(model: Model) -> Values:
    """Return {"share_of_the_spread": fraction}, or {} for a law whose bonds do not spread over the surface.

    The fraction [1] of the friction force acts on the pad; the bonds carry the rest beyond its edges.
    """
    if model.spread is None:
        return {}

    return {"share_of_the_spread": friction.bonds.spread.carried_fraction(model.pad, model.spread)}


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
