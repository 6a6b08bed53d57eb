"""Pressed blocks with four free sides: against elements without waves, plane runs, symmetry, and energy."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hexahedra import Block, compute_stamp_stiffness

from patchfem.contact import FaceLoading, make_block
from patchfem.contact.cell_edges import compute_contact_stiffness
from patchfem.contact.press_cells import press_cells
from patchfem.core import NotConverged, PatchfemError
from patchfem.elasticity import BlockShape, Layers, make_stack, sides
from patchfem.partial_slip.first_loading import (
    SLIP,
    STICK,
    find_reversal,
    make_cell_elements,
    slip_from_rest,
)
from patchfem.partial_slip.shear_modes import shear_modes

LENGTH, HEIGHT, LOAD = 12.7e-3, 6.35e-3, 115.6538
TITANIUM = (121e9, 0.32)
COATED = make_stack(HEIGHT, 0.1524e-3, Layers((250e9, 0.24), TITANIUM, "strain"))
BARE = make_stack(4e-3, 0.0, Layers(TITANIUM, TITANIUM, "strain"))
SQUARE = BlockShape(LENGTH, LENGTH)
ROLL = 1e-4


@pytest.fixture(autouse=True)
def keep_cache_of_test_run(tmp_path_factory, monkeypatch):
    """Keep the changes by free sides in the folder of this run."""
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path_factory.getbasetemp()))


@cache
def get_block(shape=SQUARE, stack=COATED, cells=(64, 64), level=1):
    """Return the compliance of two equal blocks."""
    return make_block(shape, (stack, stack), cells, level)


def press_square(gap, cells=(64, 64), **loading):
    """Return the compliance of the square blocks and the pressed faces with a gap g(x, y)."""
    block = get_block(cells=cells)
    normal = block.normal
    heights = np.broadcast_to(gap(normal.x, normal.y[:, None]), normal.shape)
    return block, press_cells(normal, heights, FaceLoading(LOAD, **loading))


def compute_stiffnesses(block, active):
    """Return the normal and the shear stiffness [N/m] of a contact set."""
    return tuple(compute_contact_stiffness(part, active) for part in block)


# ---- stiffness against elements without waves


@pytest.mark.long
@pytest.mark.parametrize(
    "block, count, tolerance",
    [
        (Block(LENGTH, LENGTH, COATED), 3, 2.5e-3),
        (Block(10e-3, 6e-3, BARE), 3, 2.5e-3),
        pytest.param(Block(LENGTH, LENGTH, COATED), 5, 8e-4, marks=pytest.mark.slow),
        pytest.param(Block(10e-3, 6e-3, BARE), 5, 8e-4, marks=pytest.mark.slow),
        pytest.param(Block(8e-3, 16e-3, COATED), 5, 8e-4, marks=pytest.mark.slow),
    ],
)
def test_flat_block_agrees_with_hexahedra(block, count, tolerance):
    """Hexahedra are stiffer than flat blocks by less than their error, and two levels differ by 1e-3 at most."""
    shape = BlockShape(block.length, block.width)
    active = np.ones((32, 32), bool)
    coarse, fine = (
        compute_stiffnesses(get_block(shape, block.stack, (32, 32), level), active)
        for level in (0, 1)
    )
    for direction, low, high in zip(("normal", "shear"), coarse, fine, strict=True):
        expected = compute_stamp_stiffness(block, direction, count)
        assert high == pytest.approx(low, rel=1e-3)
        assert 0 <= expected / high - 1 <= tolerance, direction


@pytest.mark.long
@pytest.mark.parametrize("count", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_roll_agrees_with_hexahedra(count):
    """The stiffnesses of the strip that touches under a roll of .1 mrad agree with elements within 8e-3.

    Both kinds of stiffness converge slowly at the edge of the strip, from either side.
    """
    n_rows = 29
    end = LENGTH * (n_rows / 128 - 0.5)
    active = np.zeros((128, 128), bool)
    active[:n_rows] = True
    _, pressed = press_square(lambda x, y: ROLL * y, (128, 128))
    assert np.abs((pressed.pressure > 0).sum() / active.sum() - 1) < 0.02
    found = compute_stiffnesses(get_block(cells=(128, 128)), active)
    for direction, stiffness in zip(("normal", "shear"), found, strict=True):
        expected = compute_stamp_stiffness(Block(LENGTH, LENGTH, COATED), direction, count, end)
        assert stiffness == pytest.approx(expected, rel=0.011), direction


# ---- limits and symmetries that were fixed before


def test_exact_wide_block_without_tilt_across_is_plane():
    """Between guides along y, rows of cells have the pressure of the plane problem to 1e-8."""
    plane = BlockShape(LENGTH, LENGTH, "x")
    one = get_block(plane, COATED, (128, 1))
    many = get_block(plane, COATED, (128, 8))
    gap = one.normal.x**2 / 100 + 2e-5 * one.normal.x
    row = press_cells(one.normal, gap[None], FaceLoading(LOAD)).pressure
    rows = press_cells(many.normal, np.tile(gap, (8, 1)), FaceLoading(LOAD)).pressure
    assert rows == pytest.approx(np.tile(row, (8, 1)), abs=1e-6 * row.max())


def test_exact_plane_stiffnesses_equal_those_of_the_mesh():
    """A flat row has the stiffnesses 1848.86 +- .19 and 403.88 +- .13 N/um of plane elements (a run of 2.1.0)."""
    row = get_block(BlockShape(LENGTH, LENGTH, "x"), COATED, (128, 1), 2)
    normal, shear = compute_stiffnesses(row, np.ones((1, 128), bool))
    assert normal == pytest.approx(1848.86e6, abs=0.19e6)
    assert shear == pytest.approx(403.88e6, abs=0.13e6)


@pytest.mark.parametrize("free_sides", ["xy", "x"])
def test_exact_product_is_symmetric(free_sides, cells=(24, 20)):
    """1: a . C b = b . C a."""
    random = np.random.default_rng(1)
    first, second = random.normal(size=(2, *cells[::-1]))
    block = get_block(BlockShape(LENGTH, 0.7 * LENGTH, free_sides), COATED, cells, 0)
    for part in block:
        one = np.vdot(first, part.product(second))
        assert one == pytest.approx(np.vdot(second, part.product(first)), rel=1e-11)


def test_exact_uniform_pressure_on_guided_block():
    """2: The displacement between guides is that of confined layers."""
    guided = get_block(level=None)
    expected = 2 * sum(
        depth / (lam + 2 * mu) for depth, (lam, mu) in zip(COATED.thicknesses, COATED.moduli)
    )
    assert guided.normal.product(np.ones((64, 64))) == pytest.approx(expected, rel=1e-12)


def test_exact_block_without_lateral_strain_has_no_free_sides():
    """3: With Poisson's ratio 0 a uniform pressure does not strain the block along its face."""
    stack = make_stack(HEIGHT, 0.0, Layers((1e11, 0.0), (1e11, 0.0), "strain"))
    block = get_block(stack=stack, cells=(16, 16), level=0)
    expected = 2 * HEIGHT / 1e11
    assert block.normal.product(np.ones((16, 16))) == pytest.approx(expected, rel=1e-9)


