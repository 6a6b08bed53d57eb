"""Contact points for tests of the march: laws from plain numbers, interfaces on modes, bonds, loads that change."""

import numpy as np

from patchfem.friction import Bonds
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.friction.laws.tanh import TanhLaw
from patchfem.time_steps import laws
from patchfem.time_steps.contacts import Contact, LowerPressure, PointSet


def make_coulomb(static, kinetic, load=1.0):
    """Return a rigid point with coefficients of static and kinetic friction under a load [N]."""
    return laws.make_coulomb(Coulomb(static=static, kinetic=kinetic), np.atleast_1d(float(load)))


def make_tanh(static, speed, load=1.0):
    """Return a point of the regularised law with a reference speed [m/s] under a load [N]."""
    return laws.make_tanh(TanhLaw(static=static, speed=speed), np.atleast_1d(float(load)))


def make_contact(point_laws, rows, springs=(), scale=0.0, length=0.0) -> Contact:
    """Return interfaces with one law each on rows (i, n) of slides per modal coordinate, and springs."""
    point_sets = [PointSet(law, row) for law, row in zip(point_laws, rows)]
    limit = sum(float(law.limits.sum()) for law in point_laws)
    return Contact([*point_sets, *springs], limit or scale, length)


def make_cubic_spring(stiffness, row) -> PointSet:
    """Return a spring of force k_3 q^3 on a port."""
    return PointSet(laws.make_cubic(stiffness), row, is_spring=True)


def make_interlocking_spring(stiffness, wavelength, row) -> PointSet:
    """Return a spring of sinusoidal force on a port."""
    return PointSet(laws.make_interlocking(stiffness, wavelength), row, is_spring=True)


def make_bond_contact(bonds, force, row, shear=None, bond_sum=None, lower=None) -> Contact:
    """Return points of bonds under forces (m,) [N], or over the pressure (2, m) of the lower piece."""
    loads = np.atleast_1d(np.asarray(force, float))
    below = {}
    if lower is not None:
        lower = np.array(lower, float)
        below = {"lower": LowerPressure(lower[0], loads, (lower,))}
        loads = loads * lower[1]
    law = laws.make_bonds(bonds, loads) if bond_sum is None else laws.make_list(bonds, loads)
    if below:
        law = laws.keep_loads(law)
    points = PointSet(law, row, None, shear, bond_sum=bond_sum, **below)
    return Contact([points], bonds.static * float(loads.sum()), bonds.length)


def make_pressed_contact(law, force, row, shear=None, bond_sum=None, **load) -> Contact:
    """Return points under a load that changes; laws "coulomb" and "tanh" act on the resultant of the forces (m,) [N]."""
    loads = np.atleast_1d(np.asarray(force, float))
    nodes = None if np.ndim(force) == 0 else np.arange(loads.size)
    length = 0.0
    if isinstance(law, Bonds):
        length = law.length
        points = laws.make_bonds(law, loads) if bond_sum is None else laws.make_list(law, loads)
    elif law.law == "coulomb":
        nodes = None
        points = make_coulomb(law.static, law.kinetic or law.static, loads.sum())
    elif law.law == "tanh":
        nodes = None
        points = make_tanh(law.static, law.reference_speed, loads.sum())
    else:
        length = law.bond_length
        points = laws.make_cells(law.static, length, loads)
    limit = (law.static or 1.0) * max(float(loads.sum()), 1e-9)
    point_sets = [PointSet(points, row, nodes, shear, bond_sum=bond_sum)]
    return Contact(point_sets, limit, length, preload=float(loads.sum()), **load)
