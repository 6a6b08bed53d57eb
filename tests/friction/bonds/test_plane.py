"""The bond law along a path in two directions: circles, straight lines, rotations, energy, and sums by hand.

Lengths are in eps_0 and tractions in mu_s sigma.
"""

import numpy as np
import pytest
from friction_paths import march_path
from scipy.integrate import quad
from scipy.special import gamma

from patchfem.core import PatchfemError
from patchfem.friction import Bonds, FirstOrderBonds, Quadrature

UNIT_PRESSURE = np.ones(1)
GROWING = Bonds(0.7, 1.0, 1.0, "stretch", 0.6, 2.0, 0.3, 1e-3, 0.8)


def follow_polygon(law, path, sigma=UNIT_PRESSURE, dt=1.0, pressures=None):
    """Return the means (k, 2, m), tractions, dissipated (k, m) and stored energies, and the last state of a polygon path."""
    state = law.initial_state(sigma if pressures is None else pressures[0], 2)
    rows = []
    for k, dq in enumerate(np.diff(path, axis=0)):
        s0, s1 = (sigma, sigma) if pressures is None else pressures[k : k + 2]
        step = law.step(state, dq, s0, s1, dt)
        state = step.state
        rows.append((step.mean, law.traction(state), step.dissipated, law.stored_energy(state)))
    return *(np.array(part) for part in zip(*rows)), state


def circle_path(radius, arc, n_legs):
    """Return a polygon on a circle through the origin that starts along +x.

    The path has the length `arc`.
    """
    angle = np.linspace(0, arc / radius, n_legs + 1)
    return radius * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1)


def complex_traction(traction, path, radius):
    """Return the traction relative to the direction of motion at the end of a circle as a complex number."""
    angle = 2 * np.arctan2(path[-1, 1], path[-1, 0])
    return complex(*traction) * np.exp(-1j * angle)


# ---- C14


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "radius, magnitude, lag",
    [(0.5, 0.447214, 63.4349), (2, 0.894427, 26.5651), (10, 0.995037, 5.7106)],
)
def test_exact_traction_on_circle_agrees_with_closed_form(radius, magnitude, lag):
    """The magnitude and the lag of the traction on a circular path agree with the closed form (C14)."""
    path = circle_path(radius, 18, 3000)
    traction = complex_traction(
        follow_polygon(FirstOrderBonds(Bonds(1.0, 1.0)), path)[1][-1, :, 0], path, radius
    )
    assert (
        abs(traction)
        == pytest.approx(magnitude, abs=1e-5)
        == pytest.approx((1 + radius**-2) ** -0.5, abs=1e-5)
    )
    assert -np.degrees(np.angle(traction)) == pytest.approx(lag, abs=2e-3)
    assert -np.angle(traction) == pytest.approx(np.arctan(1 / radius), abs=1e-5)


# ---- straight paths


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "law, tolerance",
    [
        (Bonds(0.7, 1.0, 1.0, "stretch", 0.6, 2.0, 0.3, 1e-3, 0.8), 1e-13),
        (Bonds(0.7, 1.0, 0.0), 1e-10),
        (Bonds(0.7, 1.0, 2.0), 1e-10),
        (Bonds(0.7, 1.0, 0.5), 1e-5),
        (Bonds(0.7, 1.0, 0.0, "report"), 1e-10),
        (Bonds(0.7, 1.0, 1.0, "report"), 1e-10),
        (Bonds(0.7, 1.0, 2.4, "report", initial=0.0), 1e-8),
        (Bonds(0.7, 1.0, 1.0, "report", 0.6, 2.0, 0.3, 1e-3, 0.0), 1e-5),
    ],
)
def test_exact_straight_path_equals_scalar_law(law, tolerance):
    """Traction and stored energy along a straight path in the plane equal those of the scalar law."""
    rng = np.random.default_rng(5)
    knots = np.cumsum(np.append(0.0, rng.uniform(-1, 1.4, 25)))
    sigma = np.array([1.0, 0.3])
    path = np.stack([0.6 * knots, -0.8 * knots], axis=1)
    scalar = march_path(Quadrature(law, 0.0), knots, lambda q: sigma, 0.5)
    plane_run = follow_polygon(Quadrature(law, 0.0), path, sigma, 0.5)
    direction = np.array([0.6, -0.8])[:, None]
    assert np.abs(plane_run[1] - direction * scalar.traction[:, None]).max() < tolerance
    assert np.abs(plane_run[3] - scalar.stored).max() < tolerance


# ---- rotations and polygons


