"""Shipped scenes through `points.march` in place of today's march, for comparisons of their measures.

The contact models of `dynamics.march` are converted to `points.contacts`; the evaluation of a run stays.
"""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from patchfem.dynamics.interfaces.arrays import PointRow
from patchfem.dynamics.march import march as engine
from patchfem.dynamics.march.joints import JointsModel
from patchfem.dynamics.march.varying_load import LawKind, VaryingLoadModel
from patchfem.friction.bonds.parameters import Bonds
from patchfem.points import laws, march
from patchfem.points.contacts import Contact, PointSet, convert_element


def make_growing_bonds(static: float, length: float, growth, initial: float) -> Bonds:
    """Return Bonds of order 1 from the numbers of today's kernels."""
    grows = growth[0] >= 0
    return Bonds(
        static, length, ratio=growth[4] / growth[3], initial=initial,
        rest_growth=growth[0] if grows else None, slip_growth=growth[1] if grows else None, rest_speed=growth[2],
    )  # fmt: skip


def convert_sheared(model, row) -> PointSet:
    """Return the points of a sheared contact of bonds of order 1."""
    count = model.reduction.points.size
    weight = model.fields["weight"][:count]
    load = model.fields["points"][PointRow.LOAD, :count]
    density = model.fields["points"][PointRow.DENSITY, :count]
    force = weight * load * model.length
    initial = float(density[0] / load[0])
    bonds = make_growing_bonds(1.0, model.length, model.fields["growth"], initial)
    return PointSet(
        [laws.make_bonds(bonds, one) for one in force], row, None,
        np.array(model.reduction.shape.T), np.asarray(model.reduction.stiffness, float),
    )  # fmt: skip


def convert(model, modes) -> Contact:
    """Return the contact of a model of today's march."""
    if isinstance(model, VaryingLoadModel):
        return convert_varying(model)
    if isinstance(model, JointsModel):
        sets = [] if model.patch is None else [convert_single(model.patch, model.rows[0])]
        for joint in model.joints:
            row = model.rows[joint.port]
            numbers = joint.element.numbers
            if joint.potential is None:
                sets.append(PointSet(convert_element(joint.element), row))
            elif numbers[1]:
                sets.append(PointSet([laws.make_cubic(numbers[1])], row, is_spring=True))
            else:
                sets.append(PointSet([laws.make_interlocking(*numbers[2:4])], row, is_spring=True))
        return Contact(sets)
    return Contact([convert_single(model, modes.slide)])


def convert_single(model, row) -> PointSet:
    """Return the points of a ContactModel."""
    if model.element is not None:
        return PointSet(convert_element(model.element), row)
    if model.contact.endswith("shear_kernels"):
        return convert_sheared(model, row)
    raise NotImplementedError(model.contact)


def convert_varying(model) -> Contact:
    """Return the contact of a VaryingLoadModel."""
    law = model.law
    force = np.array([model.preload]) if model.sets is None else model.sets.force
    nodes = None if model.sets is None else np.arange(force.size)
    if law.kind == LawKind.COULOMB:
        points, nodes = [laws.make_coulomb(law.static, law.force[1], model.preload)], None
    elif law.kind == LawKind.RATE:
        points, nodes = [laws.make_tanh(law.static, law.force[1], model.preload)], None
    elif law.kind == LawKind.PLASTIC:
        points = [laws.make_jenkins(law.static, law.length, one) for one in force]
    elif law.kind == LawKind.POINTS:
        bonds = make_growing_bonds(law.static, law.length, law.growth, law.force[3])
        points = [laws.make_bonds(bonds, one) for one in force]
    else:
        raise NotImplementedError("lists")
    shear = {}
    if model.shear is not None:
        shear = {
            "shapes": np.array(model.shear.shape.T),
            "stiffness": np.asarray(model.shear.stiffness, float),
        }
    return Contact(
        [PointSet(points, model.rows[0], nodes, **shear)], model.sets, model.rows[1], model.rows[2], model.load,
        model.preload,
    )  # fmt: skip


def convert_snapshot(one, model) -> dict:
    """Return a snapshot in the form of today's march."""
    memory = one.memory
    out = {
        "time": one.time,
        "slide": one.slide,
        "rate": one.rate,
        "force": one.force,
        "slip": one.slip,
    }
    if not isinstance(model, VaryingLoadModel):
        stretch = memory[0] * 0
        bonds = np.stack([memory[1], memory[2], memory[3], stretch, stretch])
        return out | {"stretch": stretch, "b": one.shear, "bonds": bonds}
    # Elastic-plastic points have the rows force and springs, bonds m, z and s2.
    rows = memory[[0, 1, 1]] if model.law.kind == LawKind.PLASTIC else memory[1:4]
    nodal = one.nodal if model.sets is not None else one.load
    bend = 0.0 if model.shear is None else one.shear @ np.array(model.shear.shape.T)
    if not model.has_point_loads:
        rows, bend = np.zeros((3, nodal.size)), 0.0
    return out | {
        "heave": one.heave,
        "turn": one.pitch,
        "nodal": nodal,
        "b": one.shear,
        "memory": rows,
        "bend": bend,
    }


@contextmanager
def marched_by_points():
    """Replace today's march by `points.march` as long as the context is open."""
    old = engine.march, engine.warm_up
    count = []

    def run(modes, drive, model, cycles, steps, window=10, travel=np.inf, frames=0, say=None, progress=None,
            start=None, marks=(), **options):  # fmt: skip
        contact = convert(model, modes)
        count.append(steps)
        done = march.march(
            modes,
            drive,
            contact,
            cycles,
            steps,
            window=window,
            travel=travel,
            start=start,
            frames=frames,
        )
        return replace(done, snapshots=[convert_snapshot(one, model) for one in done.snapshots])

    engine.march, engine.warm_up = run, lambda *arguments: None
    try:
        yield count
    finally:
        engine.march, engine.warm_up = old
