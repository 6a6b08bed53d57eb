"""Cells of a face: waves and free sides against elements, the solver against closed forms of half-spaces."""

from __future__ import annotations

import contact_forms as closed_forms
import numpy as np
import pytest
from open_cells import make_open_cells, make_periodic_cells
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk, j0, j1

from patchfem.contact import FaceLoading, make_block, solve_on_set
from patchfem.contact.bounded import BoundedProblem, solve_bounded
from patchfem.contact.cell_edges import compute_contact_stiffness, find_row_edges
from patchfem.contact.cells import CellCompliance
from patchfem.contact.press_cells import press_cells
from patchfem.contact.waves import compute_wave_compliance
from patchfem.core import NotConverged
from patchfem.elasticity import BlockShape, Layers, LayerStack, Piece, make_stack
from patchfem.elasticity.elasticity import lame_constants
from patchfem.mesh import TensorGrid
from patchfem.partial_slip.first_loading import STICK, find_reversal, make_cell_elements

LENGTH, HEIGHT, THICKNESS = 12.7e-3, 6.35e-3, 0.1524e-3
LOAD = 100.0
COATED = Layers((250e9, 0.24), (120e9, 0.32), "strain")
BARE = Layers((120e9, 0.32), (120e9, 0.32), "strain")
STEEL = LayerStack((), (), lame_constants(210e9, 0.3, "strain"))
MODULUS = 210e9 / (1 - 0.3**2) / 2


# ---- waves


def test_exact_short_wave_compliance_equals_coated_half_plane():
    """The compliance of a coated block for short waves, and of a coated half-space, equal that of a coated half-plane."""
    k = np.geomspace(1e3, 1e7, 50)
    expected = closed_forms.layered_compliance(k, COATED.coating, COATED.substrate, THICKNESS)
    half_space = LayerStack(
        (THICKNESS,),
        (lame_constants(*COATED.coating, "strain"),),
        lame_constants(*COATED.substrate, "strain"),
    )
    for stack in (make_stack(1.0, THICKNESS, COATED), half_space):
        assert compute_wave_compliance(k, stack).normal == pytest.approx(expected, rel=1e-12)


def test_exact_wave_across_its_vector_is_antiplane():
    """A wave across its vector has tanh(k h)/(mu k); the limit k = 0 is that of a bar in shear."""
    stack = make_stack(HEIGHT, 0.0, BARE)
    _, mu = stack.moduli[0]
    k = np.array([0.0, 1.0, 300.0, 1e5])
    expected = np.append(HEIGHT, np.tanh(k[1:] * HEIGHT) / k[1:]) / mu
    assert compute_wave_compliance(k, stack).across == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("component", [0, 1])
