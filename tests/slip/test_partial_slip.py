"""Partial slip of the patch: the parallel elements and the shear modes against the problem point by point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LOAD, TILTS, coated_pair, rough
from slip_paths import elements, histories

from patchfem.contact import press, tangential_stiffness
from patchfem.contact.gaps import crown, tilt
from patchfem.core import PatchfemError
from patchfem.slip import enough_modes, fewest_gauss_points, jenkins_set, scale_limits
from patchfem.slip.shear_modes import fewest_modes, shear_modes

MU = 0.3


def friction_limit(cells, angle):
    """(m,) yield force of every node [N]."""
    pair = coated_pair(cells)
    return MU * press(pair, tilt(pair.interface.x, angle), LOAD).sigma_n * pair.interface.weight


@pytest.mark.parametrize("factor", (0.37, 1.0, 2.6))
def test_exact_another_coefficient_is_the_same_springs(factor):
    """Points that yield at another multiple of their load: computed anew, and from those of the first."""
    pair = coated_pair(20)
    limit = friction_limit(20, 1e-4)
    mine = scale_limits(jenkins_set(pair.tangential, limit), factor)
    anew = jenkins_set(pair.tangential, factor * limit)
    assert np.array_equal(mine.points, anew.points) and mine.n_reluctant == anew.n_reluctant
    for name in ("yield_displacement", "limit"):
        assert getattr(mine, name) == pytest.approx(getattr(anew, name), rel=1e-11)
    for name in ("stiffness", "force_matrix"):
        assert (
            np.abs(getattr(mine, name) - getattr(anew, name)).max()
            < 1e-11 * np.abs(anew.stiffness).max()
        )


def box_problem(c, limit, pull, force):
    """argmin f.C f/2 - f.pull with |f| <= limit by a primal-dual active set from `force`; its conditions are checked.

    C f = pull where a point sticks; C f <= pull at +limit, C f >= pull at -limit.
    """
    scale = np.abs(pull).max() + np.abs(c @ limit).max()
    at = np.where(force >= limit, 1, np.where(force <= -limit, -1, 0))
    for _ in range(60 + 3 * limit.size):
        free = at == 0
        force = at * limit
        if free.any():
            force[free] = np.linalg.solve(
                c[np.ix_(free, free)], pull[free] - c[np.ix_(free, ~free)] @ force[~free]
            )
        slip = pull - c @ force
        following = np.where(
            free,
            np.where(force > limit, 1, np.where(force < -limit, -1, 0)),
            np.where(at * slip > -1e-15 * scale, at, 0),
        )
        if np.array_equal(following, at):
            break
        at = following
    slip = pull - c @ force
    assert np.all(np.abs(force) <= limit * (1 + 1e-12))
    assert np.abs(slip[at == 0]).max(initial=0) <= 1e-12 * scale
    assert (at * slip).min() >= -1e-12 * scale
    return force, slip


def point_by_point(c, limit, path):
    """Resultant at every reversal [N] of points behind the compliance c, one box problem per stroke."""
    settled = np.zeros(limit.size)
    force = np.zeros(limit.size)
    out = []
    for q in path:
        force, moved = box_problem(c, limit, q - settled, force)
        settled = settled + moved
        out.append(force.sum())
    return np.array(out)


@pytest.mark.parametrize("cells", [100, 200])
@pytest.mark.parametrize("angle", TILTS)
def test_exact_elements_carry_the_friction_limit_and_start_at_the_stick_stiffness(cells, angle):
    pair = coated_pair(cells)
    limit = friction_limit(cells, angle)
    group = jenkins_set(pair.tangential, limit)
    assert group.stiffness @ group.yield_displacement == pytest.approx(limit.sum(), rel=1e-12)
    assert group.stiffness.sum() == pytest.approx(
        tangential_stiffness(pair.tangential, limit > 0), rel=1e-11
    )
    assert group.stiffness.min() > 0
    assert np.all(np.diff(group.yield_displacement) >= 0) and group.yield_displacement[0] > 0


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("angle", TILTS)
def test_exact_elements_repeat_the_problem_point_by_point(angle):
    """20 histories of 40 reversals at 101 nodes; the worst difference seen is 9e-15 of mu N."""
    pair = coated_pair(100)
    limit = friction_limit(100, angle)
    group = jenkins_set(pair.tangential, limit)
    assert group.n_reluctant == 0
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)]
    for path in histories(20, group.yield_displacement[-1]):
        worst = np.abs(point_by_point(c, limit[touching], path) - elements(group, path)).max()
        assert worst <= 1e-10 * limit.sum()


@pytest.mark.parametrize("length", [1e-8, 3e-7, 1e-5])
@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_exact_elements_with_bonds_repeat_the_problem_point_by_point(angle, length):
    """Elastic-plastic points: a bond of stiffness limit/length in series with the shear of the pieces."""
    pair = coated_pair(100)
    limit = friction_limit(100, angle)
    group = jenkins_set(pair.tangential, limit, length)
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)] + np.diag(length / limit[touching])
    assert group.stiffness @ group.yield_displacement == pytest.approx(limit.sum(), rel=1e-12)
    for path in histories(3, group.yield_displacement[-1]):
        worst = np.abs(point_by_point(c, limit[touching], path) - elements(group, path)).max()
        assert worst <= 1e-10 * limit.sum()


@pytest.mark.parametrize("angle", [0.0, 1e-5])
def test_exact_corner_nodes_with_a_negative_row_sum_wait_for_their_neighbours(angle):
    """At 201 nodes the free corners carry the wrong sign at first; 6e-10 of mu N seen against every node kept."""
    pair = coated_pair(200)
    limit = friction_limit(200, angle)
    group = jenkins_set(pair.tangential, limit)
    assert group.n_reluctant > 0 and group.stiffness.min() > 0
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)]
    for path in histories(3, group.yield_displacement[-1]):
        whole = np.abs(point_by_point(c, limit[touching], path) - elements(group, path)).max()
        assert whole <= 5e-9 * limit.sum()


def test_exact_the_force_of_every_point_is_its_share_of_the_elements():
    pair = coated_pair(100)
    limit = friction_limit(100, 1e-4)
    group = jenkins_set(pair.tangential, limit)
    c = pair.tangential[np.ix_(group.points, group.points)]
    settled = np.zeros(group.points.size)
    force = np.zeros(group.points.size)
    own = np.zeros(group.stiffness.size)
    for q in np.array([0.3, 0.9, -0.4, 0.1, -2.0]) * group.yield_displacement[-1]:
        force, moved = box_problem(c, group.limit, q - settled, force)
        settled = settled + moved
        stretch = np.clip(q - own, -group.yield_displacement, group.yield_displacement)
        own = q - stretch
        assert np.abs(group.force_matrix @ stretch - force).max() <= 1e-10 * limit.sum()


@given(seed=st.integers(0, 2**32 - 1), local=st.sampled_from([0.0, 1e-7, 1e-6]))
def test_always_rough_gaps_keep_the_exact_reduction(seed, local):
    rng = np.random.default_rng(seed)
    pair = coated_pair(40)
    gap = rough(rng, pair.interface.x, 10 ** rng.uniform(-8, -5))
    limit = MU * press(pair, gap, LOAD).sigma_n * pair.interface.weight
    group = jenkins_set(pair.tangential, limit, local)
    assert group.stiffness @ group.yield_displacement == pytest.approx(limit.sum(), rel=1e-11)
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)] + np.diag(local / limit[touching])
    path = next(histories(1, group.yield_displacement[-1], seed % 1000))
    worst = np.abs(point_by_point(c, limit[touching], path) - elements(group, path)).max()
    assert worst <= 1e-10 * limit.sum()


@pytest.mark.parametrize("shape", ["crown", "tilt"])
def test_exact_identity_of_ciavarella_and_jaeger(shape):
    """With C_tt = C_nn the virgin stroke is F(q) = mu [N - P(delta - q/mu)], P the normal load at an approach."""
    pair = coated_pair(100)
    x = pair.interface.x
    gap = crown(x, 2.0) if shape == "crown" else tilt(x, 1e-4)
    full = press(pair, gap, LOAD)
    group = jenkins_set(pair.normal, MU * full.sigma_n * pair.interface.weight)
    assert group.n_reluctant == 0
    for share in (0.999, 0.9, 0.6, 0.3, 0.1, 0.01):
        part = press(pair, gap, share * LOAD)
        q = MU * (full.approach - part.approach)
        found = group.stiffness @ np.minimum(q, group.yield_displacement)
        assert found == pytest.approx(MU * (1 - share) * LOAD, rel=1e-10)


# values [N/m]: both whole bodies bonded over the contact set, at 200 cells, no condensation
@pytest.mark.parametrize(
    "angle, bonded", [*zip(TILTS, (4.04955667e8, 4.04942844e8, 2.30395570e8, 1.22044346e8))]
)
def test_exact_stick_stiffness_agrees_with_two_whole_bodies(angle, bonded):
    pair = coated_pair(200)
    limit = friction_limit(200, angle)
    assert tangential_stiffness(pair.tangential, limit > 0) == pytest.approx(bonded, rel=1e-8)


def saturating(c, limit, length, slide):
    """Forces limit (1 - exp(-xi/length)) with xi + C f = slide, Newton in the local slide xi of every point."""
    inverse = np.linalg.inv(c)
    local = np.zeros(limit.size)
    for _ in range(500):
        missing = inverse @ (slide - local) + limit * np.expm1(-local / length)
        step = np.linalg.solve(inverse + np.diag(limit * np.exp(-local / length) / length), missing)
        local = local + np.clip(step, -5 * length, 5 * length)
        if np.abs(step).max() <= 1e-14 * slide:
            return -limit * np.expm1(-local / length)
    raise AssertionError("the reference did not converge")


def few_modes(modes, limit, length, slide):
    """The same resultant with the compliance of `modes` only: unknowns are the mode coordinates."""
    bound = limit[modes.points]
    coordinate = np.zeros(modes.stiffness.size)
    for _ in range(200):
        local = slide - modes.shape @ coordinate
        missing = modes.stiffness * coordinate + modes.shape.T @ (bound * np.expm1(-local / length))
        slope = (bound * np.exp(-local / length) / length)[:, None]
        step = np.linalg.solve(
            np.diag(modes.stiffness) + modes.shape.T @ (slope * modes.shape), missing
        )
        coordinate = coordinate - step
        if np.abs(step).max() <= 1e-14 * (np.abs(coordinate).max() + slide):
            return bound @ -np.expm1(-(slide - modes.shape @ coordinate) / length)
    raise AssertionError("the mode equations did not converge")


@pytest.mark.parametrize("angle", TILTS)
def test_exact_all_modes_hold_the_whole_compliance(angle):
    pair = coated_pair(100)
    limit = friction_limit(100, angle)
    modes = shear_modes(pair.tangential, limit, 1e-6, 10**6)
    touching = np.flatnonzero(limit > 0)
    assert np.array_equal(modes.points, touching)
    c = pair.tangential[np.ix_(touching, touching)]
    assert np.abs(modes.shape / modes.stiffness @ modes.shape.T - c).max() <= 1e-12 * c.max()
    assert modes.backbone_error <= 1e-13
    assert np.all(np.diff(modes.stiffness) >= 0)
    slides = np.array([0.1, 1.0, 4.0]) * 1e-6
    for slide in slides:
        whole = saturating(c, limit[touching], 1e-6, slide).sum()
        assert few_modes(modes, limit, 1e-6, slide) == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("cells", [100, 240])
def test_exact_the_first_modes_are_the_softest_of_all(cells):
    """Those of D^1/2 C D^1/2, D the friction limits; from 200 points on they are found without the others."""
    pair = coated_pair(cells)
    limit = friction_limit(cells, 1e-5)
    modes = shear_modes(pair.tangential, limit, 1e-6, 8)
    root = np.sqrt(limit[modes.points])
    values, vectors = np.linalg.eigh(
        root[:, None] * pair.tangential[np.ix_(modes.points, modes.points)] * root
    )
    assert modes.stiffness == pytest.approx(1 / values[:-9:-1], rel=1e-9)
    turn = (modes.shape * root[:, None]).T @ vectors[:, :-9:-1]
    assert np.abs(np.linalg.norm(turn, axis=1) - 1).max() <= 1e-10


@pytest.mark.share(0, 3, 6)
@pytest.mark.parametrize("length", [1e-7, 1e-6])
@pytest.mark.parametrize("angle", TILTS)
def test_always_more_modes_never_worsen_the_backbone(angle, length):
    pair = coated_pair(200)
    limit = friction_limit(200, angle)
    errors = np.array(
        [shear_modes(pair.tangential, limit, length, n).backbone_error for n in (1, 2, 4, 8, 16)]
    )
    assert np.all(np.diff(errors) <= 1e-12)
    assert errors[3] <= (1e-6 if length == 1e-6 else 3e-5)
    assert errors[0] > errors[3]


@pytest.mark.share(0)
@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_always_short_bonds_have_the_modes_that_they_need(angle):
    """Bonds a hundredth and a thousandth of the slide at which the patch lets go: shares of the limit that fall with
    the modes; where the bonds are too short to tell, all that are allowed."""
    pair = coated_pair(60)
    limit = friction_limit(60, angle)
    reach = limit.sum() / tangential_stiffness(pair.tangential, limit > 0)
    for share, most in ((1e-2, 1e-3), (1e-3, 5e-3)):
        errors = [
            shear_modes(pair.tangential, limit, share * reach, n).backbone_error
            for n in (4, 8, 16, 32)
        ]
        assert np.all(np.diff(errors) <= 1e-12) and errors[1] < most and errors[0] < 0.05
    assert enough_modes(pair.tangential, limit, 1e-9 * reach, 8, 1e-4).stiffness.size == min(
        64, np.sum(limit > 0)
    )


@pytest.mark.parametrize("angle", [0.0, 1e-4])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_always_the_fewest_modes_meet_a_tolerance_that_one_fewer_misses(angle, tolerance):
    pair = coated_pair(100)
    limit = friction_limit(100, angle)
    found = fewest_modes(pair.tangential, limit, 1e-6, tolerance)
    count = found.stiffness.size
    fewer = shear_modes(pair.tangential, limit, 1e-6, count - 1)
    assert found.backbone_error <= tolerance and (
        count == 2 or tolerance < 1.3 * fewer.backbone_error
    )
    np.testing.assert_allclose(found.shape, shear_modes(pair.tangential, limit, 1e-6, count).shape)


@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_exact_backbone_error_is_the_error_of_the_resultant(angle):
    """Against the points themselves, on the 24 slides that the error is taken over."""
    length = 1e-6
    pair = coated_pair(100)
    limit = friction_limit(100, angle)
    touching = limit > 0
    c = pair.tangential[np.ix_(touching, touching)]
    slides = (6 * length + 2 * np.abs(c @ limit[touching]).max()) * (np.arange(1, 25) / 24) ** 2
    whole = np.array([saturating(c, limit[touching], length, q).sum() for q in slides])
    for count in (1, 3):
        modes = shear_modes(pair.tangential, limit, length, count)
        few = np.array([few_modes(modes, limit, length, q) for q in slides])
        assert modes.backbone_error == pytest.approx(
            np.abs(few - whole).max() / limit.sum(), abs=1e-12
        )


@pytest.mark.parametrize("angle", [0.0, 1e-4])
def test_always_gathered_points_leave_the_backbone(angle):
    """On three times as many slides as they are chosen by; where nothing can be left out all points stay."""
    pair = coated_pair(200)
    limit = friction_limit(200, angle)
    modes = shear_modes(pair.tangential, limit, 1e-6, 4)
    few, share, _ = fewest_gauss_points(modes, pair.interface.x[modes.points], 1e-5)
    assert few.points.size in (16, 32) and share.sum() == pytest.approx(limit.sum(), rel=1e-12)
    for slide in 8e-6 * (np.arange(1, 73) / 72) ** 2:
        whole = few_modes(modes, limit, 1e-6, slide)
        assert abs(few_modes(few, share, 1e-6, slide) - whole) <= 2e-5 * limit.sum()
    all_, same, _ = fewest_gauss_points(modes, pair.interface.x[modes.points], 1e-16)
    assert all_.shape is modes.shape and (same == limit[modes.points]).all()


def test_refuses_a_patch_that_could_jump_by_itself():
    pair = coated_pair(100)
    limit = friction_limit(100, 1e-4)
    length = 1e-7
    touching = limit > 0
    stiffness = limit[touching] / length
    largest = np.linalg.eigvals(
        stiffness[:, None] * pair.tangential[np.ix_(touching, touching)]
    ).real.max()
    edge = 1 + 1 / largest
    with pytest.raises(PatchfemError, match=r"friction\.kinetic.*slip suddenly"):
        shear_modes(pair.tangential, limit, length, 8, weakening=edge * (1 + 1e-6))
    assert (
        shear_modes(pair.tangential, limit, length, 8, weakening=edge * (1 - 1e-6)).stiffness.size
        == 8
    )


def test_refuses_a_patch_without_friction():
    with pytest.raises(PatchfemError, match="the friction limit is 0 at every point"):
        jenkins_set(coated_pair(40).tangential, np.zeros(41))


def test_exact_one_node_is_one_element():
    pair = coated_pair(40)
    limit = np.zeros(41)
    limit[7] = 2.0
    group = jenkins_set(pair.tangential, limit)
    assert group.stiffness == pytest.approx([1 / pair.tangential[7, 7]], rel=1e-13)
    assert group.yield_displacement == pytest.approx([2.0 * pair.tangential[7, 7]], rel=1e-13)