def test_exact_exchange_of_axes():
    """4: A gap turned by 90 degrees has the turned pressure; the shear stiffness does not turn."""
    block, one = press_square(lambda x, y: ROLL * x + 0 * y)
    _, other = press_square(lambda x, y: ROLL * y + 0 * x)
    peak = one.pressure.max()
    assert other.pressure == pytest.approx(one.pressure.T, abs=1e-6 * peak)
    tilt = compute_contact_stiffness(block.shear, one.pressure > 0)
    roll = compute_contact_stiffness(block.shear, other.pressure > 0)
    assert roll < 0.85 * tilt


def test_exact_load_line_is_centre_of_pressure():
    """5: With both tilts free the centre of pressure lies on the load line."""
    line = (1e-3, -0.5e-3)
    block, pressed = press_square(lambda x, y: (x**2 + y**2) / 20, line_x=line[0], line_y=line[1])
    normal = block.normal
    force = pressed.pressure * normal.cell_area
    centre = (force.sum(axis=0) @ normal.x / LOAD, force.sum(axis=1) @ normal.y / LOAD)
    assert centre == pytest.approx(line, abs=1e-9 * LENGTH)
    assert force.sum() == pytest.approx(LOAD, rel=1e-11)


def test_exact_spring_between_fixed_and_free_tilt():
    """6: A stiff spring of the holder leaves the tilt fixed, a soft one free; between them M + K theta is the moment."""
    line = 1e-3

    def tilt_with(spring):
        """Return the tilt and the moment of the pressure."""
        block, pressed = press_square(lambda x, y: (x**2 + y**2) / 20, line_x=line, spring_x=spring)
        force = (pressed.pressure * block.normal.cell_area).sum(axis=0)
        return pressed.tilt_x, force @ block.normal.x

    free, _ = tilt_with(0.0)
    assert tilt_with(1e-6)[0] == pytest.approx(free, rel=1e-6)
    assert abs(tilt_with(1e12)[0]) < 1e-6 * abs(free)
    tilt, moment = tilt_with(1e3)
    assert moment == pytest.approx(LOAD * line + 1e3 * tilt, rel=1e-9)


