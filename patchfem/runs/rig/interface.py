"""From the law, the load and the pressed patch to the contact that a march moves."""

from dataclasses import replace

import numpy as np

from ...core import PatchfemError
from ...model.accuracy import Numerics, quadrature_of
from ...model.law import Rubbing, bonds_of
from ...model.model import Model
from ...structure.drive_sizes import omega_of
from .strips import strip_loads


def model_of(model: Model, numerics: Numerics, patch):
    """The contact that a march takes: one, or joints where interfaces or springs stand beside it."""
    rig, many = model.rig, len(model.rig.modes.interfaces) > 1
    alone = None if many else contact_model(model, numerics, patch)
    if not many and not rig.bends:
        return alone
    from ...dynamics.march import joints as slots

    rows, elements = [*rig.modes.interfaces], []
    if many:
        loads = strip_loads(patch) if patch is not None else [one.load for one in rig.interfaces]
        elements += [_element(rig.interfaces[k if patch is None else 0], k, load, rig.speed)
                     for k, load in enumerate(loads)]
    if rig.interlock is not None:
        elements.append(slots.interlock(0, *rig.interlock))
    if rig.cubic is not None:
        elements.append(slots.cubic(len(rows), rig.cubic))
        rows.append(rig.modes.output)
    size = rig.modes.mass * omega_of(rig.drive) * rig.speed
    beside = alone if alone is not None and alone.limit > 0 else None
    return slots.SlotsModel(beside, tuple(elements), np.array(rows), size)


def _element(one: Rubbing, number: int, load: float, speed: float):
    from ...dynamics.march import joints as slots

    f = one.numbers
    if f.law == "coulomb":
        return slots.coulomb(number, *one.limits(load))
    if f.law == "tanh":
        return slots.rate(number, f.static * load, f.reference_speed)
    if f.law == "elastic-plastic":
        return slots.elastic_plastic(number, f.static * load, f.bond_length)
    if f.law == "nonlocal" and f.reading == "stretch" and f.order == 1:
        return slots.bonds(number, bonds_of(f, speed, 1e-12), load)
    raise PatchfemError(f"'{f.law}' of reading '{f.reading}' and order {f.order:g} beside other interfaces: not yet "
                        "built; use reading = \"stretch\" with order = 1", f"{one.key}.law")


def contact_model(model: Model, numerics: Numerics, patch):
    """The ContactModel of the one interface of a rig; patch: the solved Patch or None under [normal]."""
    from ...dynamics.march import march as hub

    f, soft = model.friction, model.soft
    if f is None:
        return hub.coulomb_model(0.0, 0.0)
    if model.rig.load_varies:
        from .varying_load import model_of

        return model_of(model, patch, numerics.shear_modes)
    load = patch.pressure.load if patch is not None else model.point.load
    limit = f.static * load
    if f.law == "convolution":
        from ..bench.averaged import limit_share

        return hub.coulomb_model(*(limit * limit_share(model, patch),) * 2)
    if f.law in ("coulomb", "elastic-plastic"):
        length = f.bond_length if f.law == "elastic-plastic" else 0.0
        if soft:
            from ...slip.shear_modes import jenkins_set

            per_node = patch.pressure.sigma_n * patch.pieces.interface.weight
            if f.law == "coulomb" and f.kinetic < f.static:
                raise PatchfemError(f"friction.kinetic below static with {soft}: not yet built; the exact set of "
                                    "elements needs static = kinetic", "")
            found = jenkins_set(patch.giving, f.static * per_node, length)
            return replace(hub.jenkins_model(found.stiffness, found.yield_slide), reduction=found)
        if f.law == "coulomb":
            return hub.coulomb_model(limit, f.kinetic * load)
        return hub.jenkins_model([limit / length], [length])
    if f.law == "tanh":
        return hub.rate_model(limit, f.reference_speed)
    return _bonds(model, numerics, patch, load)


def _bonds(model: Model, numerics: Numerics, patch, load: float):
    """The contact of law 'nonlocal': a list of bonds, points behind shear modes, points of a field, or one point."""
    from ...dynamics.march import march as hub

    law, found, limit = model.bonds, quadrature_of(model, numerics), model.friction.static * load
    if found.engine != "recursion":
        from ...friction.bonds.quadrature import cutoff

        reach = cutoff(law.order, found.tail) if found.tail > 0 else np.inf
        return hub.list_model(law, limit, reach, found.merge)
    if model.soft:
        from ..patch.press import shear_of

        reduced = shear_of(patch, law, numerics.shear_modes, model.accuracy.tolerance)
        contact = hub.points_model(law, patch.pieces.interface.weight, patch.pressure.sigma_n, reduced)
        return replace(contact, reduction=reduced)
    if numerics.per_point:
        x, weight, sigma = patch.x, patch.pieces.interface.weight, patch.pressure.sigma_n
        return hub.points_model(law, weight, sigma, None, (x, sigma) if model.side == "lower" else None)
    return hub.points_model(law, [1.0], [load])
