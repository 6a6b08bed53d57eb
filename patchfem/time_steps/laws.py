"""Numbers and first memory of the laws of contact points, from keys of a scene or from parameters."""

from importlib import import_module
from typing import NamedTuple

import numpy as np

from ..core import MIN_LOAD
from ..friction.bonds.parameters import Bonds, growth_numbers
from ..friction.laws.iwan import slider_cells
from .step_rows_kernels import VECTOR, WIDTH, BondRow, Law

MIN_LENGTH = 1e-30  # length [m] in place of no length, by which a stiffness is divided
# Cells of an Iwan model; the force of first loading is exact to 6e-5 of the friction limit for chi >= -0.5
N_CELLS = 96
NO_GROWTH = (-1.0, 0.0, 0.0, 0.0, 0.0)  # growth numbers of bonds of constant length


class Blocks(NamedTuple):
    """Arrays of b blocks of points.

    - numbers (b, k WIDTH), memory (b, l WIDTH): rows of the law
    - load, back (b, WIDTH): normal load [N], and the load that limits a slide to -x
    - count (b,): number of points
    """

    numbers: np.ndarray
    memory: np.ndarray
    load: np.ndarray
    back: np.ndarray
    count: np.ndarray


class Sliders(NamedTuple):
    """Parallel cells of a point.

    - weights (K,): fractions of the friction limit
    - softness (K,): inverse lengths [1/m]
    """

    weights: np.ndarray
    softness: np.ndarray


