"""From the law, the load and the pressed patch to the contact that a march moves."""

import numpy as np

from ...core import ModalBasis, PatchfemError
from ...effects import carries, has, named, refusal
from ...friction.protocol import Element
from ...friction.record import law_from
from ...model.accuracy import Settings, quadrature_of
from ...model.drive import speed_of
from ...model.interfaces import acts, loads_of, viewed
from ...model.law import acting, law_of
from ...model.structure import modes_of
from ...structure.drive_sizes import omega_of, peak_speed
from ..patch.strips import strip_loads


def model_of(scene, settings, patch, modes: ModalBasis, drive, start):
    """The model that a march takes: one contact, or joints where interfaces or springs stand beside it."""
    structure, many = scene.structure, len(modes.interfaces) > 1
    interlocked = structure.bonded is not None and structure.bonded.wavelength is not None
    alone = None if many else contact_model(scene, settings, patch, drive)
    if not many and structure.stiffening is None and not interlocked:
        return alone
    from ...dynamics.march import joints

    rows, found = [*modes.interfaces], []
    if many:
        loads, speed = strip_loads(patch) if patch is not None else loads_of(scene), peak_speed(drive, start)
        found += [joints.Joint(k, _element(scene, k, load, speed)) for k, load in enumerate(loads)]
    if interlocked:
        found.append(joints.interlock(0, structure.bonded.stiffness, structure.bonded.wavelength))
    if structure.stiffening is not None:
        found.append(joints.cubic(len(rows), structure.stiffening.cubic))
        rows.append(modes.output)
    size = modes.mass * omega_of(drive) * peak_speed(drive, start)
    beside = alone if alone is not None and alone.limit > 0 else None
    return joints.JointsModel(beside, tuple(found), np.array(rows), size)


def _element(scene, number: int, load: float, speed: float) -> Element:
    """The law of interface `number` under a load [N]; speed [m/s] as of `model.law.law_of`."""
    seen = acting(viewed(scene, number))
    f = seen.friction
    if not carries(f, "joints"):
        at = scene.where(f"structure.interface.{number}.law" if scene.structure.interface else "friction.law")
        raise PatchfemError(f"{at}: {named(f)} beside other interfaces: {refusal('joints')}")
    if has(f.law, "bonds"):
        from ...friction.laws.stretch import points_element

        return points_element(law_of(seen, speed), [1.0], [load])
    return law_from(f, load).element(load)


def contact_model(scene, settings: Settings, patch, drive):
    """The ContactModel of a marching scene; patch: the solved Patch or None for [normal]."""
    from ...dynamics.march import models

    scene = acting(scene)
    f, contact = scene.friction, scene.contact
    if f is None:
        return models.coulomb_model(0.0, 0.0)
    if acts(scene):
        from .varying_load import model_of

        return model_of(scene, modes_of(scene), patch, speed_of(scene, drive), settings.shear_modes)
    load = patch.pressure.load if patch is not None else scene.normal.load
    if has(f.law, "bonds"):
        return _bonds_model(scene, settings, patch, drive, load)
    if has(f.law, "averaged"):
        from ..bench.averaged import limit_share

        return models.coulomb_model(*(f.static * load * limit_share(scene, patch),) * 2)
    law = law_from(f, load)
    if contact is not None and contact.gives_way:
        from ...slip.shear_modes import jenkins_set

        if has(f.law, "set-valued") and f.kinetic < f.static:
            raise PatchfemError(f"{scene.path}: friction.kinetic below static with {contact.gives_way}: not yet "
                                "built; the exact set of elements needs static = kinetic")
        per_node = patch.pressure.sigma_n * patch.pieces.interface.weight
        found = jenkins_set(patch.giving, f.static * per_node, law.element(load).length)
        return models.jenkins_model(found.stiffness, found.yield_slide, found)
    return models.element_model(law.element(load))


def _bonds_model(scene, settings: Settings, patch, drive, load: float):
    """The sum over bonds: a list of them, points behind shear modes, points of a pattern, or one point."""
    from ...dynamics.march import models

    law, found = law_of(scene, speed_of(scene, drive)), quadrature_of(scene, settings, drive)
    if found.engine != "recursion":
        from ...friction.bonds.quadrature import cutoff

        reach = cutoff(law.order, found.tail) if found.tail > 0 else np.inf
        return models.list_model(law, scene.friction.static * load, reach, found.merge)
    if scene.contact is not None and scene.contact.gives_way:
        from ..patch.press import shear_of

        reduced = shear_of(patch, law, settings.shear_modes, scene.accuracy.tolerance)
        return models.points_model(law, patch.pieces.interface.weight, patch.pressure.sigma_n, reduced)
    if settings.per_point:
        from ...model.gap import shape_side

        x, weight, sigma = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        pattern = (x, sigma) if shape_side(scene.contact) == "lower" else None
        return models.points_model(law, weight, sigma, None, pattern)
    return models.points_model(law, [1.0], [load])
