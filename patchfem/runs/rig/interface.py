"""From the law, the load and the pressed patch to the contact that a march moves."""

from dataclasses import replace

import numpy as np

from ...core import ModalBasis, PatchfemError
from ...model.accuracy import Settings, quadrature_of
from ...model.drive import speed_of
from ...model.interfaces import acts, limits, loads_of, viewed
from ...model.law import acting, law_of
from ...model.structure import modes_of
from ...structure.drive_sizes import omega_of, peak_speed
from ..patch.strips import strip_loads


def model_of(scene, settings, patch, modes: ModalBasis, drive, start):
    """The model that a march takes: one contact, or slots where interfaces or springs stand beside it."""
    pass

    structure, many = scene.structure, len(modes.interfaces) > 1
    interlocked = structure.bonded is not None and structure.bonded.wavelength is not None
    alone = None if many else contact_model(scene, settings, patch, drive)
    if not many and structure.stiffening is None and not interlocked:
        return alone
    from ...dynamics.march import joints as slots

    rows, elements = [*modes.interfaces], []
    if many:
        loads = strip_loads(patch) if patch is not None else loads_of(scene)
        elements += [_element(scene, k, load, drive, start) for k, load in enumerate(loads)]
    if interlocked:
        elements.append(slots.interlock(0, structure.bonded.stiffness, structure.bonded.wavelength))
    if structure.stiffening is not None:
        elements.append(slots.cubic(len(rows), structure.stiffening.cubic))
        rows.append(modes.output)
    size = modes.mass * omega_of(drive) * peak_speed(drive, start)
    beside = alone if alone is not None and alone.limit > 0 else None
    return slots.SlotsModel(beside, tuple(elements), np.array(rows), size)


def _element(scene, number: int, load: float, drive, start):
    from ...dynamics.march import joints as slots
    from ...model.law import acting, law_of

    seen = acting(viewed(scene, number))
    f = seen.friction
    if f.law == "coulomb":
        return slots.coulomb(number, *limits(scene, number, load))
    if f.law == "tanh":
        return slots.rate(number, f.static * load, f.reference_speed)
    if f.law == "elastic-plastic":
        return slots.elastic_plastic(number, f.static * load, f.bond_length)
    if f.law == "nonlocal" and f.reading == "stretch" and f.order == 1:
        return slots.bonds(number, law_of(seen, peak_speed(drive, start)), load)
    at = scene.where(f"structure.interface.{number}.law" if scene.structure.interface else "friction.law")
    raise PatchfemError(f"{at}: '{f.law}' of reading '{f.reading}' and order {f.order:g} beside other interfaces: not "
                        "yet built; use reading = \"stretch\" with order = 1")


def contact_model(scene, settings: Settings, patch, drive):
    """The ContactModel of a marching scene; patch: the solved Patch or None for [normal]."""
    from ...dynamics.march import march as hub

    scene = acting(scene)
    f, contact = scene.friction, scene.contact
    if f is None:
        return hub.coulomb_model(0.0, 0.0)
    if acts(scene):
        from .varying_load import model_of

        return model_of(scene, modes_of(scene), patch, speed_of(scene, drive), settings.shear_modes)
    load = patch.pressure.load if patch is not None else scene.normal.load
    limit = f.static * load
    shear = contact.gives_way if contact is not None else ""
    if f.law == "convolution":
        from ..bench.averaged import limit_share

        return hub.coulomb_model(*(limit * limit_share(scene, patch),) * 2)
    if f.law in ("coulomb", "elastic-plastic"):
        length = f.bond_length if f.law == "elastic-plastic" else 0.0
        if shear:
            from ...slip.shear_modes import jenkins_set

            per_node = patch.pressure.sigma_n * patch.pieces.interface.weight
            if f.law == "coulomb" and f.kinetic < f.static:
                raise PatchfemError(f"{scene.path}: friction.kinetic below static with {shear}: not yet "
                                    "built; the exact set of elements needs static = kinetic")
            found = jenkins_set(patch.giving, f.static * per_node, length)
            return replace(hub.jenkins_model(found.stiffness, found.yield_slide), reduction=found)
        if f.law == "coulomb":
            return hub.coulomb_model(limit, f.kinetic * load)
        return hub.jenkins_model([limit / length], [length])
    if f.law == "tanh":
        return hub.rate_model(limit, f.reference_speed)
    law = law_of(scene, speed_of(scene, drive))
    found = quadrature_of(scene, settings, drive)
    if found.engine != "recursion":
        from ...friction.bonds.quadrature import cutoff

        reach = cutoff(law.order, found.tail) if found.tail > 0 else np.inf
        return hub.list_model(law, limit, reach, found.merge)
    if shear:
        from ..patch.press import shear_of

        reduced = shear_of(patch, law, settings.shear_modes, scene.accuracy.tolerance)
        model = hub.points_model(law, patch.pieces.interface.weight, patch.pressure.sigma_n, reduced)
        return replace(model, reduction=reduced)
    if settings.per_point:
        from ...model.gap import shape_side

        x, weight, sigma = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        pattern = (x, sigma) if shape_side(contact) == "lower" else None
        return hub.points_model(law, weight, sigma, None, pattern)
    return hub.points_model(law, [1.0], [load])
