"""Partial slip of a patch: parallel elements and shear modes against a solution with all contact
nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LOAD, TILTS, draw_gap, make_coated_pair
from pressed import press
from yielding_points import jenkins_forces, solve_all_points

from patchfem.contact import tangential_stiffness
from patchfem.contact.gaps import crown, tilt
from patchfem.core import PatchfemError
from patchfem.partial_slip import find_sufficient_modes, make_jenkins_set
from patchfem.partial_slip.shear_modes import shear_modes

MU = 0.3


def friction_limit(cells, angle):
    """Return the friction limit of every node of a tilted coated patch, (m,) [N]."""
    pair = make_coated_pair(cells)
    return MU * press(pair, tilt(pair.interface.x, angle), LOAD).sigma_n * pair.interface.weight


def test_exact_yield_displacements_are_in_proportion_to_limits():
    """Friction limits that are multiplied by a factor multiply the yield displacements by this factor, and leave the
    stiffnesses unchanged, within 1e-11."""
    pair = make_coated_pair(20)
    limit = friction_limit(20, 1e-4)
    elements = make_jenkins_set(pair.tangential, limit)
    scaled = make_jenkins_set(pair.tangential, 0.37 * limit)
    assert np.array_equal(scaled.points, elements.points)
    for name in ("yield_displacement", "limit"):
        assert getattr(scaled, name) == pytest.approx(0.37 * getattr(elements, name), rel=1e-11)
    for name in ("stiffness", "force_matrix"):
        assert (
            np.abs(getattr(scaled, name) - getattr(elements, name)).max()
            < 1e-11 * np.abs(elements.stiffness).max()
        )


@given(seed=st.integers(0, 2**32 - 1), bond_length=st.sampled_from([0.0, 1e-7, 1e-6]))
def test_always_elements_are_exact_for_rough_gaps(seed, bond_length):
    """For random rough gaps the force of the elements, and at last the force at every point, agree with the
    solution for all points within 1e-10 of the friction limit."""
    rng = np.random.default_rng(seed)
    pair = make_coated_pair(40)
    gap = draw_gap(rng, pair.interface.x, 10 ** rng.uniform(-8, -5))
    limit = MU * press(pair, gap, LOAD).sigma_n * pair.interface.weight
    group = make_jenkins_set(pair.tangential, limit, bond_length)
    assert group.stiffness @ group.yield_displacement == pytest.approx(limit.sum(), rel=1e-11)
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)] + np.diag(bond_length / limit[touching])
    # 40 reversals, from micro-slip to gross sliding
    swing = rng.uniform(0.0, 1.0, 40) * (-1.0) ** np.arange(40) + 0.2 * rng.normal()
    path = group.yield_displacement[-1] * 10 ** rng.uniform(-1, 0.3) * swing
    expected = solve_all_points(c, limit[touching], path)
    force, stretch = jenkins_forces(path, group.stiffness, group.yield_displacement)
    assert np.abs(force - expected.sum(axis=1)).max() <= 1e-10 * limit.sum()
    assert np.abs(group.force_matrix @ stretch - expected[-1]).max() <= 1e-10 * limit.sum()


@pytest.mark.parametrize("shape", ["crown", "tilt"])
def test_exact_initial_stroke_satisfies_ciavarella_jaeger_theorem(shape):
    """The initial loading curve satisfies F(q) = mu [N - P(delta - q/mu)] within 1e-10 if C_tt =
    C_nn (Ciavarella and Jaeger). P is the normal load at an approach."""
    pair = make_coated_pair(100)
    x = pair.interface.x
    gap = crown(x, 2.0) if shape == "crown" else tilt(x, 1e-4)
    full = press(pair, gap, LOAD)
    group = make_jenkins_set(pair.normal, MU * full.sigma_n * pair.interface.weight)
    for load_fraction in (0.999, 0.9, 0.6, 0.3, 0.1, 0.01):
        partial = press(pair, gap, load_fraction * LOAD)
        q = MU * (full.approach - partial.approach)
        force = group.stiffness @ np.minimum(q, group.yield_displacement)
        assert force == pytest.approx(MU * (1 - load_fraction) * LOAD, rel=1e-10)


# stiffness [N/m] of two complete bodies that are bonded over the contact, with 200 cells
@pytest.mark.parametrize(
    "angle, bonded", [*zip(TILTS, (4.04955667e8, 4.04942844e8, 2.30395570e8, 1.22044346e8))]
)
def test_exact_stick_stiffness_agrees_with_uncondensed_bodies(angle, bonded):
    """The stick stiffness agrees within 1e-8 with two complete bodies that are bonded over the
    contact."""
    pair = make_coated_pair(200)
    limit = friction_limit(200, angle)
    assert tangential_stiffness(pair.tangential, limit > 0) == pytest.approx(bonded, rel=1e-8)


def solve_exponential_law(c, limit, length, slide):
    """Return the point forces limit (1 - exp(-xi/length)) with xi + C f = slide [N].

    Newton's method solves for the local slide xi of every point.
    """
    inverse = np.linalg.inv(c)
    local_slide = np.zeros(limit.size)
    for _ in range(500):
        residual = inverse @ (slide - local_slide) + limit * np.expm1(-local_slide / length)
        step = np.linalg.solve(
            inverse + np.diag(limit * np.exp(-local_slide / length) / length), residual
        )
        local_slide = local_slide + np.clip(step, -5 * length, 5 * length)
        if np.abs(step).max() <= 1e-14 * slide:
            return -limit * np.expm1(-local_slide / length)
    raise AssertionError("the reference did not converge")


def solve_with_modes(modes, limit, length, slide):
    """Return the resultant of the exponential law with the compliance of `modes` only [N].

    The unknowns are the modal coordinates.
    """
    point_limit = limit[modes.points]
    coordinate = np.zeros(modes.stiffness.size)
    for _ in range(200):
        local_slide = slide - modes.shape @ coordinate
        residual = modes.stiffness * coordinate + modes.shape.T @ (
            point_limit * np.expm1(-local_slide / length)
        )
        point_stiffness = (point_limit * np.exp(-local_slide / length) / length)[:, None]
        step = np.linalg.solve(
            np.diag(modes.stiffness) + modes.shape.T @ (point_stiffness * modes.shape), residual
        )
        coordinate = coordinate - step
        if np.abs(step).max() <= 1e-14 * (np.abs(coordinate).max() + slide):
            return point_limit @ -np.expm1(-(slide - modes.shape @ coordinate) / length)
    raise AssertionError("the mode equations did not converge")


@pytest.mark.parametrize("angle", TILTS[::3])
def test_exact_all_shear_modes_reproduce_compliance(angle):
    """All shear modes together reproduce the compliance and the resultant force within 1e-12."""
    pair = make_coated_pair(100)
    limit = friction_limit(100, angle)
    modes = shear_modes(pair.tangential, limit, 10**6)
    touching = np.flatnonzero(limit > 0)
    assert np.array_equal(modes.points, touching)
    c = pair.tangential[np.ix_(touching, touching)]
    assert np.abs(modes.shape / modes.stiffness @ modes.shape.T - c).max() <= 1e-12 * c.max()
    assert np.all(np.diff(modes.stiffness) >= 0)
    slides = np.array([0.1, 1.0, 4.0]) * 1e-6
    for slide in slides:
        reference = solve_exponential_law(c, limit[touching], 1e-6, slide).sum()
        assert solve_with_modes(modes, limit, 1e-6, slide) == pytest.approx(reference, rel=1e-12)


@pytest.mark.parametrize("angle", TILTS[::3])
@pytest.mark.parametrize("length", [1e-7, 1e-6, 1e-5])
def test_order_sufficient_modes_meet_tolerance(angle, length):
    """The force of the chosen modes differs by at most 1.5 tolerances from that of all, of half as many by 0.2 or more."""
    pair = make_coated_pair(100)
    limit = friction_limit(100, angle)
    every_mode = shear_modes(pair.tangential, limit, 10**6)
    slides = np.geomspace(0.05, 6.0, 25) * length + np.geomspace(1e-9, 2e-7, 25)
    reference = np.array([solve_with_modes(every_mode, limit, length, slide) for slide in slides])

    def find_error(modes) -> float:
        """Return the largest difference of the force from that of all modes, over the friction limit."""
        forces = [solve_with_modes(modes, limit, length, slide) for slide in slides]
        return np.abs(forces - reference).max() / limit.sum()

    for tolerance in (1e-2, 1e-4, 1e-6):
        modes = find_sufficient_modes(pair.tangential, limit, length, 1, tolerance)
        assert find_error(modes) <= 1.5 * tolerance
        count = modes.stiffness.size
        if 1 < count < every_mode.stiffness.size:
            assert find_error(modes.select(count // 2)) >= 0.2 * tolerance


@pytest.mark.parametrize("is_rigid", [False, True])
def test_refuses_patch_whose_friction_falls_more_steeply_than_it_relaxes(is_rigid):
    """A fall of the friction force above the stability limit of the patch is refused, just below it is accepted.

    The limit is the inverse of the largest eigenvalue of D C, also of rigid pieces behind the spring of a holder.
    """
    limit = friction_limit(100, 1e-4)
    compliance = make_coated_pair(100).tangential
    if is_rigid:
        compliance = np.full_like(compliance, 2e-8)
    steepest = 1 / np.linalg.eigvals(limit[:, None] * compliance).real.max()
    with pytest.raises(PatchfemError, match=r"friction\.kinetic.*slip suddenly"):
        shear_modes(compliance, limit, 8, steepest * (1 + 1e-6))
    assert shear_modes(compliance, limit, 8, steepest * (1 - 1e-6)).stiffness.size > 0


def test_exact_only_mode_of_rigid_pieces_is_limit_of_elastic_ones():
    """The mode of rigid pieces behind a spring has the units and the value of the first mode of almost rigid ones."""
    limit = np.array([20.0, 80.0, 100.0])
    compliance = np.full((3, 3), 2e-8)
    rigid = shear_modes(compliance, limit, 1)
    elastic = shear_modes(compliance + np.diag([1e-19, 0.0, 0.0]), limit, 1)
    assert rigid.stiffness == pytest.approx(elastic.stiffness, rel=1e-9)
    assert np.abs(rigid.shape) == pytest.approx(np.abs(elastic.shape), rel=1e-9)


def test_refuses_patch_without_friction():
    """A patch whose friction limit is zero at every point is refused."""
    with pytest.raises(PatchfemError, match="the friction limit is 0 at every point"):
        make_jenkins_set(make_coated_pair(40).tangential, np.zeros(41))
