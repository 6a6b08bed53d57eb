"""The averaged law: exact averages, the steady limit of equation 2.17 for pressure on the lower piece, and scenes."""

from itertools import pairwise

import numpy as np
import pytest
from friction_paths import LowerPressure, make_points
from hypothesis import given
from hypothesis import strategies as st
from march_paths import follow_path
from scene_texts import COULOMB, POINT, SHORT, SLIDE, SMALL_PATCH
from scipy.integrate import quad
from scipy.special import gamma

from patchfem import SceneError, build, plan
from patchfem.friction import Bonds
from patchfem.friction.laws.convolution import average_pressure
from patchfem.runs import solve_with_coarser
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import loads

AVERAGED = '[friction]\nlaw = "convolution"\nstatic = 0.3\nbond_length = "1 mm"\n'
FLAT = SMALL_PATCH.split("[contact.tilt]")[0]
CROWN = '[contact.crown]\nradius = "20 m"\n'


def sliding_limits(nodes, sigma, weight, length, order):
    """Return the friction forces over the coefficient in rigid sliding to +x and to -x."""
    weight = np.where(sigma > 0, weight, 0.0)
    averages = (average_pressure(nodes, nodes, sigma, sign, length, order) for sign in (1, -1))
    return [float(weight @ average) for average in averages]


def integrate_average(y, nodes, sigma, direction, length, order):
    """Return the average pressure at a point by quadrature between the kinks of the pressure."""
    limits = np.unique(np.clip(direction * (y - nodes), 0, None))
    if limits.size < 2:
        return 0.0
    # The substitution s = t^(1/(p + 1)) removes the singularity of negative orders at the start.
    power = 1 / (order + 1)

    def integrand(t):
        s = t**power / length
        return np.exp(-s) * np.interp(y - direction * t**power, nodes, sigma)

    scale = power * length ** -(order + 1) / gamma(order + 1)
    return scale * sum(
        quad(integrand, a, b, epsabs=1e-15, epsrel=1e-13)[0]
        for a, b in pairwise(limits ** (order + 1))
    )