def draw_polygon(rng, n_legs):
    """Return a random polygon (legs + 1, 2) with legs of three sizes."""
    return np.cumsum(
        np.vstack(
            [[0.0, 0.0], rng.normal(0, 1, (n_legs, 2)) * rng.choice([0.02, 0.3, 2.0], (n_legs, 1))]
        ),
        axis=0,
    )


def test_exact_sum_equals_recursion_on_random_polygons():
    """The sum over bonds equals the recursion on random polygons with growing bonds and varying pressure within 1e-10."""
    rng = np.random.default_rng(11)
    for _ in range(3):
        path = draw_polygon(rng, 30)
        pressures = rng.uniform(0, 2, (31, 3)) * (rng.uniform(size=(31, 3)) > 0.15)
        recursion = follow_polygon(FirstOrderBonds(GROWING), path, dt=0.4, pressures=pressures)
        quadrature = follow_polygon(Quadrature(GROWING, 0.0), path, dt=0.4, pressures=pressures)
        for a, b in zip(recursion[:4], quadrature[:4]):
            assert a == pytest.approx(b, abs=1e-10)


def integrate_bonds(law, path, dt):
    """Return the traction at the end of a polygon by adaptive integration over the bonds of constant length."""
    legs = np.diff(path, axis=0)
    length = np.hypot(*legs.T)
    after = np.cumsum(length[::-1])[::-1] - length
    total = np.zeros(2)
    for k, leg in enumerate(legs):
        e = leg / length[k]
        a = path[-1] - path[k + 1]
        turn = float(np.clip(-(a @ e), 0, length[k]))
        for c in (0, 1):

            def bond_traction(y, c=c, e=e, a=a, k=k):
                u = a + y * e
                travel = after[k] + y
                size = max(np.hypot(*u), 1e-300)
                x = size if law.reading == "stretch" else travel
                return x**law.order * np.exp(-travel) / gamma(law.order + 1) * u[c] / size

            for low, high in ((0, turn), (turn, length[k])):
                if high > low:
                    total[c] += quad(
                        bond_traction, low, high, epsabs=1e-12, epsrel=1e-11, limit=400
                    )[0]
    return law.static * total


@pytest.mark.share(1, 3)
@pytest.mark.parametrize(
    "reading, order",
    [
        ("stretch", 0.0),
        ("stretch", 0.5),
        ("stretch", 2.0),
        ("report", -0.4),
        ("report", 0.0),
        ("report", 1.0),
        ("report", 1.5),
    ],
)
def test_exact_polygon_traction_agrees_with_integration(reading, order):
    """Tractions on a polygon with crossing and reversed legs agree with adaptive integration within 1e-9."""
    law = Bonds(0.7, 1.0, order, reading, initial=0.0)
    path = np.array(
        [
            [0, 0],
            [1, 0],
            [1, 1.2],
            [0.4, 1.2],
            [0.4, -0.5],
            [0.4, 0.3],
            [0.9, 0.3],
            [0.2, 0.1],
            [1, 0],
            [1.5, 0.7],
            [1.1, 0.9],
        ]
    )
    for end in range(2, len(path) + 1):
        traction = follow_polygon(Quadrature(law, 0.0), path[:end])[1][-1, :, 0]
        assert traction == pytest.approx(integrate_bonds(law, path[:end], 1.0), abs=1e-9)


def test_exact_initial_bonds_point_to_start():
    """The traction of the initial bonds points to the start of the path and agrees with its closed form."""
    law = Bonds(1.0, 1.0, 2.0, "stretch", initial=1.0)
    law_without = Bonds(1.0, 1.0, 2.0, "stretch", initial=0.0)
    path = np.array([[0, 0], [0.3, 0.1], [0.2, 0.8]])
    difference = (
        follow_polygon(Quadrature(law), path)[1][-1, :, 0]
        - follow_polygon(Quadrature(law_without), path)[1][-1, :, 0]
    )
    u = np.hypot(0.2, 0.8)
    r = np.hypot(0.3, 0.1) + np.hypot(0.1, 0.7)
    assert difference == pytest.approx(u**2 * np.exp(-r) / 2 * np.array([0.2, 0.8]) / u, rel=1e-13)


# ---- energy


@pytest.mark.parametrize("law", [FirstOrderBonds, Quadrature])
def test_refuses_breakaway_in_two_directions(law):
    """A law with breakaway is refused in two directions."""
    with pytest.raises(PatchfemError, match=r"breakaway in two directions is not supported yet"):
        law(Bonds(1.0, 1.0, breakaway=0.1)).initial_state(UNIT_PRESSURE, 2)
