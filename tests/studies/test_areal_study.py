"""Sections per wave number across the width: the plane problem at none, waves of a half space, and Hertz."""

import numpy as np
import pytest
from study_module import study

from patchfem.closed_forms.contact import layered_compliance
from patchfem.elasticity.elasticity import Layers
from patchfem.mesh.tensor import TensorGrid

areal, strip = study("patch/areal.py"), study("peers/strip.py")


def test_exact_a_section_without_waves_is_the_plane_piece():
    x, z = areal.graded(1e-4, 4e-4, 2e-3, 1.3), areal.graded(1e-4, 3e-4, 2e-3, 1.3)
    plane = strip.strip_compliance(
        TensorGrid(x, z, 0),
        Layers((areal.YOUNG, areal.POISSON), (areal.YOUNG, areal.POISSON), "strain"),
    )
    assert areal.section(x, z, 0.0, 5) == pytest.approx(plane[:5, :5], rel=1e-9)


def test_order_2_a_wave_across_the_width_sinks_as_on_a_half_space():
    """A pressure cos(ky) that is the same at every x: 2 (1 - nu^2)/(E k) of one piece."""
    body, k, errors = (areal.YOUNG, areal.POISSON), 2e3, []
    for cells in (4, 8, 16):
        x, z = np.linspace(0, 1e-3, 5), np.linspace(0, 8e-3, 16 * cells + 1)
        force = np.array([0.5, 1, 1, 1, 0.5]) * 0.25e-3
        sunk = areal.section(x, z, k, 5) @ force
        assert np.ptp(sunk) <= 1e-9 * sunk[0]
        errors.append(abs(sunk[0] / layered_compliance(k, body, body, 1e-4) - 1))
    assert errors[-1] <= 2e-3 and np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


def test_exact_interpolated_sections_are_those_solved():
    x, z = areal.graded(2.5e-4, 1e-3, 1.2e-2, 1.4), areal.graded(2.5e-4, 6e-4, 1.2e-2, 1.4)
    found = areal.sections(x, z, 1.2e-2, 48, 4)
    for n in (0, 7, 20, 47):
        assert found[n] == pytest.approx(areal.section(x, z, np.pi * n / 1.2e-2, 4), rel=1e-5)


@pytest.mark.share(0)
@pytest.mark.parametrize("b", [1.0, 0.5])
def test_always_the_study_holds_what_it_says_of_hertz(b):
    for cells, bound, pressure in ((8, 1.4e-3, 4e-3), (12, 1e-3, 1.6e-3)):
        found = areal.row(cells, areal.Ellipse(1e-3, b * 1e-3, 5e8))
        assert (
            max(abs(found[name]) for name in ("peak", "a", "b")) <= bound
            and found["pressure"] <= pressure
        )


def test_exact_the_gap_of_the_ellipse_closes_under_its_pressure():
    """The displacement of the half spaces under the pressure, by Boussinesq's sum over rings of its own points."""
    shape = areal.Ellipse(1.0, 0.5, 1.0)
    a, b = shape.curvatures

    def sunk(x: float, y: float) -> float:
        """By polar coordinates around the place, where 1/distance drops out."""
        turn = (np.arange(400) + 0.5) * 2 * np.pi / 400
        c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
        node, weight = np.polynomial.legendre.leggauss(60)
        bend = (c / shape.a) ** 2 + (s / shape.b) ** 2
        half = (x * c / shape.a**2 + y * s / shape.b**2) / bend
        reach = -half + np.sqrt(half**2 + (1 - (x / shape.a) ** 2 - (y / shape.b) ** 2) / bend)
        # the root of the pressure at the edge is smooth in this variable
        far = reach * np.sin((node + 1) * np.pi / 4)
        step = reach * np.cos((node + 1) * np.pi / 4) * np.pi / 4 * weight
        return float(
            (shape.pressure(x + far * c, y + far * s) * step).sum()
            * 2
            * np.pi
            / 400
            / np.pi
            / areal.MODULUS
        )

    middle = sunk(0.0, 0.0)
    for x, y in ((0.6, 0.0), (0.0, 0.3), (0.5, 0.25)):
        assert middle - sunk(x, y) == pytest.approx(a * x**2 + b * y**2, rel=1e-5)
    nearly = areal.Ellipse(1.0, 1 - 1e-7, 1.0)
    assert areal.Ellipse(1.0, 1.0, 1.0).curvatures == pytest.approx(nearly.curvatures, rel=1e-5)
