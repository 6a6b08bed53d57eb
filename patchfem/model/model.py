"""Model of a scene: the complete problem, built once and not solved.

No module after this folder knows a Scene.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from math import prod
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, NamedTuple

from ..core import PatchfemError, array_dataclass
from ..effects import law_has_trait, list_absent_effects, needs_bond_list
from ..formatting import format_quantity
from ..scene.keys.memoize import memoize
from ..scene.keys.tables import Accuracy, Friction
from ..scene.overrides import replace_number
from ..scene.rules.methods import MotionFeatures, find_motion_features
from ..scene.scene import Scene
from . import patch, rig, slide, structure, wear
from .law import build_interface_laws, make_bond_parameters
from .source import SceneWriter, Source, locate_errors

if TYPE_CHECKING:
    from ..friction.bonds.parameters import Bonds
    from ..friction.grooves import Grooves
    from .patch import PatchArea, PatchModel
    from .rig import BoltedJoint, Rig
    from .slide import PointLoad, SlidePath
    from .wear import WearModel


class MeasuredFile(NamedTuple):
    """File with measured responses that are compared with the results.

    - path: path of the file.
    - gains: factors of the acceleration and of the displacement.
    - reading: kind of the values, as `measured.reading` of the scene.
    - cutoff: cut-off frequency [Hz] of the instrument.
    """

    path: Path
    gains: tuple[float, float]
    reading: str
    cutoff: float | None


@array_dataclass
class Model:
    """Problem that a run solves, in SI units; nothing is solved yet.

    - kind: "patch", "bench", "rig" or "linear".
    - patch: patch that carries the load, or None.
    - point: load on a point if no patch carries it, or None.
    - friction: effective keys of the law of the first interface, or None.
    - spread_share: fraction of the friction force of this law that acts on the pad (2.15); None without spread.
    - slide: prescribed slide of a bench, or None.
    - rig: masses, drive and interfaces of a rig, or None.
    - measured: file of measurements, or None.
    - wear: wear over many cycles, or None.
    - absent: effects that the scene does not name.
    - grooves: grooves that the load climbs, or None.
    - motion: features of the scene that decide which engines can compute its motion.
    - source: scene of the model, with the line of each key.
    - accuracy: tolerance and numerical settings.
    """

    source: Source
    kind: str
    patch: PatchModel | None
    point: PointLoad | None
    friction: Friction | None
    spread_share: float | None
    slide: SlidePath | None
    rig: Rig | None
    accuracy: Accuracy
    measured: MeasuredFile | None
    wear: WearModel | None
    absent: tuple[str, ...]
    grooves: Grooves | None = None
    motion: MotionFeatures | None = None

    def __repr__(self) -> str:
        # Largest number of characters of the effects in the repr of a model
        effects = shorten(", ".join(self.source.effects), 160)
        return f"Model of {self.source.path.name}: {self.kind}; {effects}"

    @property
    def side(self) -> str:
        """Piece that carries the shapes and the pressure: "upper" or "lower"."""
        return self.patch.gap.side if self.patch is not None else "upper"

    @property
    def partial_slip(self) -> str:
        """Name of the key that enables partial slip of the patch, or "" if it slips as a whole."""
        return self.patch.interface.partial_slip if self.patch is not None else ""

    @property
    def sticks_rigidly(self) -> bool:
        """Whether the first interface sticks without any displacement, so that its force jumps at a reversal."""
        is_partial = self.partial_slip or (self.rig and self.rig.friction.has_partial_slip)
        has_law = self.friction is not None and law_has_trait(self.friction.law, "set-valued")
        return has_law and not is_partial

    @property
    def motion_depends_on_mesh(self) -> bool:
        """Whether the motion follows from the pressure at each place of the patch, and so has an error due to its mesh."""
        friction = None if self.rig is None else self.rig.friction
        moves = friction is not None and (friction.load_varies or friction.bands_slide_apart)
        return bool(self.partial_slip or moves or self.side == "lower")

    @property
    def moves(self) -> bool:
        """Whether the model has a motion, prescribed or driven; otherwise its patch is only pressed."""
        return self.slide is not None or self.rig is not None

    @property
    def area(self) -> PatchArea | None:
        """Cells of the face of [contact]; None for a plane patch, and without [contact]."""
        return None if self.patch is None else self.patch.area

    @property
    def patches(self) -> tuple[PatchModel, ...]:
        """Patches that are pressed: that of [contact], or those of the interfaces of the rig."""
        interfaces = () if self.rig is None else self.rig.friction.interfaces
        return tuple(filter(None, (self.patch, *(interface.patch for interface in interfaces))))

    @property
    def has_interface_patches(self) -> bool:
        """Whether at least one interface of the rig has a patch."""
        return self.patch is None and bool(self.patches)

    @property
    def bolted_joint(self) -> BoltedJoint | None:
        """Joint that was bolted when the modes were measured, or None."""
        return None if self.rig is None else self.rig.structure.bolted

    @property
    def has_bolted_patch(self) -> bool:
        """Whether the patch of a joint is still to be solved, for modes that were measured with it."""
        return self.bolted_joint is not None and self.bolted_joint.build_rig is not None

    def with_bolted(self, bolted: BoltedJoint) -> Model:
        """Return the model with another joint that was bolted when its modes were measured."""
        rig = replace(self.rig, structure=replace(self.rig.structure, bolted=bolted))
        return replace(self, rig=rig)

    def describe_removed_joint(self) -> list[str]:
        """Return a list with a sentence on the joint that was subtracted from the modes, or []."""
        bolted = self.bolted_joint
        if bolted is None or bolted.subtracted is None:
            return []
        texts = [format_quantity(k, "N m-1", 4) for k in bolted.subtracted.stiffness]
        return [
            f"the modes were measured with the joint bolted, so {structure.JOINT_WORDS[bolted.origin]}, "
            f"{' and '.join(texts)}, is subtracted from them"
        ]

    def state_subtracted_joint(self) -> Model:
        """Return the model with a source that states the joint which was subtracted from its modes.

        So the resolved scene and the command that repeats a run subtract the same joint again. If each case has its own
        modal test, nothing is stated, because the scene then means its own joint.
        """
        bolted = self.bolted_joint
        if bolted is None or bolted.origin == "case" or bolted.subtracted is None:
            return self
        writer = self.source.writer._replace(joint=bolted.subtracted.list_values())
        return replace(self, source=replace(self.source, writer=writer))

    @property
    def load_varies(self) -> bool:
        """Whether the normal load is prescribed as a function of time."""
        return self.point is not None and bool(self.point.amplitude)

    @property
    def nominal_load(self) -> float:
        """Normal load [N] of the patch or the point, or 0 if there is neither."""
        if self.patch is not None:
            return self.patch.nominal_load
        return self.point.load if self.point is not None else 0.0

    @property
    def speed_scale(self) -> float:
        """Expected sliding speed [m/s]: the peak of a prescribed slide, or that of the interfaces of a rig."""
        return self.slide.peak_speed if self.rig is None else self.rig.slide_speed_scale

    @property
    def bonds(self) -> Bonds:
        """Bond parameters of the law 'nonlocal' (report, equations 2.10-2.17)."""
        return self.make_bonds(self.friction)

    def make_bonds(self, law: Friction) -> Bonds:
        """Return the bond parameters of a law 'nonlocal' at the sliding speed of the model, from its effective keys."""
        # Smallest default [m/s] of the rest speed of bonds in a rig, v_h of eq. 2.10
        min_rest_speed = 0.0 if self.rig is None else 1e-12
        return make_bond_parameters(law, self.speed_scale, min_rest_speed)


def build_without_sweep(scene: Scene) -> Model:
    """Build the model of a scene, ignoring its table [sweep].

    A swept key keeps the value that the scene gives it; a key that only [sweep] names has its first
    value.
    """
    return build(replace(scene, sweep=()))


def build(scene: Scene) -> Model:
    """Build the model of a valid scene, and read the files that it names.

    Only effects that the scene names are imported.

    Raises
    ------
    PatchfemError
        If a file or a value cannot be used (with the line of its key), or if the scene has a
        [sweep] and so means many models.
    """
    with locate_errors(scene):
        return _build(scene)


def _build(scene: Scene) -> Model:
    """Build the model of a scene; a PatchfemError has the key at fault.

    The parts are built in the order in which they need each other: patch, point load and slide, rig, law, mesh of the
    patch, and last the source, whose text has defaults that follow from the other parts.
    """
    if scene.sweep:
        _refuse_sweep(scene)

    # Patch, point and slide.
    patch_model = None
    if scene.contact is not None:
        patch_model = patch.build_patch(scene.contact, scene.resolve_path)
    path = slide.build_slide(scene) if scene.slide is not None else None

    # Rig and law; the mesh of the patch follows from what moves it.
    rig_model = None
    if scene.structure is not None:
        rig_model = rig.build_rig(scene)
        rig_model = _attach_bolted_model(scene, rig_model)
    point = grooves = None
    if scene.friction is not None or (scene.structure is not None and scene.structure.interface):
        point = slide.build_point_load(scene, rig_model)
        grooves = slide.build_grooves(scene)

    laws = build_interface_laws(scene) if rig_model is None else rig_model.friction.interfaces
    law = laws[0].numbers if laws else None
    if patch_model is not None:
        patch_model = _choose_mesh(scene, patch_model, rig_model, law)
        if patch_model.area is None and path is not None and grooves is None:
            patch_model = _request_slip_mesh(patch_model, path, law)

    # The source is added last, because the resolved scene has defaults that follow from the model.
    effects = tuple(scene.effect_names())
    model = Model(
        source=None,
        kind=scene.kind,
        patch=patch_model,
        point=point,
        friction=law,
        spread_share=laws[0].spread_share if laws else None,
        slide=path,
        rig=rig_model,
        accuracy=scene.accuracy,
        measured=_build_measured(scene),
        wear=wear.build_wear_model(scene) if scene.wear else None,
        absent=_find_absent(effects),
        grooves=grooves,
        motion=find_motion_features(scene, scene.kind),
    )

    source = Source(
        path=scene.path,
        title=scene.title,
        text=scene.text,
        writer=SceneWriter(partial(write_resolved, scene, model), {}),
        effects=effects,
        remarks=tuple(scene.remarks),
        sets=scene.sets,
        notes=scene.notes,
    )
    model = replace(model, source=source)
    return model if model.has_bolted_patch else model.state_subtracted_joint()


def _choose_mesh(scene: Scene, patch_model: PatchModel, rig_model: Rig | None, law) -> PatchModel:
    """Return the patch of a scene with what its mesh depends on.

    The mesh is finer where contact edges move, or where partial slip must be resolved. `law` are the keys of the friction
    law, or None.
    """
    if law is not None and law.static == 0:
        # Without friction no shear stress deforms the pieces.
        still = replace(patch_model.interface, partial_slip="")
        patch_model = replace(patch_model, interface=still)
    edge_motion = _find_edge_motion(scene, rig_model)
    is_fine = rig_model is None and scene.wear is None
    patch_model = patch_model.with_mesh(edge_motion=edge_motion, is_fine=is_fine)
    if patch_model.area is None:
        return patch_model
    area = patch_model.area._replace(max_cells=_find_max_cells(scene, patch_model))
    return replace(patch_model, area=area)


def _find_max_cells(scene: Scene, patch_model: PatchModel) -> int:
    """Return the largest number of cells along a face that a run of a scene chooses by itself."""
    if scene.kind == "patch":
        return patch.MAX_STATIC_CELLS
    has_bonds = law_has_trait(scene.friction.law, "bonds")
    if has_bonds and patch_model.interface.partial_slip and needs_bond_list(scene.friction):
        return patch.MAX_LIST_CELLS
    if scene.wear is not None or (has_bonds and patch_model.interface.partial_slip):
        return patch.MAX_POINT_CELLS
    return patch.MAX_SLIP_CELLS


def _attach_bolted_model(scene: Scene, rig_model: Rig) -> Rig:
    """Return the rig of a scene with the model of the joint that was bolted in the modal test.

    The rig is returned unchanged if its modes were measured free, if its own joint was bolted, or if the stiffness of
    the joint is known.
    """
    bolted = rig_model.structure.bolted
    bolted_scene = structure.find_bolted_scene(scene)
    if bolted is None or bolted.subtracted is not None or bolted_scene is scene:
        return rig_model
    bolted = bolted._replace(model=_build_bolted_model(bolted_scene))
    return replace(rig_model, structure=replace(rig_model.structure, bolted=bolted))


def write_resolved(
    scene: Scene, model: Model, joint: dict[str, float], folder: Path | None = None
) -> str:
    """Write the scene as TOML in SI units with all defaults, including those from the model.

    Parameters
    ----------
    scene : Scene
        Checked scene.
    model : Model
        Its model.
    joint : dict of str to float
        Keys and values in SI that state the joint which was subtracted from bolted modes.
    folder : Path, optional
        Folder to which the names of files are relative; by default that of the scene.
    """
    friction = scene.friction
    if friction is not None and friction.rest_growth is not None and friction.rest_speed is None:
        friction = friction.model_copy(update={"rest_speed": float(model.bonds.growth.rest_speed)})
    tables = {"friction": friction, "structure": scene.structure}
    for key, value in joint.items():
        name, *pieces = key.split(".")
        tables[name] = replace_number(tables[name], pieces, value)
    return replace(scene, **tables).resolved(folder)


def _refuse_sweep(scene: Scene) -> None:
    """Raise PatchfemError if the scene has a table [sweep]."""
    count = prod(len(axis.texts) for axis in scene.sweep)
    first = " ".join(f'--set "{axis.key}={axis.texts[0]}"' for axis in scene.sweep)
    raise PatchfemError(
        f"has {count} cases, but a single run computes only one; use `patchfem sweep`, or choose a "
        f"case, such as the first: {first}",
        "sweep",
    )


def _find_edge_motion(scene: Scene, rig_model: Rig | None) -> str:
    """Return what moves the contact edges in a scene: "wear" or "load", or "" if they do not move.

    `rig_model` is None without a rig.
    """
    if scene.wear is not None:
        return "wear"
    return "load" if rig_model is not None and rig_model.friction.load_varies else ""


def _request_slip_mesh(model: PatchModel, path: SlidePath, law: Friction | None) -> PatchModel:
    """Request a mesh that resolves partial slip under a prescribed slide, and return the patch with it.

    `model` is the patch, `path` its slide and `law` the table [friction]. Bond laws need no such mesh, nor do laws
    without friction.
    """
    if not model.interface.partial_slip:
        return model
    if law is None or law_has_trait(law.law, "bonds") or not law.static or law.static <= 0:
        return model
    slip = patch.PrescribedSlip(path.amplitude, law.static, law.bond_length or 0.0)
    return model.with_mesh(slip=slip)


def _build_measured(scene: Scene) -> MeasuredFile | None:
    """Build the record of the measured responses that a scene names."""
    keys = scene.measured
    if not keys:
        return None
    gains = (keys.acceleration_gain, keys.displacement_gain)
    return MeasuredFile(scene.resolve_path(keys.file), gains, keys.reading, keys.reading_cutoff)


# The scene as written is the same object in all cases of a study, so that its model is built once.
_build_bolted_model = memoize(build)


@lru_cache(64)
def _find_absent(effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the known physical effects that a scene neglects."""
    return tuple(list_absent_effects(effects))