def test_order_of_strip_compliance_on_finite_elements(component, plane):
    """The finite-element compliance of a strip between frictionless walls converges to the closed form with order two.

    Normal (component 0) and tangential (component 1) waves of a coated piece are compared; a
    uniform load has the compliance of a bar to round-off.
    """
    layers = Layers(COATED.coating, COATED.substrate, plane)
    errors = []
    for cells in (40, 80):
        x = np.linspace(0, LENGTH, cells + 1)
        depth = np.concatenate(
            [
                np.linspace(0, THICKNESS, cells // 10 + 1)[:-1],
                THICKNESS + (HEIGHT - THICKNESS) * np.linspace(0, 1, cells // 2) ** 1.8,
            ]
        )
        piece = Piece(TensorGrid(x, depth, cells // 10), layers, guided=component)
        face = piece.factor.compliance[1 - component :: 2, 1 - component :: 2]
        weight = np.full(x.size, x[1])
        weight[[0, -1]] /= 2
        k = np.array([0.0, 2.0, 5.0]) * np.pi / LENGTH
        waves = compute_wave_compliance(k, make_stack(HEIGHT, THICKNESS, layers))
        expected = (waves.normal, waves.along)[component]
        computed = [np.ptp(face @ (weight * np.cos(wave_number * x))) / 2 for wave_number in k[1:]]
        errors.append(np.abs(np.array(computed) / expected[1:] - 1).max())
        assert face @ weight == pytest.approx(np.full(x.size, expected[0]), rel=1e-9)
    assert errors[1] < 4e-3 and 1.8 <= np.log2(errors[0] / errors[1]) <= 2.4, errors


# ---- rows of cells


def make_row(n_cells: int):
    """Return the normal compliance of a row of cells of two uncoated pieces between guides, one metre wide."""
    stack = make_stack(HEIGHT, 0.0, BARE)
    return make_block(BlockShape(LENGTH, 1.0, "x"), (stack, stack), (n_cells, 1), None).normal


def press_row(row, gap, load: float):
    """Return the positions of the contact edges of a row of cells, and the stiffness."""
    pressed = press_cells(row, gap[None], FaceLoading(load), tolerance=1e-10)
    pressure = pressed.pressure[0]
    active = pressure > 0
    rate = solve_on_set(row, active[None])[0]
    edges = find_row_edges(row, pressure, pressed.gap[0], rate)
    shift = np.zeros(gap.size)
    shift[edges.node + edges.side] = edges.fraction - 0.5
    return edges.position[0], compute_contact_stiffness(row, active[None], shift=shift)


def test_exact_row_edges_agree_with_refined_row(n_cells: int = 721):
    """Edges agree with cells an eighth as long within 0.03 of a cell, and the stiffness within 7e-5."""
    coarse, fine = (
        press_row(row, (row.x - 0.123e-3) ** 2 / (2 * 0.3), 2e4)
        for row in (make_row(n_cells), make_row(8 * n_cells))
    )
    assert coarse[0] == pytest.approx(fine[0], abs=0.03 * LENGTH / n_cells)
    assert coarse[1] == pytest.approx(fine[1], rel=7e-5)


# ---- solver


class Identity:
    """Cells without coupling, for which a bounded problem is the projection onto its constraints."""

    self_compliance = 1.0

    def product(self, traction):
        """Return the traction."""
        return traction.copy()

    precondition = product


@pytest.mark.parametrize("upper", [np.inf, 1500.0])
@pytest.mark.parametrize("spring", [0.0, 3.0])
def test_exact_projection_is_nearest_with_given_resultants(spring, upper, n_cells=60):
    """The projection has the resultants, and is a cut of forces that a rigid motion has shifted."""
    random = np.random.default_rng(7)
    rigid = np.stack([np.ones(n_cells), np.linspace(-1, 1, n_cells)])
    force = 1e3 * random.normal(size=n_cells)
    target = 2e4 * np.array([1.0, 0.2])
    springs = np.array([0.0, spring])
    problem = BoundedProblem(-force, 0.0, upper, rigid, target, springs)
    found = solve_bounded(Identity(), problem, tolerance=1e-12)
    expected = np.clip(force + found.motion @ rigid, 0.0, upper)
    assert found.traction == pytest.approx(expected, abs=1e-8)
    assert rigid @ found.traction + springs * found.motion == pytest.approx(target, abs=1e-7)


# ---- closed forms of half-spaces


def press_open(shape, size, gap, loading, stack=STEEL):
    """Return open cells and the pressed faces with a gap g(x, y)."""
    cells = make_open_cells(shape, size, stack)
    return cells, press_cells(cells, gap(cells.x, cells.y[:, None]), loading, tolerance=1e-9)


def test_hertz_sphere(radius=0.01, n_cells=128):
    """Peak, approach, area and stiffness of two spheres agree with Hertz on 128 x 128 cells."""
    half = (3 * LOAD * radius / 4 / MODULUS) ** (1 / 3)
    cells, pressed = press_open(
        (n_cells, n_cells),
        (2.6 * half, 2.6 * half),
        lambda x, y: (x**2 + y**2) / 2 / radius,
        FaceLoading(LOAD),
    )
    active = pressed.pressure > 0
    assert pressed.pressure.max() == pytest.approx(1.5 * LOAD / np.pi / half**2, rel=2e-4)
    assert pressed.approach == pytest.approx(half**2 / radius, rel=3e-5)
    # A digital disc counts its boundary too much (Yastrebov et al., Tribol. Lett. 65, 2017); what remains varies with
    # the number of cells by .5 %
    sides = sum(np.abs(np.diff(active.astype(int), axis=axis)).sum() for axis in (0, 1))
    area = (active.sum() - (np.pi - 1 + np.log(2)) / 24 * sides) * cells.cell_area
    assert area == pytest.approx(np.pi * half**2, rel=6e-3)
    assert compute_contact_stiffness(cells, active) == pytest.approx(2 * MODULUS * half, rel=2e-3)


def test_exact_hertz_ellipse(radius=0.01, ratio=4.0, n_cells=128):
    """Peak and approach agree with Hertz for curvatures 1 : 4."""
    low = 0.5 / (ratio * radius)
    high = 0.5 / radius

    def find_mismatch(m):
        """Return the error of the ratio of curvatures for a squared eccentricity."""
        return (ellipe(m) / (1 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - high / low

    m = brentq(find_mismatch, 1e-6, 1 - 1e-6)
    long = (3 * LOAD / (2 * np.pi * MODULUS * low) * (ellipk(m) - ellipe(m)) / m) ** (1 / 3)
    short = long * np.sqrt(1 - m)
    _, pressed = press_open(
        (n_cells, n_cells),
        (2.6 * short, 2.6 * long),
        lambda x, y: high * x**2 + low * y**2,
        FaceLoading(LOAD),
    )
    assert pressed.pressure.max() == pytest.approx(1.5 * LOAD / np.pi / long / short, rel=3e-4)
    approach = 3 * LOAD * ellipk(m) / (2 * np.pi * MODULUS * long)
    assert pressed.approach == pytest.approx(approach, rel=3e-5)


def test_disc_with_two_free_tilts(radius=1e-3, n_cells=128):
    """A flat disc under a load line off both axes has the approach and both tilts of the closed form within .5 %."""
    offset = radius / 5
    angle = np.radians(30)
    line = offset * np.array([np.cos(angle), np.sin(angle)])
    _, pressed = press_open(
        (n_cells, n_cells),
        (2.1 * radius, 2.1 * radius),
        lambda x, y: np.where(x**2 + y**2 <= radius**2, 0.0, 1.0),
        FaceLoading(LOAD, line_x=line[0], line_y=line[1]),
    )
    tilts = -3 * LOAD * line / (4 * MODULUS * radius**3)
    assert pressed.approach == pytest.approx(LOAD / (2 * MODULUS * radius), rel=3e-3)
    assert (pressed.tilt_x, pressed.tilt_y) == pytest.approx(tilts, rel=8e-3)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_refuses_load_line_beyond_cells(axis, length=1e-3):
    """A load outside the outermost cells tilts a free holder without end; a spring of the holder balances it."""

    def press(place, **springs):
        """Press a parabola by a load at a place along the axis."""
        loading = FaceLoading(LOAD, **{f"line_{axis}": place}, **springs)
        return press_open((24, 24), (length, length), lambda x, y: x**2 + y**2, loading)[1]

    with pytest.raises(
        NotConverged, match=r"load line at 0\.0006 m lies beyond .* at 0\.00047917 m"
    ):
        press(0.6 * length)
    held = press(0.6 * length, **{f"spring_{axis}": 1e4})
    assert held.pressure.sum() * (length / 24) ** 2 == pytest.approx(LOAD, rel=1e-8)
    assert press(0.05 * length).pressure.max() > 0


@pytest.mark.parametrize("wave", [(1, 0), (1, 1)])
def test_exact_westergaard_wave(wave, length=1e-3, amplitude=1e-6, n_cells=256):
    """A periodic wave along x or the diagonal has the peak and the contact fraction of Westergaard's solution."""
    k = 2 * np.pi / length * np.array(wave)
    full = MODULUS * amplitude * np.hypot(*k) / 2
    cells = make_periodic_cells((n_cells, n_cells), (length, length), STEEL)
    gap = amplitude * (1 - np.cos(k[0] * cells.x + k[1] * cells.y[:, None]))
    pressed = press_cells(cells, gap, FaceLoading(0.25 * full * length**2))
    assert pressed.pressure.max() == pytest.approx(full, rel=3e-4)
    assert (pressed.pressure > 0).mean() == pytest.approx(1 / 3, abs=0.012)


def test_exact_crossed_waves_in_full_contact(length=1e-3, amplitude=1e-6, n_cells=128):
    """Two crossed waves in full contact have the mean pressure plus that of both waves."""
    k = 2 * np.pi / length
    full = MODULUS * amplitude * k
    cells = make_periodic_cells((n_cells, n_cells), (length, length), STEEL)
    gap = -amplitude * (np.cos(k * cells.x) + np.cos(k * cells.y[:, None]))
    pressed = press_cells(cells, gap, FaceLoading(1.2 * full * length**2))
    exact = full * (1.2 + (np.cos(k * cells.x) + np.cos(k * cells.y[:, None])) / 2)
    assert pressed.pressure == pytest.approx(exact, rel=1e-6)


def press_coated_rings(radius, layer: LayerStack, largest, n_rings=160):
    """Return peak and approach of coated half-spaces by rings of uniform pressure and their Hankel integrals."""
    edges = np.linspace(0, largest, n_rings + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    (depth,), (top,), _ = layer
    soft = (top[0] + 2 * top[1]) / (2 * top[1] * (top[0] + top[1]))

    # A uniform disc: closed form of the homogeneous half-space, and the integral of what the coating changes
    k = np.concatenate([np.geomspace(1e-3, 1e-1, 300)[:-1], np.linspace(1e-1, 45, 5000)]) / depth
    weight = np.zeros(k.size)
    weight[1:] += np.diff(k) / 2
    weight[:-1] += np.diff(k) / 2
    change = (compute_wave_compliance(k, layer).normal - soft / k) * weight
    bessel = j0(np.outer(middle, k))
    columns = [np.zeros(n_rings)]
    for b in edges[1:]:
        inside = np.minimum(middle, b)
        outside = np.maximum(middle, b)
        m = (inside / outside) ** 2
        disc = np.where(middle < b, ellipe(m), middle / b * (ellipe(m) - (1 - m) * ellipk(m)))
        columns.append(2 / np.pi * soft * b * disc + bessel @ (change * b * j1(k * b)))
    compliance = 2 * np.diff(np.array(columns).T, axis=1)

    areas = np.pi * np.diff(edges**2)
    active = np.ones(n_rings, bool)
    while True:
        on = np.flatnonzero(active)
        matrix = np.zeros((on.size + 1, on.size + 1))
        matrix[:-1, :-1] = compliance[np.ix_(on, on)]
        matrix[:-1, -1] = -1
        matrix[-1, :-1] = areas[on]
        solved = np.linalg.solve(matrix, np.append(-(middle[on] ** 2) / 2 / radius, LOAD))
        if solved[:-1].min() >= 0:
            return solved[0], solved[-1]
        active[on[solved[:-1] < 0]] = False


def test_exact_sphere_on_coated_half_space(radius=0.1, n_cells=128):
    """The pressure of a sphere whose contact is three times as wide as the coating is thick agrees with rings."""
    layer = LayerStack(
        (THICKNESS,),
        (lame_constants(*COATED.coating, "strain"),),
        lame_constants(*COATED.substrate, "strain"),
    )
    half = (3 * LOAD * radius / 4 / (120e9 / (1 - 0.32**2) / 2)) ** (1 / 3)
    peak, _ = press_coated_rings(radius, layer, 1.3 * half)
    _, pressed = press_open(
        (n_cells, n_cells),
        (2.6 * half, 2.6 * half),
        lambda x, y: (x**2 + y**2) / 2 / radius,
        FaceLoading(LOAD),
        layer,
    )
    assert pressed.pressure.max() == pytest.approx(peak, rel=5e-4)


@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_cattaneo_mindlin(poisson, radius=0.01, friction=0.3, n_cells=128):
    """First loading, elements and the stick zone of a sphere agree with Cattaneo and Mindlin."""
    stack = LayerStack((), (), lame_constants(210e9, poisson, "strain"))
    mu = stack.base[1]
    modulus = 210e9 / (1 - poisson**2) / 2
    half = (3 * LOAD * radius / 4 / modulus) ** (1 / 3)
    size = (2.4 * half, 2.4 * half)
    cells, pressed = press_open(
        (n_cells, n_cells),
        size,
        lambda x, y: (x**2 + y**2) / 2 / radius,
        FaceLoading(LOAD),
        stack,
    )
    shear = make_open_cells((n_cells, n_cells), size, stack, "shear")
    limit = friction * pressed.pressure
    elements = make_cell_elements(shear, limit)
    displacement, cell_force, work_found = elements.loading

    stiffness = 8 * half * mu / (2 * (2 - poisson))
    gross = 1.5 * friction * LOAD / stiffness
    load = friction * LOAD
    exact = load * (1 - (1 - np.minimum(displacement / gross, 1)) ** 1.5)
    assert displacement[-1] == pytest.approx(gross, rel=1e-3)
    assert cell_force.sum(axis=1) == pytest.approx(exact, abs=1e-4 * load)
    left = np.maximum(1 - displacement / gross, 0.0) ** 2.5
    exact_work = load * (displacement - 0.4 * gross * (1 - left))
    assert work_found == pytest.approx(exact_work, abs=1e-4 * load * gross)

    # Loop of half the amplitude of gross slip, by Masing's rule
    amplitude = gross / 2
    passed = np.maximum(amplitude - elements.yield_displacement, 0.0)
    loop = 4 * (elements.stiffness * elements.yield_displacement) @ passed
    force = load * (1 - 0.5**1.5)
    work = load * (amplitude - 0.4 * gross * (1 - 0.5**2.5))
    assert loop == pytest.approx(8 * (work - force * amplitude / 2), rel=1e-3)
    status = find_reversal(shear, limit, amplitude).status
    stick = np.sqrt((status == STICK).sum() * cells.cell_area / np.pi)
    assert stick == pytest.approx(half * (1 - force / load) ** (1 / 3), rel=0.015)


def test_always_partial_slip_of_weakly_loaded_bonds_is_found_fast():
    """Bonds of cells with a small part of the load are very soft; the iterations hardly depend on it."""
    n_cells = 32
    order = np.hypot(*np.mgrid[:n_cells, :n_cells])
    cells = CellCompliance(1.0, 1.0, 1 / (1 + order))
    x = (np.arange(n_cells) + 0.5) / n_cells
    limit = np.outer(x**2, x**2)
    soft = cells.soften(limit.mean() / limit)
    problem = BoundedProblem(np.full(limit.shape, -0.1 * soft.product(limit).max()), -limit, limit)
    solution = solve_bounded(soft, problem, tolerance=1e-7)
    assert solution.residual <= 1e-7
    assert solution.n_iterations < 60