def test_exact_pressure_scales_with_gap_and_load():
    """7: Twice the load on twice the gap has twice the pressure."""
    block, one = press_square(lambda x, y: (x**2 + 2 * y**2) / 10)
    normal = block.normal
    gap = (normal.x**2 + 2 * normal.y[:, None] ** 2) / 5
    other = press_cells(normal, gap, FaceLoading(2 * LOAD))
    assert other.pressure == pytest.approx(2 * one.pressure, abs=1e-6 * one.pressure.max())


@pytest.mark.parametrize("load", [1e-9, 1e-3, 1.0, 1e5])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_exact_equilibrium_where_points_barely_touch(load, radius):
    """Resultants and signs hold from three cells in contact to a full face, whatever the gaps beside them."""
    normal = get_block().normal
    gap = normal.x**2 / (2 * radius) + normal.y[:, None] ** 2 / (8 * radius)
    line = (0.9e-3, -0.3e-3)
    pressed = press_cells(normal, gap, FaceLoading(load, line_x=line[0], line_y=line[1]))
    force = pressed.pressure * normal.cell_area
    assert force.sum() == pytest.approx(load, rel=1e-7)
    assert (force @ normal.x).sum() == pytest.approx(load * line[0], rel=1e-6)
    assert (normal.y @ force).sum() == pytest.approx(load * line[1], rel=1e-6)
    assert pressed.pressure.min() >= 0 and pressed.gap.min() >= 0


def test_refuses_load_line_beyond_the_cells():
    """A load line within half a cell of an end cannot be balanced by these cells."""
    normal = get_block().normal
    line = normal.x[-1] + 0.1 * (normal.x[1] - normal.x[0])
    with pytest.raises(NotConverged, match=r"contact\.area\.cells"):
        press_cells(normal, np.zeros(normal.shape), FaceLoading(LOAD, line_x=line))


def test_exact_hardness_bounds_the_pressure():
    """8: A hardness above the peak changes nothing; one below it bounds the pressure and widens the contact."""
    _, free = press_square(lambda x, y: (x**2 + y**2) / 4)
    peak = free.pressure.max()
    _, above = press_square(lambda x, y: (x**2 + y**2) / 4, hardness=1.01 * peak)
    block, below = press_square(lambda x, y: (x**2 + y**2) / 4, hardness=peak / 2)
    assert above.pressure == pytest.approx(free.pressure, abs=1e-12 * peak)
    assert below.pressure.max() == peak / 2
    assert below.pressure.sum() * block.normal.cell_area == pytest.approx(LOAD, rel=1e-11)
    assert (below.pressure > 0).sum() > 1.2 * (free.pressure > 0).sum()
    # Yielded cells overlap, so that the gap there would be negative
    displacement = block.normal.product(below.pressure)
    normal = block.normal
    opening = (normal.x**2 + normal.y[:, None] ** 2) / 4 - below.approach + displacement
    yielded = below.pressure == peak / 2
    assert opening[yielded].max() <= 1e-8 * displacement.max()


def test_refuses_hardness_that_cannot_carry_the_load():
    """A hardness whose product with the area of the face is below the load is refused."""
    with pytest.raises(PatchfemError, match="hardness"):
        press_square(lambda x, y: 0 * x, hardness=0.9 * LOAD / LENGTH**2)


@cache
def get_slipping_cells():
    """Return the shear compliance and the friction limits of a face with both tilts."""
    block, pressed = press_square(lambda x, y: ROLL * (x + y), (128, 128))
    return block.shear, 0.3 * pressed.pressure


@cache
def get_elements():
    """Return the parallel elements of this face."""
    return make_cell_elements(*get_slipping_cells())


