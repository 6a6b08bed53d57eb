"""Numerical choices of a run: engine, steps per cycle, shear modes, quadrature, and what they would cost."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from ..core import Missing
from ..structure import drive_sizes as structure_drive_sizes
from ..structure.drive_sizes import omega_of, sinusoidal
from . import drive as model_drive
from .drive import drive_of, speed_of
from .engine import COMPARED, engine_of, unique_steps
from .law import law_of
from .structure import highest_frequency

MOST_STEPS = 6400  # finest automatic march, steps per cycle
COMPARED_STEPS = 400  # per cycle of a comparison method where the scene does not say
LEAST_KEPT = 100  # samples of a run that has no cycles
LONGEST = 600.0  # seconds that a shared bond list may take before the run is refused


CHOSEN_POINTS = 300  # about what a static patch takes at the default tolerance


def chosen_mesh(scene) -> bool:
    """Whether the tolerance chooses the mesh: of a static patch without an element size, a mesh file or a profile."""
    contact = scene.contact
    return scene.kind == "patch" and (contact.element_size, contact.mesh, contact.profile) == (None, None, None)


@dataclass(frozen=True, slots=True)
class Settings:
    """Numerical choices of a run; `pinned` names the ones the scene fixed; shear_modes None: by the tolerance."""

    engine: str
    steps: int
    cycles: float
    window: int
    shear_modes: int | None
    per_point: bool
    pinned: frozenset


def choose(scene, per_point: bool = False) -> Settings:
    """Engine and numerical settings from the scene; PatchfemError for a method that cannot do it."""
    accuracy, contact = scene.accuracy, scene.contact
    side = "upper"
    if contact is not None:
        from .gap import shape_side

        side = shape_side(contact)
    drive = drive_of(scene)
    engine = engine_of(scene, drive, side)
    cycles = model_drive.cycles_of(scene, drive)
    window = int(max(1, min(10, cycles // 10)))
    if model_drive.levelled(scene):
        window = min(window, int(model_drive.cycles_per_level(scene)))
    fastest = max(structure_drive_sizes.fastest(drive), highest_frequency(scene) * drive.period)
    if scene.normal is not None and scene.normal.amplitude:
        fastest = max(fastest, scene.normal.frequency * drive.period)
    # errors fall with the square of the step; 400 steps per cycle of the fastest motion give about 1e-3
    steps = accuracy.steps_per_cycle or int(np.clip(
        2 * round(200 * sqrt(1e-3 / accuracy.tolerance) * fastest), 100, MOST_STEPS))
    if accuracy.steps_per_cycle is None and engine == "march":
        steps = max(steps, unique_steps(scene, drive))
    if not sinusoidal(drive) and accuracy.steps_per_cycle is None:
        steps = max(steps, int(np.ceil(LEAST_KEPT / cycles)))
    pinned = {k for k in ("steps_per_cycle", "tail", "merge", "shear_modes") if getattr(accuracy, k) is not None}
    if engine in COMPARED:
        steps, pinned = accuracy.steps_per_cycle or COMPARED_STEPS, pinned | {"steps_per_cycle"}
    return Settings(engine, steps, cycles, window, accuracy.shear_modes, per_point or side == "lower",
                    frozenset(pinned))


def quadrature_of(scene, settings: Settings, drive):
    """The engines.Choice of a nonlocal law; a stroke is taken as the drive's own amplitude."""
    from ..friction.bonds.engines import choose as engine_for

    speed = speed_of(scene, drive)
    law, accuracy = law_of(scene, speed), scene.accuracy
    stroke = max(4 * speed / omega_of(drive) / law.length, 1e-9)
    tail = None if accuracy.tail is None else max(accuracy.tail, 1e-15)
    return engine_for(law, accuracy.tolerance, stroke, settings.steps / 2, accuracy.quadrature, tail, accuracy.merge)


def list_cost(scene, settings: Settings, drive) -> tuple:
    """(expected strips, seconds) of a shared list of bonds."""
    found = quadrature_of(scene, settings, drive)
    steps = settings.cycles * settings.steps
    strips = min(found.strips, 2 * steps * max(1.0, found.strips)) if found.tail else min(found.strips, 8 * steps)
    return strips, steps * found.seconds * (strips / found.strips if found.strips else 1.0)


def refuse_costly(scene, settings: Settings, drive, limit: float = LONGEST) -> None:
    """Missing when the shared bond list of a coupled run would take longer than `limit` seconds."""
    f = scene.friction
    if f is None or f.law != "nonlocal" or quadrature_of(scene, settings, drive).engine == "recursion":
        return
    entries, seconds = list_cost(scene, settings, drive)
    if seconds > limit:
        raise Missing(f"{scene.path}: the bond list (about {entries:.0f} entries) would take about {seconds:.0f} s, "
                      f"more than {limit:.0f} s; lower drive.cycles or accuracy.steps_per_cycle, loosen accuracy.tail "
                      "or accuracy.merge, or use reading = \"stretch\" with order = 1")
