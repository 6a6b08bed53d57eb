"""Ten checks of scenes with [contact.area] whose truths were fixed before the first run: rigid pieces on a layer of springs,
Hertz, plane strain, symmetry and energy. Each value lies in its interval, which is as narrow as the tolerance asks for.
Then the plane limit, and the CPU time of the shipped pieces."""

from time import process_time

import numpy as np
import pytest

import patchfem as pf
from patchfem.partial_slip.first_loading import make_cell_elements
from patchfem.runs.patch import area

LOAD = 26 * 4.4482216152605  # N
SIDE, HEIGHT = 12.7e-3, 6.35e-3  # m
SPRINGS = 1e11  # Pa/m
TITANIUM = {"substrate": "Ti-8Al-1Mo-1V"}
BLOCK = {
    "length": "12.7 mm",
    "width": "12.7 mm",
    "height": "6.35 mm",
    "load": "26 lbf",
    "area": {},
}
# Rigid pieces whose faces stand on equal springs that do not depend on each other
RIGID = {
    "substrate": {"young": "1e18 Pa", "poisson": 0.3, "density": "4370 kg/m^3"},
    "asperities": {"law": "linear", "normal_stiffness": f"{SPRINGS} Pa/m"},
}


def run(*tables, **others):
    """Return the result of a block with other keys of [contact] and more tables."""
    contact = BLOCK
    for table in tables:
        contact = contact | table
    return pf.run({"contact": contact, "accuracy": {"tolerance": 1e-2}} | others)


def check(result, tolerance=1e-2, **truths):
    """Assert that each truth lies within the stated error of its measure, which meets the tolerance."""
    for name, truth in truths.items():
        measure = result.measures[name]
        assert abs(measure.value - truth) <= measure.error, name
        assert measure.error <= tolerance * abs(truth), name


def test_exact_springs_under_load_off_the_middle():
    """1: Both free tilts are the moments over the stiffness of the springs; the whole face is in contact."""
    result = run(RIGID, {"load_line": {"offset": "1 mm", "across": "-0.5 mm"}})
    inertia = SPRINGS * SIDE**4 / 12
    check(
        result,
        contact_fraction=1.0,
        rotation=-LOAD * 1e-3 / inertia,
        roll=LOAD * 0.5e-3 / inertia,
        normal_stiffness=SPRINGS * SIDE**2,
        rotational_stiffness=inertia,
        roll_stiffness=inertia,
    )


def test_exact_wedge_on_springs(angle=2.8e-3):
    """2: A tilt presses a strip of the springs, with a pressure that falls linearly."""
    length = np.sqrt(2 * LOAD / (SPRINGS * angle * SIDE))
    result = run(RIGID, {"tilt": {"angle": f"{angle} rad"}})
    check(
        result,
        contact_fraction=length / SIDE,
        pressure_centre=-SIDE / 2 + length / 3,
        normal_stiffness=SPRINGS * SIDE * length,
    )


def test_exact_hard_wedge_on_springs(angle=2.8e-3):
    """3: A hardness of half the largest pressure cuts the wedge, and the contact is longer."""
    slope = SPRINGS * angle
    hardness = float(np.sqrt(2 * LOAD * slope / SIDE) / 2)
    length = LOAD / SIDE / hardness + hardness / (2 * slope)
    result = run(
        RIGID, {"area": {"hardness": f"{hardness!r} Pa"}, "tilt": {"angle": f"{angle} rad"}}
    )
    check(result, contact_fraction=length / SIDE)

    # The parabola through the largest pressures ends at the hardness
    assert result.measures["pressure_peak"].value == hardness

    # Yielded cells are counted, here in whole columns, of which the edge may have two too many
    yielded = (length - hardness / slope) / SIDE
    check(result, 2 / result.patch.shape[1] / yielded, yielded_fraction=yielded)


def test_exact_sphere_on_springs(radius=0.5):
    """4: A sphere on springs has a parabolic pressure over a circle."""
    depth = np.sqrt(LOAD / (np.pi * SPRINGS * radius))
    result = run(RIGID, {"crown": {"radius": f"{radius} m", "across": f"{radius} m"}})
    check(
        result,
        contact_area=2 * np.pi * radius * depth,
        pressure_peak=SPRINGS * depth,
        approach=depth,
        normal_stiffness=SPRINGS * 2 * np.pi * radius * depth,
    )


