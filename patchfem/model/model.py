"""The model of a scene: everything that the scene means, made once; the last module that sees a Scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial
from math import prod
from textwrap import shorten
from typing import TYPE_CHECKING

from ..core import PatchfemError
from ..effects import absent, has
from ..scene.keys.tables import Accuracy, Friction, Temperature
from ..scene.scene import Scene
from . import load as of_load
from . import patch as patch_model
from . import rig as of_rig
from . import slide as of_slide
from . import wear as of_wear
from .law import acting, bonds_of, load_of, pad_width
from .source import Source, placed

if TYPE_CHECKING:
    from ..friction.bonds.parameters import Bonds
    from ..friction.grooves import Grooves
    from .load import PointLoad
    from .patch import PatchModel
    from .rig import Rig
    from .slide import SlidePath
    from .wear import WearModel


@dataclass(frozen=True, eq=False, slots=True)
class Model:
    """The question that a run answers, frozen, in SI; nothing is solved.

    kind: "patch", "bench", "rig" or "linear". patch or point, whichever carries the load, the other None. friction:
    keys of the law as they act, of the first interface; heat: surface temperature table or None; spread [m] of the pad
    (2.15) or None; pad [m]: width across the path. slide of a bench, rig of a coupled run. measured: (path of rows,
    reading factor, kind of reading, its cut-off [Hz] or None) or None. wear: over many cycles, or None. absent: effects
    that the scene does not name. grooves: that the load climbs, or None.
    """

    source: Source
    kind: str
    patch: PatchModel | None
    point: PointLoad | None
    friction: Friction | None
    heat: Temperature | None
    spread: float | None
    pad: float | None
    slide: SlidePath | None
    rig: Rig | None
    accuracy: Accuracy
    measured: tuple | None
    wear: WearModel | None
    absent: tuple
    grooves: Grooves | None = None

    def __repr__(self) -> str:
        return f"Model of {self.source.path.name}: {self.kind}; {shorten(', '.join(self.source.effects), 160)}"

    @property
    def side(self) -> str:
        """The piece that carries the shapes, and with them the pressure: "upper" or "lower"."""
        return self.patch.gap.side if self.patch is not None else "upper"

    @property
    def soft(self) -> str:
        """The effect that lets the patch slip part by part under one slide, as the scene writes it; "" where none
        does."""
        return self.patch.interface.partial_slip if self.patch is not None else ""

    @property
    def faced(self) -> bool:
        """Whether an interface has a patch of its own."""
        return self.rig is not None and any(
            one.patch is not None for one in self.rig.friction.interfaces
        )

    @property
    def load_varies(self) -> bool:
        """Whether the normal load is prescribed as a function of time."""
        return self.point is not None and bool(self.point.amplitude)

    @property
    def nominal_load(self) -> float:
        """Load [N] of the patch, estimated for a prescribed approach, or of the point; 0 without either."""
        if self.patch is not None:
            return self.patch.nominal_load
        return self.point.load if self.point is not None else 0.0

    @property
    def speed(self) -> float:
        """Scale of the speeds to expect [m/s]: the largest of a prescribed slide, or that of the drive of a rig."""
        return self.slide.peak_speed if self.rig is None else self.rig.speed_scale

    @property
    def bonds(self) -> Bonds:
        """Bond parameters (2.10-2.17) of law 'nonlocal'.

        The floor of the speed defaults to 1e-3 of the speeds to expect, in a rig to 1e-12 m/s at least.
        """
        return bonds_of(self.friction, self.speed, 0.0 if self.rig is None else 1e-12)

    def limits(self, load: float) -> tuple:
        """Static and kinetic friction force [N], >= 0, of the first interface of a rig under a load [N]."""
        return self.rig.friction.interfaces[0].limits(load)


def build_unswept(scene: Scene) -> Model:
    """`build` of a scene without its [sweep]: a swept key has the value that the scene gives it, or, where [sweep]
    alone has the key, the first one."""
    return build(replace(scene, sweep=()))


def build(scene: Scene) -> Model:
    """The model of a valid scene; files that it names are read. PatchfemError with the place of the key at fault.

    Only what the scene names is imported. A scene with [sweep] is many models and is refused.
    """
    if scene.sweep:
        count = prod(len(axis.texts) for axis in scene.sweep)
        one = " ".join(f'--set "{axis.key}={axis.texts[0]}"' for axis in scene.sweep)
        raise PatchfemError(
            f"{scene.where('sweep')}: has {count} cases, but a single run computes only one; use "
            f"`patchfem sweep`, or choose a case, such as the first: {one}"
        )
    patch = point = slide = rig = grooves = None
    if scene.contact is not None:
        with placed(scene):
            patch = patch_model.build_patch(scene.contact, scene.kind, scene.beside)
    if scene.friction is not None or (scene.structure is not None and scene.structure.interface):
        point, grooves = of_load.point_asked(scene), of_load.grooves_asked(scene)
    if scene.slide is not None:
        slide = of_slide.slide_asked(scene)
    if scene.structure is not None:
        rig = of_rig.build_rig(scene)
    if patch is not None and (
        scene.wear is not None or (rig is not None and rig.friction.load_varies)
    ):
        patch = patch.with_mesh(edge_motion="wear" if scene.wear is not None else "load")
    friction, heat, spread, pad = _law(scene)
    if patch is not None and slide is not None and grooves is None:
        patch = _with_slip(patch, slide, friction)
    named, measured = tuple(scene.named()), scene.measured
    found = Model(
        None,
        scene.kind,
        patch,
        point,
        friction,
        heat,
        spread,
        pad,
        slide,
        rig,
        scene.accuracy,
        (
            scene.beside(measured.file),
            (measured.acceleration_gain, measured.displacement_gain),
            measured.reading,
            measured.reading_cutoff,
        )
        if measured
        else None,
        of_wear.wear_asked(scene) if scene.wear else None,
        _absent(named),
        grooves,
    )
    source = Source(
        scene.path,
        scene.title,
        scene.text,
        partial(resolved, scene, found),
        named,
        tuple(scene.remarks),
        scene.sets,
        scene.notes,
    )
    return replace(found, source=source)


def _with_slip(patch: PatchModel, slide: SlidePath, friction: Friction | None) -> PatchModel:
    """Let the mesh of a bench follow its partial slip, where the patch slips as parallel elements."""
    if (
        not patch.interface.partial_slip
        or slide.across is not None
        or friction is None
        or has(friction.law, "bonds")
    ):
        return patch
    if not friction.static or friction.static <= 0:
        return patch
    slip = patch_model.PrescribedSlip(slide.amplitude, friction.static, friction.bond_length or 0.0)
    return patch.with_mesh(slip=slip)


@lru_cache(64)
def _absent(named: tuple) -> tuple:
    return tuple(absent(named))


def _law(scene: Scene) -> tuple:
    """Law of the first interface: (keys as they act, surface temperature table, spread [m], width of the pad [m])."""
    given, load = scene.friction, load_of(scene)
    if scene.structure is not None and scene.structure.interface:
        given, load = scene.structure.interface[0], scene.structure.interface[0].pressing
    if given is None:
        return None, None, None, None
    pad = pad_width(scene)
    return acting(given, pad, scene.where, load), given.temperature, given.spread, pad


def resolved(scene: Scene, model: Model) -> str:
    """The scene as TOML in SI with every default written out.

    Those that follow from other keys take part: the floor of the speed.
    """
    friction = scene.friction
    if friction is not None and friction.rest_growth is not None and friction.rest_speed is None:
        friction = friction.model_copy(update={"rest_speed": float(model.bonds.rest_speed)})
    return replace(scene, friction=friction).resolved()