@pytest.mark.parametrize("order", [-0.5, 0.0, 0.4, 2.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("length", [0.05, 40.0])
def test_exact_average_pressure_equals_integral(order, direction, length):
    """The average pressure agrees with its defining integral, for both sliding directions and bond lengths of 0.05 to 40."""
    rng = np.random.default_rng(3)
    nodes = np.cumsum(rng.uniform(0.2, 1.5, 9))
    sigma = rng.uniform(0.1, 2, 9)
    points = np.append(rng.uniform(nodes[0], nodes[-1], 6), nodes[[0, 4, -1]])
    expected = [integrate_average(y, nodes, sigma, direction, length, order) for y in points]
    assert average_pressure(points, nodes, sigma, direction, length, order) == pytest.approx(
        expected, rel=1e-9, abs=1e-12
    )


# ---- the steady limit of 2.17


@pytest.mark.share(0, 5)
@pytest.mark.parametrize("tail, order", [(None, 1), (0.0, 1), (0.0, 0), (0.0, 2)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_exact_long_sliding_reaches_averaged_law(tail, order, direction):
    """The traction of bonds after 20 bond lengths, extrapolated to zero step, agrees with the averaged law.

    The pressure on the lower piece has two contact zones with a gap of several nodes, over which no
    bond survives.
    """
    nodes = np.linspace(0, 60, 81)
    sigma = np.maximum(np.sin(nodes / 2) + 0.8, 0.0)
    bonds = Bonds(0.4, 1.0, float(order), "report" if order != 1 else "stretch", initial=0.0)
    pressure = LowerPressure(nodes, sigma)
    contact = make_points(bonds, pressure, tail)
    coarse, fine = (
        follow_path(contact, direction * np.linspace(0, 20, steps + 1), frames=(steps,))
        .motion.snapshots[0]
        .forces
        for steps in (160, 320)
    )
    average = average_pressure(nodes + direction * 20.0, nodes, sigma, direction, 1.0, order)
    expected = 0.4 * direction * np.where(pressure(direction * 20.0) > 0, average, 0.0)
    assert (np.diff((sigma > 0).astype(int)) != 0).sum() >= 2
    assert (4 * fine - coarse) / 3 == pytest.approx(expected, abs=2e-6)
    assert np.abs(expected).max() > 0.4


@given(st.floats(-30, 30), st.sampled_from([1.0, -1.0]))
def test_always_average_is_within_pressures(offset, direction):
    """An average is never negative and never above the largest pressure, so that the averaged law creates no energy."""
    nodes = np.linspace(0, 9, 13)
    sigma = np.maximum(np.sin(nodes), 0.0)
    average = average_pressure(nodes + offset, nodes, sigma, direction, 0.8, 1.0)
    assert (average >= -1e-14).all()
    assert (average <= sigma.max() + 1e-12).all()


def test_exact_sliding_limits_differ_by_edge_pressure():
    """The sliding limits in both directions fall short by the bond length times the pressure at the edge (order 0)."""
    nodes = np.linspace(0, 40, 2001)
    weight = np.gradient(nodes)
    weight[[0, -1]] /= 2
    forward, back = sliding_limits(nodes, 1 + nodes / 40, weight, 1.0, 0.0)
    assert 60 - forward == pytest.approx(2 - 1 / 40, rel=1e-4) and 60 - back == pytest.approx(
        1 + 1 / 40, rel=1e-4
    )


# ---- scenes


def run_bench(text, *sets, steps=64):
    """Return the solved patch, if there is one, and the bench run of a scene."""
    model = build(loads(text, sets=sets))
    patch = solve_with_coarser(model.patch, 1e-3, False)[0] if model.patch is not None else None
    return patch, bench.run_bench(model, patch, steps, 4)


def test_exact_point_under_varying_load_equals_coulomb():
    """The averaged law at a single point under a varying load equals Coulomb's law."""
    sets = ["normal.amplitude=60 N", "normal.frequency=300 Hz"]
    dwell = '[slide]\nkind = "dwell"\nspeed = "5 mm/s"\ndistance = "20 um"\nhold = "5 ms"\ndistance_after = "20 um"\n'
    _, averaged = run_bench(POINT + AVERAGED + dwell, *sets)
    _, coulomb = run_bench(POINT + COULOMB + dwell, *sets)
    assert averaged.force == pytest.approx(
        coulomb.force, rel=1e-13
    ) and averaged.values == pytest.approx(coulomb.values)
    assert np.ptp(averaged.load) > 100


@pytest.mark.parametrize("order", [0, 1])
def test_exact_patch_bench_force_equals_average_resultant(order):
    """The peak forces of a tilted patch on the bench equal the resultants of the averaged pressure in each direction."""
    patch, result = run_bench(
        SMALL_PATCH + AVERAGED + SLIDE, "contact.tilt.angle=0.1 mrad", f"friction.order={order}"
    )
    x = patch.x
    sigma = patch.pressure.sigma_n
    weight = patch.pieces.interface.weight
    for direction, force in ((1, result.force.max()), (-1, -result.force.min())):
        resultant = sum(
            w * integrate_average(y, x, sigma, direction, 1e-3, order)
            for y, s, w in zip(x, sigma, weight)
            if s > 0
        )
        assert force == pytest.approx(0.3 * resultant, rel=1e-9)
    assert result.force.max() < 0.97 * 0.3 * patch.pressure.load
    assert abs(result.force.max() + result.force.min()) > 1e-3 * result.force.max()
    assert result.values["energy_balance"] < 1e-12 and result.slip == pytest.approx(result.slide)


def test_symmetric_block_equals_reduced_coulomb():
    """A symmetric block on a rig moves as with Coulomb's law whose coefficient is reduced by the averaging."""
    text = FLAT + CROWN + AVERAGED.replace("1 mm", "300 um") + SHORT
    scene = loads(text)
    averaged = run(plan(scene), estimate=False)
    patch = averaged.patch
    forward, back = sliding_limits(
        patch.x, patch.pressure.sigma_n, patch.pieces.interface.weight, 3e-4, 1.0
    )
    assert forward == pytest.approx(back, rel=1e-9) and 0.5 < forward / patch.pressure.load < 0.9
    coulomb = run(
        plan(
            loads(
                FLAT + CROWN + COULOMB + SHORT,
                sets=[f"friction.static={0.3 * forward / patch.pressure.load!r}"],
            )
        ),
        estimate=False,
    )
    for name, m in coulomb.measures.items():
        assert m.reason or averaged.measures[name].value == pytest.approx(
            m.value, rel=1e-6, abs=1e-12
        ), name
    march = run(
        plan(loads(text, sets=["accuracy.method=march", "accuracy.steps_per_cycle=1600"])),
        estimate=False,
    )
    name = "relative_displacement_amplitude"
    assert march.measures[name].value == pytest.approx(averaged.measures[name].value, rel=1e-3)
    weight = patch.pieces.interface.weight
    assert averaged.fields["shear_stress"][1:] @ weight == pytest.approx(
        averaged.window.force[np.searchsorted(averaged.window.time, averaged.fields["time"][1:])],
        rel=1e-9,
    )
    assert not any("moves exactly as one point" in line for line in averaged.warnings)


def test_exact_mesh_error_is_within_stated_error():
    """A mesh four times finer changes the motion of the block by less than the stated error."""
    text = FLAT + CROWN + AVERAGED.replace("1 mm", "300 um") + SHORT
    measures = run(plan(loads(text))).measures
    fine_measures = run(
        plan(loads(text, sets=["contact.element_size=0.125 mm"])), estimate=False
    ).measures
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area"):
        difference = abs(measures[name].value - fine_measures[name].value)
        assert 1e-6 * abs(fine_measures[name].value) < difference < measures[name].error, name


def test_asymmetric_pressure_has_two_limits_on_rig():
    """The force of a rigid block with an asymmetric pressure lies between the limits of both directions."""
    sets = ["contact.tilt.angle=0.01 mrad", "drive.acceleration=20 g"]
    result = run(plan(loads(SMALL_PATCH + AVERAGED + SHORT, sets=sets)), estimate=False)
    patch = result.patch
    forward, back = sliding_limits(
        patch.x, patch.pressure.sigma_n, patch.pieces.interface.weight, 1e-3, 1.0
    )
    force = result.window.force
    assert forward != pytest.approx(back, rel=1e-2)
    assert force.max() == pytest.approx(0.3 * forward, rel=1e-9)
    assert force.min() == pytest.approx(-0.3 * back, rel=1e-9)


@pytest.mark.parametrize(
    "text, sets, message",
    [
        (
            SHORT,
            ["accuracy.method=exact"],
            "cannot be computed from event to event for law 'convolution'",
        ),
        (SLIDE, ["friction.order=-1"], "friction.order: must be > -1, not -1"),
        (
            SLIDE,
            ["friction.kinetic=0.2"],
            "laws with it are coulomb, nonlocal and lugre",
        ),
    ],
)
def test_refuses_unsupported_keys_of_averaged_law(text, sets, message):
    """Scene keys that the averaged law does not support are refused."""
    with pytest.raises(SceneError, match=message):
        loads(SMALL_PATCH + AVERAGED + text, sets=sets)