@pytest.mark.parametrize("load", [LOAD, LOAD / 8])
def test_small_sphere_is_hertz(load, radius=0.5):
    """5, 6: The contact of a small sphere is that of half-spaces within 1 %; an eighth of the load halves its radius."""
    sphere = {"crown": {"radius": f"{radius} m", "across": f"{radius} m"}, "load": f"{load!r} N"}
    result = run(TITANIUM, sphere, {"area": {"cells": 256}})
    piece = pf.build({"contact": BLOCK | TITANIUM}).patch.pieces.lower.substrate
    modulus = piece.young / (1 - piece.poisson**2) / 2
    half = (3 * load * radius / 4 / modulus) ** (1 / 3)
    peak = result.measures["pressure_peak"].value
    assert peak == pytest.approx(1.5 * load / (np.pi * half**2), rel=0.01)
    assert result.measures["contact_area"].value == pytest.approx(np.pi * half**2, rel=0.01)


def test_wide_flat_block_is_plane_strain(ratio=16):
    """7: The stiffnesses of a flat block 16 times as wide as tall are those of plane strain within 2 %."""
    wide = TITANIUM | {"width": f"{ratio * HEIGHT} m"}
    face = run(wide)
    plane = BLOCK | wide
    del plane["area"]
    expected = pf.run({"contact": plane}).measures
    for name in ("normal_stiffness", "tangential_stiffness"):
        assert face.measures[name].value == pytest.approx(expected[name].value, rel=0.02)


COARSE = {"area": {"cells": 64}}
SHAPES = {"tilt": {"angle": "0.05 mrad", "roll": "0.08 mrad"}, "crown": {"radius": "60 m"}}


def test_exact_approach_of_a_load_returns_the_load():
    """8: The approach that a load causes, prescribed, causes the load."""
    crown = {"crown": {"radius": "10 m", "across": "40 m"}}
    approach = run(TITANIUM, crown, COARSE).measures["approach"].value
    prescribed = BLOCK | TITANIUM | crown | COARSE | {"approach": {"distance": f"{approach!r} m"}}
    del prescribed["load"]
    result = pf.run({"contact": prescribed, "accuracy": {"tolerance": 1e-2}})
    assert result.measures["normal_load"].value == pytest.approx(LOAD, rel=1e-6)


def test_exact_opposite_tilts_mirror_the_contact():
    """9: Tilts of the other sign mirror the pressure."""
    one = run(TITANIUM, SHAPES, COARSE).patch.pressed.pressure
    other = SHAPES | {"tilt": {"angle": "-0.05 mrad", "roll": "-0.08 mrad"}}
    mirrored = run(TITANIUM, other, COARSE).patch.pressed.pressure
    assert mirrored[::-1, ::-1] == pytest.approx(one, abs=1e-6 * one.max())


def test_exact_work_of_rigid_faces_on_a_spring():
    """10: The friction loop of rigid faces on a spring of the holder is a parallelogram."""
    slide = {"kind": "triangle", "amplitude": "1 um", "speed": "10 um/s", "cycles": 2}
    result = run(
        TITANIUM,
        SHAPES,
        COARSE,
        {"holder": {"tangential_stiffness": "1e8 N/m"}},
        friction={"law": "coulomb", "static": 0.3},
        slide=slide,
    )
    force = 0.3 * LOAD
    check(result, 1e-3, loop_area=4 * force * (1e-6 - force / 1e8), friction_force_peak=force)


COATED = TITANIUM | {"coating": {"material": "WC-Co", "thickness": "6 mil"}}


@pytest.mark.parametrize(
    "shape", [{"crown": {"radius": "50 m"}}, {"tilt": {"angle": "0.1 mrad"}}], ids=["crown", "tilt"]
)
@pytest.mark.parametrize("n_cells", [200, 256])
def test_guided_face_is_the_plane_run(shape, n_cells):
    """Between guides along y, a face agrees with the plane run within .1 %, wherever the edge lies between the cells."""
    plane = BLOCK | COATED | shape
    model = pf.build({"contact": plane}).patch
    del plane["area"]
    expected = pf.run({"contact": plane}).measures
    cells = area.make_cells(model, n_cells, 1, "x")
    values = area.compute_face_values(area.press_face(model, cells))
    for name in ("contact_fraction", "normal_stiffness", "tangential_stiffness"):
        assert values[name] == pytest.approx(expected[name].value, rel=1e-3), name


@pytest.mark.slow
def test_always_faces_are_pressed_in_time():
    """The pieces press and slip in at most the CPU seconds that are allowed on one core."""
    model = pf.build({"contact": BLOCK | COATED | {"shear": {}} | SHAPES}).patch
    for n_cells, limit in ((128, 0.6), (256, 0.4), (512, 3.0)):
        cells = area.make_cells(model, n_cells, 1)
        start = process_time()
        patch = area.press_face(model, cells)
        if n_cells == 128:
            make_cell_elements(patch.slip_compliance, 0.3 * patch.pressed.pressure)
        assert process_time() - start <= limit