def test_first_loading_is_concave_and_ends_at_the_limit():
    """9: The curve begins with the stiffness of the set, is concave, and ends at the friction limit."""
    shear, limit = get_slipping_cells()
    elements = get_elements()
    displacement, force, _ = elements.loading
    slopes = np.diff(force.sum(axis=1)) / np.diff(displacement)
    assert force[-1].sum() == pytest.approx(0.3 * LOAD, rel=1e-9)
    stiffness = compute_contact_stiffness(shear, limit > 0)
    assert elements.stiffness.sum() == pytest.approx(stiffness, rel=5e-3)
    assert (np.diff(slopes) < 0).all() and slopes[-1] > 0


@pytest.mark.parametrize("fraction", [0.1, 0.25, 0.6, 0.9])
def test_loops_between_levels_have_the_slip_work(fraction):
    """Force and loop of the elements between the levels are those of a bounded problem, to 1e-4 and 2e-3."""
    shear, limit = get_slipping_cells()
    elements = get_elements()
    amplitude = fraction * elements.yield_displacement[-1]
    work = find_reversal(shear, limit, amplitude).slip_per_cycle @ limit.ravel() * shear.cell_area
    passed = np.maximum(amplitude - elements.yield_displacement, 0.0)
    assert 4 * (elements.stiffness * elements.yield_displacement) @ passed == pytest.approx(
        work, rel=2e-3
    )
    force = slip_from_rest(shear, limit, amplitude).traction.sum() * shear.cell_area
    found = np.minimum(amplitude, elements.yield_displacement) @ elements.stiffness
    assert found == pytest.approx(force, rel=1e-4)


def test_masing_loop_agrees_with_stepped_cycle(n_steps=12):
    """10: The loop area by elements is that of a cycle in steps, each from the slip before, within .1 %."""
    from patchfem.contact.bounded import BoundedProblem, solve_bounded

    shear, limit = get_slipping_cells()
    elements = get_elements()
    amplitude = elements.yield_displacement[-1] / 2
    passed = np.maximum(amplitude - elements.yield_displacement, 0.0)
    loop = 4 * (elements.stiffness * elements.yield_displacement) @ passed

    # One half cycle from the reversal; the other is its mirror image. The work is that of the friction force.
    first = slip_from_rest(shear, limit, amplitude)
    traction = first.traction
    slip = find_reversal(shear, limit, amplitude).slip_per_cycle.reshape(limit.shape) / 4
    dissipated = 0.0
    for displacement in np.linspace(amplitude, -amplitude, n_steps + 1)[1:]:
        problem = BoundedProblem(slip - displacement, -limit, limit)
        found = solve_bounded(shear, problem, traction, 1e-7)
        slips = (limit > 0) & (np.abs(found.traction) >= limit)
        step = np.where(slips, -found.slope, 0.0)
        dissipated += np.vdot(found.traction, step) * shear.cell_area
        slip = slip + step
        traction = found.traction
    assert traction == pytest.approx(-first.traction, abs=1e-3 * limit.max())
    assert 2 * dissipated == pytest.approx(loop, rel=1e-3)


def test_states_at_a_reversal():
    """Slipping cells are at their limit and slip forward, sticking ones do not slip, and open ones carry nothing."""
    shear, limit = get_slipping_cells()
    elements = get_elements()
    amplitude = elements.yield_displacement[-1] / 3
    traction = slip_from_rest(shear, limit, amplitude).traction
    state = find_reversal(shear, limit, amplitude)
    slips = state.status == SLIP
    sticks = state.status == STICK
    assert (slips | sticks).sum() == (limit > 0).sum() and slips.any() and sticks.any()
    assert traction.ravel()[slips] == pytest.approx(limit.ravel()[slips])
    assert not state.slip_per_cycle[~slips].any() and (state.slip_per_cycle[slips] >= 0).all()
    force = np.minimum(amplitude, elements.yield_displacement) @ elements.stiffness
    assert traction.sum() * shear.cell_area == pytest.approx(force, rel=5e-3)


def test_exact_shear_modes_diagonalise_the_compliance(n_modes=6):
    """Shapes are orthonormal with the limits, and stiffness times compliance reproduces them."""
    shear, limit = get_slipping_cells()
    modes = shear_modes(shear, limit.ravel() * shear.cell_area, n_modes)
    weighted = modes.limit[:, None] * modes.shape
    assert modes.shape.T @ weighted == pytest.approx(np.eye(n_modes), abs=1e-9)
    for shape, force, stiffness in zip(modes.shape.T, weighted.T, modes.stiffness):
        forces = np.zeros(limit.size)
        forces[modes.points] = force
        moved = (shear @ forces)[modes.points]
        assert stiffness * moved == pytest.approx(shape, abs=1e-7 * np.abs(shape).max())


