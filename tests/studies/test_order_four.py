"""The independent program of order 4 (`support/patch_of_order_four.py`) against values of elements of order 5."""

import numpy as np
import patch_of_order_four as program
import pytest

LENGTH = 12.7e-3
PIECES = {
    "length": f"{LENGTH!r} m",
    "width": f"{LENGTH!r} m",
    "height": f"{LENGTH / 2!r} m",
    "load": f"{26 * 4.4482216152605!r} N",
    "substrate": {"young": "121e9 Pa", "poisson": 0.32},
    "tilt": {"angle": "1e-4 rad"},
    "coating": {"material": {"young": "250e9 Pa", "poisson": 0.24}, "thickness": "152.4e-6 m"},
}


def test_exact_rigid_motion_of_cells_causes_no_force():
    """A translation and a rotation of a rectangular cell cause no nodal force."""
    place = program.lobatto()[0]
    x, y = np.meshgrid(place, 2 * place)
    stiffness = program.cell_stiffness(2 * np.ones(1), 4 * np.ones(1), np.ones(1), np.ones(1))[0]
    turn = np.concatenate([-y.ravel(), x.ravel()])
    shift = np.concatenate([np.ones(25), np.zeros(25)])
    assert max(abs(stiffness @ motion).max() for motion in (turn, shift)) < 1e-12


def test_exact_tilted_patch_agrees_with_elements_of_order_five():
    """On the coarsest level approach and stiffness agree within 2e-5, the peak at the end of the face within 5e-4, and the
    edge within 3e-5 of the contact length."""
    edges = (-LENGTH / 2, -3.56429530e-3)
    scene = program.read_scene(PIECES)
    pressed = program.press(scene, [edges], program.LEVELS[0])
    measures = program.find_measures(scene, pressed)
    assert measures["approach"] == pytest.approx(-2.3513342e-7, rel=2e-5)
    assert measures["normal_stiffness"] == pytest.approx(4.212594086e10 * LENGTH, rel=2e-5)
    assert measures["pressure_peak"] == pytest.approx(8.3177169e6, rel=5e-4)
    assert pressed.intervals[0] == pytest.approx(edges, abs=3e-5 * np.ptp(edges))