class PointLaw(NamedTuple):
    """Law of m contact points.

    - law: number of the law, or the module that has its function `slide`
    - numbers (k, m), memory (l, m): as described by the law
    - load (m,): normal load [N] at the start
    - stiffness, viscosity (m,): of a point at rest [N/m], [N s/m]
    - sliders: cells of all points, of the law SLIDERS
    - back (m,): load that limits a slide to -x [N], of a law that averages the pressure; None for `load`
    """

    law: Law | str
    numbers: np.ndarray
    memory: np.ndarray
    load: np.ndarray
    stiffness: np.ndarray
    viscosity: np.ndarray
    sliders: Sliders | None = None
    back: np.ndarray | None = None

    def make_blocks(self) -> "Blocks":
        """Return the arrays of the blocks of these points; the places behind the last point have no load."""
        count = self.load.size
        n_blocks = -(-count // WIDTH)
        pad = n_blocks * WIDTH - count

        def reshape(rows, mode):
            """Return rows (k, m) by blocks, (b, k WIDTH)."""
            padded = np.pad(rows, ((0, 0), (0, pad)), mode)
            blocks = padded.reshape(len(rows), n_blocks, WIDTH).swapaxes(0, 1)
            return blocks.reshape(n_blocks, len(rows) * WIDTH)

        # The first row of a memory may be a length, by which a law divides.
        numbers = reshape(self.numbers, "edge")
        memory = reshape(self.memory, "constant")
        memory[:, :WIDTH] = reshape(self.memory[:1], "edge")
        load = reshape(self.load[None], "constant")
        back = load if self.back is None else reshape(self.back[None], "constant")
        if self.sliders is not None:
            size = self.sliders.weights.size
            cells = np.concatenate([np.full(WIDTH, float(size)), *self.sliders])
            numbers = np.hstack([numbers, np.tile(cells, (n_blocks, 1))])
            springs = np.repeat(load[:, :, None], size, axis=2)
            memory = np.concatenate([np.zeros_like(springs), springs], axis=2)
            memory = memory.reshape(n_blocks, 2 * size * WIDTH)
        counts = np.minimum(count - WIDTH * np.arange(n_blocks), WIDTH)
        return Blocks(numbers, memory, load, back, counts)

    def select(self, points) -> "PointLaw":
        """Return the law of the points that a mask (m,) selects."""
        back = None if self.back is None else self.back[points]
        arrays = self.numbers, self.memory, self.load, self.stiffness, self.viscosity
        return PointLaw(self.law, *(array[..., points] for array in arrays), self.sliders, back)

    @property
    def limits(self) -> np.ndarray:
        """Friction limits (m,) [N] at the start; the first number of a law is its coefficient of friction."""
        return self.numbers[0] * self.load


def pack_points(law: Law | str, numbers, memory, load, stiffness=0.0, viscosity=0.0) -> PointLaw:
    """Return a PointLaw from its rows, which are floats or arrays (m,).

    Parameters
    ----------
    law : Law or str
        Number of the law, or the module that has its function.
    numbers, memory : sequence of float or (m,) array
        Rows of numbers and of the first memory.
    load : float or (m,) array
        Normal load [N].
    stiffness, viscosity : float or (m,) array
        Of a point at rest [N/m], [N s/m].
    """
    last = load, stiffness, viscosity
    rows = np.broadcast_arrays(np.zeros(1), *numbers, *memory, *last)[1:]
    rows = np.array(rows, float)
    first = len(numbers)
    return PointLaw(law, rows[:first], rows[first:-3], *rows[-3:])


def make_cells(static, length, load, *, is_fixed: bool = False) -> PointLaw:
    """Return points of a spring and a slider each.

    Parameters
    ----------
    static : float or (m,) array
        Coefficient of friction.
    length : float or (m,) array
        Slide [m] at which an unstretched point slips under `load`.
    load : float or (m,) array
        Normal load [N].
    is_fixed : bool
        Whether the stiffness stays that under `load` when the load changes.
    """
    length = np.maximum(length, MIN_LENGTH)
    return pack_points(
        Law.CELLS, (static, length, float(is_fixed)), (0.0, load), load, static * load / length
    )


def make_elements(stiffness, yields) -> PointLaw:
    """Return t parallel elements of constant limits, a point each.

    Parameters
    ----------
    stiffness, yields : (t,) array
        Stiffnesses [N/m] and slides at which the elements yield [m].
    """
    return make_cells(np.multiply(stiffness, yields), np.asarray(yields, float), 1.0)


def make_iwan(law, load, n_cells: int = N_CELLS) -> PointLaw:
    """Return points of an Iwan model (`friction.laws.iwan.Iwan`) under a load.

    Parameters
    ----------
    law : Iwan
        Law per newton of load.
    load : float or (m,) array
        Normal load [N].
    n_cells : int
        Number of cells into which the model is divided.

    Returns
    -------
    PointLaw
    """
    cells = slider_cells(law.static, law.stiffness, law.chi, law.beta, n_cells)
    forces = cells.stiffness * cells.yield_displacement
    count = -(-forces.size // VECTOR) * VECTOR
    weights = np.zeros(count)
    weights[: forces.size] = forces / forces.sum()
    softness = np.ones(count)
    softness[: forces.size] = 1 / cells.yield_displacement
    stiffness = law.stiffness * np.asarray(load, float)
    points = pack_points(Law.SLIDERS, (law.static,), (0.0,), load, stiffness)
    return points._replace(sliders=Sliders(weights, softness))


def make_bonds(bonds: Bonds, load) -> PointLaw:
    """Return points of bonds of order 1 and reading "stretch" under a load [N]."""
    rest = (0.0,) * 6
    numbers = (bonds.static, bonds.length, *growth_numbers(bonds), bonds.initial, *rest)
    load = np.asarray(load, float)
    memory = (bonds.length, bonds.initial * load, 0.0, 0.0)
    return pack_points(Law.BONDS, numbers, memory, load, bonds.static * load / bonds.length)


def make_list(bonds: Bonds, load) -> PointLaw:
    """Return points under a load [N] whose bonds are summed one by one, over lists."""
    load = np.asarray(load, float)
    return pack_points(
        Law.LIST, (bonds.static, 0.0), (0.0,), load, bonds.static * load / bonds.length
    )


def keep_loads(points: PointLaw) -> PointLaw:
    """Return points whose bonds, if they have any, keep the load under which they formed until they have none."""
    if points.law != Law.BONDS:
        return points
    numbers = points.numbers.copy()
    numbers[BondRow.IS_KEPT // WIDTH] = 1.0
    return points._replace(numbers=numbers)


def make_lugre(law, load) -> PointLaw:
    """Return points of the LuGre law (`friction.laws.lugre.LuGre`) under a load [N], as a sum over bonds."""
    length = law.static / law.stiffness
    damping = (law.kinetic, law.speed, law.micro_damping, law.viscous, 0.0, 0.0)
    numbers = (law.static, length, *NO_GROWTH, 1.0, *damping)
    load = np.asarray(load, float)
    viscosity = (law.micro_damping + law.viscous) * load
    memory = (length, load, 0.0, 0.0)
    return pack_points(Law.BONDS, numbers, memory, load, law.stiffness * load, viscosity)


def make_bouc_wen(law, load) -> PointLaw:
    """Return points of the Bouc-Wen law (`friction.laws.bouc_wen.BoucWen`) under a load [N]."""
    numbers = (law.static, law.length, law.exponent, law.shape)
    stiffness = law.static * np.asarray(load, float) / law.length
    return pack_points(Law.BOUC_WEN, numbers, (0.0, load), load, stiffness)


def make_tanh(law, load, compliance=0.0) -> PointLaw:
    """Return points of the regularised law (`friction.laws.tanh.TanhLaw`) under a load.

    Parameters
    ----------
    law : TanhLaw
        Law per newton of load.
    load : float or (m,) array
        Normal load [N].
    compliance : float or (m,) array
        Compliance [m/N] in series with a point; 0 for none.

    Returns
    -------
    PointLaw
    """
    load = np.asarray(load, float)
    if np.any(compliance):
        # In a series of both, the spring limits the force of fast motions.
        stiffness = 1 / compliance
        viscosity = 0.0
    else:
        stiffness = 0.0
        viscosity = law.static * load / law.speed
    numbers = (law.static, law.speed, compliance)
    return pack_points(Law.TANH, numbers, (0.0, 0.0, 0.0), load, stiffness, viscosity)


def make_coulomb(law, load, compliance=0.0) -> PointLaw:
    """Return points of Coulomb's law under a load.

    Parameters
    ----------
    law : Coulomb
        Law per newton of load.
    load : float or (m,) array
        Normal load [N].
    compliance : float or (m,) array
        Compliance [m/N] in series with a point, which makes it elastic-plastic, with a stiffness that does not follow the
        load; 0 for a rigid point.

    Returns
    -------
    PointLaw
    """
    if np.any(compliance):
        # The stiffness 1/compliance is that of the springs of a reference load, also at points that have no load yet.
        reference = np.max(load)
        length = law.static * reference * np.asarray(compliance)
        stiffness = law.static * reference / length
        numbers = (law.static, length, 1.0)
        return pack_points(Law.CELLS, numbers, (0.0, reference), load, stiffness)
    return pack_points(Law.COULOMB, (law.static, law.kinetic), (0.0,), load)


def make_cubic(stiffness: float) -> PointLaw:
    """Return a spring of force stiffness q^3, with the stiffness in N/m3."""
    return pack_points(Law.CUBIC, (stiffness,), (0.0,), 1.0)


def make_interlocking(stiffness: float, wavelength: float) -> PointLaw:
    """Return a spring whose force is sinusoidal, of stiffness [N/m] at rest and a wavelength [m]."""
    return pack_points(Law.INTERLOCK, (stiffness, wavelength), (0.0,), 1.0, stiffness)


def _make_elastic_plastic(law, load, compliance=0.0) -> PointLaw:
    """Return elastic-plastic points (eq. 3.12) under a load [N]; a compliance of shear modes left out is neglected."""
    return make_cells(law.static, law.length, load)


# Function (law, load) that returns the points of a law, by `friction.law`; other laws have a module with `make_points`
MAKERS = {
    "coulomb": make_coulomb,
    "convolution": make_coulomb,
    "elastic-plastic": _make_elastic_plastic,
    "iwan": make_iwan,
    "nonlocal": make_bonds,
    "lugre": make_lugre,
    "bouc-wen": make_bouc_wen,
    "tanh": make_tanh,
}
# Laws that are stiff or rigid, so that points need the compliance of the shear modes left out
STIFF_LAWS = ("coulomb", "convolution", "tanh")


def make_point_law(name: str, law, load, compliance=0.0) -> PointLaw:
    """Return points with a friction law under a load [N].

    Parameters
    ----------
    name : str
        Name of the law, `friction.law`.
    law : friction law per newton of load, or friction.bonds.parameters.Bonds
        Law as `friction.record.make_law` returns it.
    load : float or (m,) array
        Normal load [N].
    compliance : float or (m,) array
        Compliance [m/N] of the shear modes left out, which the laws in STIFF_LAWS need.
    """
    load = np.maximum(load, MIN_LOAD)
    if name not in MAKERS:
        return import_module(f"{__package__}.{name}_kernels").make_points(law, load)
    if name in STIFF_LAWS:
        return MAKERS[name](law, load, compliance)
    return MAKERS[name](law, load)