def test_exact_rigid_cells_on_a_spring_share_its_force():
    """Cells of rigid pieces yield together, with the stiffness of the spring, and share its force by their limits."""
    shear = get_block().shear
    rigid = replace(shear, waves=np.zeros(shear.shape), sides=None).add_spring(1e-8)
    limit = np.linspace(0.0, 1e6, shear.waves.size).reshape(shear.shape)
    elements = make_cell_elements(rigid, limit)
    assert elements.stiffness == pytest.approx([1e8])
    forces = elements.force_matrix @ (elements.yield_displacement / 2)
    assert forces == pytest.approx(elements.limit / 2)
    assert compute_contact_stiffness(rigid, limit > 0) == pytest.approx(1e8)
    assert shear_modes(rigid, limit.ravel(), 4).stiffness.size == 1


@pytest.mark.long
@pytest.mark.parametrize("finer", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_finer_bricks_keep_partial_slip(finer):
    """Finer bricks of the free sides change the force at half of gross slip by 2e-4, the stiffness by 1e-3."""
    forces, stiffnesses = [], []
    for level in (1, finer):
        block = get_block(level=level)
        gap = ROLL / 2 * (block.normal.x + block.normal.y[:, None])
        pressure = press_cells(block.normal, gap, FaceLoading(LOAD)).pressure
        elements = make_cell_elements(block.shear, 0.3 * pressure)
        forces.append(np.minimum(0.17e-6, elements.yield_displacement) @ elements.stiffness)
        stiffnesses.append(compute_contact_stiffness(block.shear, np.ones((64, 64), bool)))
    assert forces[0] == pytest.approx(forces[1], rel=2e-4)
    assert stiffnesses[0] == pytest.approx(stiffnesses[1], rel=1e-3)


def test_small_sphere_on_blocks_has_the_local_stiffness_of_mindlin(radius=0.5):
    """Gross slip exceeds the friction limit over the stiffness by half of Mindlin's local displacement, within 1 %.

    The block adds a displacement in proportion to the force, which the difference leaves out.
    """
    block = get_block(
        SQUARE, make_stack(HEIGHT, 0.0, Layers(TITANIUM, TITANIUM, "strain")), (256, 256)
    )
    normal = block.normal
    pressed = press_cells(
        normal, (normal.x**2 + normal.y[:, None] ** 2) / 2 / radius, FaceLoading(LOAD)
    )
    limit = 0.3 * pressed.pressure
    gross_slip = float(block.shear.product(limit)[limit > 0].max())
    friction = 0.3 * LOAD
    local = friction / (
        2 * (gross_slip - friction / compute_contact_stiffness(block.shear, limit > 0))
    )

    young, poisson = TITANIUM
    modulus = young / (1 - poisson**2) / 2
    half = (3 * LOAD * radius / 4 / modulus) ** (1 / 3)
    mindlin = 4 * half * young / (2 * (1 + poisson)) / (2 - poisson)
    assert half < 0.14 * HEIGHT
    assert local == pytest.approx(mindlin, rel=0.01)


# ---- cache of the free sides


def test_exact_free_sides_are_cached_on_disk(monkeypatch):
    """The change by free sides is computed once and then read, also by a new process; a damaged file is replaced, and the
    oldest files are removed beyond a number."""
    shape = BlockShape(9e-3, 8e-3)
    sides.compute_side_change.cache_clear()
    first = sides.compute_side_change(BARE, shape, 0)
    sides.compute_side_change.cache_clear()
    with monkeypatch.context() as context:
        context.setattr(sides, "_compute_changes", None)
        again = sides.compute_side_change(BARE, shape, 0)
    assert np.array_equal(first.normal, again.normal)
    assert np.array_equal(first.shear, again.shear)

    folder = sides.user_cache.find_cache_base() / sides.CACHE_FOLDER_NAME
    monkeypatch.setattr(sides, "MAX_CACHED_BLOCKS", 1)
    for path in folder.glob("*.npz"):
        path.write_bytes(b"PK damaged")
    sides.compute_side_change.cache_clear()
    assert np.array_equal(sides.compute_side_change(BARE, shape, 0).normal, first.normal)
    assert len(list(folder.glob("*.npz"))) == 1
