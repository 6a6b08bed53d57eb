"""Continuation, stability and backbones of the harmonic balance against closed forms and time
integration."""

import numpy as np
import pytest
from harmonic_cases import (
    jenkins_forces,
    make_bond_law,
    make_elements,
    make_five_modes,
    make_sdof,
    march_exactly,
)
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from patchfem import plan, run
from patchfem.core import G_N, NotConverged, PatchfemError, SineDrive
from patchfem.dynamics import (
    FreeBalance,
    LawGroup,
    Spring,
    evaluate_series,
    find_branches,
    find_steady_motion,
    make_cycle_response,
    trace_over_frequency,
)
from patchfem.dynamics.harmonic.backbone import trace_free_motions
from patchfem.dynamics.harmonic.branch import find_backbone, trace_over_level
from patchfem.dynamics.harmonic.continuation import PathSettings, follow_curve
from patchfem.dynamics.harmonic.harmonic import HarmonicBalance
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.stability import find_motion_monodromy
from patchfem.dynamics.periodic import find_multipliers

W = 2 * np.pi * 143
MASS = 0.884
RIG = make_modal_basis(W, 0.003, mass=MASS)
CUBIC = 0.02 * MASS * W**2 / 1e-6  # 2 % of the stiffness of the flexure at 1 mm [N/m^3]
STIFF = [(RIG.output, Spring(0.0, CUBIC))]
LEVEL = 5 * G_N


# ---- continuation of a curve


def test_exact_continuation_follows_circle_through_fold():
    """Continuation follows the circle x^2 + p^2 = 1 through its fold at p = 1 to the other side,
    within 1e-8."""

    def circle(x, p):
        return np.array([x[0] ** 2 + p**2 - 1]), np.array([[2 * x[0]]]), np.array([2 * p])

    path = follow_curve(circle, [0.6], 0.8, (-0.5, 2.0), True, PathSettings(0.05, 0.05))
    assert (
        path.ended == "start"
        and path.p[-1] == -0.5
        and path.x[-1, 0] == pytest.approx(-np.sqrt(0.75), abs=1e-9)
    )
    assert path.x[:, 0] ** 2 + path.p**2 == pytest.approx(np.ones(path.p.size), abs=1e-8)
    assert path.folds == (pytest.approx(1.0, abs=1e-8),) and not path.crossings
    back = follow_curve(circle, [0.6], 0.8, (-0.5, 2.0), False, PathSettings(0.05, 0.05))
    assert back.ended == "end" and (np.diff(back.p) < 0).all() and (back.x > 0).all()


def test_exact_pitchfork_is_reported_as_crossing():
    """On x (p - 1/3 - x^2) = 0 along x = 0 the branch point at p = 1/3 is reported within 0.02."""

    def pitchfork(x, p):
        return x * (p - 1 / 3) - x**3, np.array([[p - 1 / 3 - 3 * x[0] ** 2]]), x

    path = follow_curve(pitchfork, [0.0], 0.0, (0.0, 1.0), True, PathSettings(0.02, 0.02, size=1.0))
    assert (
        path.ended == "end" and len(path.crossings) == 1 and abs(path.crossings[0] - 1 / 3) < 0.02
    )


def test_refuses_start_without_nearby_branch():
    """A start from which Newton's method finds no point of the curve is refused."""
    with pytest.raises(NotConverged, match="the first point of the curve"):
        follow_curve(
            lambda x, p: (x**2 + 1 + p**2, np.diag(2 * x), np.array([2 * p])),
            [0.3],
            0.5,
            (0.0, 1.0),
        )


# ---- folds of the rig with a cubic spring


def duffing_equation(drive, friction=0.0):
    """Return the right-hand side of the Duffing equation under a drive."""

    def state_derivative(t, y):
        z, v = y
        return [v, -(W**2) * z - 0.006 * W * v - CUBIC / MASS * z**3 - drive.values(t)]

    return state_derivative


def test_exact_branch_stability_agrees_with_time_integration():
    """At 160 Hz DOP853 stays on each stable branch over 5 cycles. On the unstable branch a
    perturbation grows as its Floquet multiplier predicts, within 1e-3."""
    drive = SineDrive(LEVEL, 2 * np.pi * 160)
    points = find_branches(RIG, drive, STIFF, tolerance=1e-7)
    assert [p.stable for p in points] == [True, False, True]
    for p in points:
        response = make_cycle_response(p, RIG, drive, 200)
        start = np.array([response.modal[0, 0], response.modal_rate[0, 0]])
        solution = solve_ivp(
            duffing_equation(drive),
            (0, 5 * drive.period),
            start,
            "DOP853",
            rtol=1e-11,
            atol=1e-13,
            t_eval=response.time * 0.99999,
        )
        assert np.abs(
            solution.y[0] - np.interp(response.time * 0.99999, response.time, response.modal[:, 0])
        ).max() < 3e-4 * p.amplitude([1.0])
        assert not np.isnan(solution.y).any()
    middle = points[1]
    eigen = np.linalg.eig(find_motion_monodromy(middle, RIG))
    k = int(np.argmax(np.abs(eigen[0])))
    # the monodromy matrix acts on (z, z'/omega)
    perturbation = eigen[1][:, k].real * np.array([1.0, drive.omega])
    response = make_cycle_response(middle, RIG, drive, 200)
    start = np.array([response.modal[0, 0], response.modal_rate[0, 0]])
    perturbation *= 1e-6 / abs(perturbation[0])
    ends = [
        solve_ivp(
            duffing_equation(drive),
            (0, 3 * drive.period),
            start + sign * perturbation,
            "DOP853",
            rtol=1e-11,
            atol=1e-14,
        ).y[:, -1]
        for sign in (1, -1)
    ]
    growth = (ends[0] - ends[1])[0] / (2 * perturbation[0])
    assert growth == pytest.approx(eigen[0][k].real ** 3, rel=1e-3) and growth > 1.2


def test_exact_folds_over_level_agree_with_closed_form():
    """The folds of the branch over the drive level at 150 Hz are the extremes of the one-harmonic
    relation level(amplitude), within 1e-3."""
    drive = SineDrive(LEVEL, 2 * np.pi * 150)
    branch = trace_over_level(RIG, drive, STIFF, (0.2 * G_N, 12 * G_N), harmonics=1)

    def level(a):
        return a * np.hypot(
            W**2 - drive.omega**2 + 0.75 * CUBIC / MASS * a * a, 0.006 * W * drive.omega
        )

    a = np.linspace(1e-5, 4e-3, 40_001)
    extremes = np.flatnonzero(np.diff(np.sign(np.diff(level(a)))))
    assert sorted(branch.folds) == pytest.approx(sorted(level(a)[extremes + 1]), rel=1e-3)
    assert [level(np.abs(p.coefficients[0, 1])) for p in branch.points] == pytest.approx(
        [p.level for p in branch.points], rel=1e-6
    )


def test_refuses_invalid_sweep_values():
    """Sweeps with a single value, a negative value or NaN are refused."""
    for values in ([100.0], [100.0, -5.0], [100.0, np.nan, 120.0]):
        with pytest.raises(PatchfemError, match="positive"):
            trace_over_frequency(RIG, SineDrive(1.0, W), STIFF, values)
        with pytest.raises(PatchfemError, match="positive"):
            trace_over_level(RIG, SineDrive(1.0, W), STIFF, values)


# ---- Floquet multipliers


@pytest.mark.share(0)
@pytest.mark.parametrize("omega", [0.8, 1.2])
def test_exact_monodromy_agrees_with_perturbed_march(omega):
    """For five modes and 40 elements the modal part of the monodromy matrix agrees with central
    differences of a march within 0.15 %."""
    modes, (k, w), drive = make_five_modes(), make_elements(40), SineDrive(1.5, omega)
    p = find_steady_motion(modes, drive, Jenkins(k, w), tolerance=1e-5)
    response = make_cycle_response(p, modes, drive, 2000)
    stretch = jenkins_forces(np.append(np.tile(response.slide[:-1], 2), response.slide[0]), k, w)[1]
    start = np.concatenate([response.modal[0], response.modal_rate[0]])
    columns = []
    for j in (0, 1, 4, 5, 6):
        perturbation = np.zeros(10)
        perturbation[j] = 1e-4
        ends = [
            march_exactly(modes, drive, k, w, start + s * perturbation, stretch, 2000)[0][-1]
            for s in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / 2e-4)
    monodromy = find_motion_monodromy(p, modes, 4096)
    scale = np.repeat([1.0, omega], 5)
    block = (monodromy[:10, :10] * scale[:, None] / scale)[:, [0, 1, 4, 5, 6]]
    assert np.abs(block - np.array(columns).T).max() < 1.5e-3 * np.abs(block).max()
    assert np.sum(np.abs(find_multipliers(monodromy)) < 1e-4) >= monodromy.shape[0] - 10


def test_exact_monodromy_of_bonds_agrees_with_dop853():
    """For one mode with bonds the whole monodromy matrix, including the bond state u with u' = (q'
    - |q'| u)/length, agrees with differences of DOP853 solutions."""
    modes = make_sdof(0.05)
    drive = SineDrive(1.0, 1.2)
    limit = 0.4
    length = 0.3
    p = find_steady_motion(modes, drive, make_bond_law(limit, length), tolerance=1e-6)
    response = make_cycle_response(p, modes, drive, 4096)

    def state_derivative(t, y):
        z, v, u = y
        return [v, -z - 0.1 * v - limit * u - np.sin(1.2 * t), (v - abs(v) * u) / length]

    def integrate_period(state):
        return solve_ivp(
            state_derivative, (0, drive.period), state, "DOP853", rtol=1e-10, atol=1e-12
        ).y[:, -1]

    start = np.array([response.modal[0, 0], response.modal_rate[0, 0], response.force[0] / limit])
    assert integrate_period(start) == pytest.approx(start, abs=2e-5)
    columns = np.stack(
        [
            (integrate_period(start + d) - integrate_period(start - d)) / 2e-4
            for d in 1e-4 * np.eye(3)
        ],
        axis=1,
    )
    scale = np.array(
        [1.0, 1.2, 1 / length]
    )  # the matrix uses rates per radian and the stretch u length
    monodromy = find_motion_monodromy(p, modes, 4096) * scale[:, None] / scale
    assert monodromy == pytest.approx(columns, abs=2e-5)


# ---- backbones


def test_exact_free_motion_satisfies_modal_equations():
    """With coupled damping every harmonic of the free motion satisfies the modal equations,
    including the balancing negative damping."""
    modes = make_five_modes(np.diag(0.04 * np.arange(1, 6)) + 0.02)
    group = LawGroup(modes, Jenkins(*make_elements(20)), 512)
    omega, shape = modes.compute_stuck_mode(group.rows, group.stiffness(), 1)
    for motion in trace_free_motions(
        FreeBalance(HarmonicBalance(modes, group.rows, group), 1, 5, omega),
        [0.05, 0.3],
        omega,
        shape,
    ):
        for k in range(6):
            a = np.diag(modes.omega**2 - (k * motion.omega) ** 2) + 1j * k * motion.omega * (
                modes.damping_matrix - 2 * motion.zeta * motion.omega * np.eye(5)
            )
            residual = a @ motion.modal[k] + modes.slide * motion.forces[0, k] / modes.mass
            assert np.abs(residual).max() < 1e-9 * motion.amplitude
        assert motion.modal[1, 1] == motion.amplitude and motion.slides[0] == pytest.approx(
            motion.modal @ modes.slide
        )


def test_exact_backbone_of_duffing_oscillator_agrees_with_closed_form():
    """The backbone of the undamped Duffing oscillator has the period 4 K(m)/sqrt(1 + c a^2) with m
    = c a^2/(2 (1 + c a^2)), within 1e-4."""
    backbone = find_backbone(
        make_sdof(0.0), Spring(0.0, 0.5), np.array([0.3, 1.0, 2.0]), harmonics=15
    )
    for a, f, z in zip(backbone.slide, backbone.frequency, backbone.damping):
        c = 0.5 * a * a
        assert f == pytest.approx(np.sqrt(1 + c) / (4 * ellipk(c / (2 * (1 + c)))), rel=1e-4)
        assert abs(z) < 1e-9


BENCH = """\
[normal]
load = "100 N"
[friction]
{law}
[slide]
kind = "sine"
amplitude = "{amplitude} um"
frequency = "10 Hz"
cycles = 4
[accuracy]
steps_per_cycle = 600
"""


@pytest.mark.parametrize(
    "text, law",
    [
        (
            'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "2 um"',
            Jenkins([30 / 2e-6], [2e-6]),
        ),
        ('law = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"', make_bond_law(30.0, 2e-6)),
    ],
    ids=["elastic-plastic", "bonds"],
)
def test_exact_backbone_agrees_with_bench_loops(text, law):
    """With one harmonic, frequency, damping and loss of the backbone agree with the stiffness and
    the area of the loop of a bench, within 3e-4."""
    omega = W
    amplitudes = np.array([4.0])
    backbone = find_backbone(RIG, law, amplitudes * 1e-6, harmonics=1)
    for k, amplitude in enumerate(amplitudes):
        result = run(plan(BENCH.format(law=text, amplitude=amplitude)))
        stiffness = result.measures["equivalent_stiffness"].value
        area = result.measures["loop_area"].value
        w = np.sqrt(omega**2 + stiffness / MASS)
        assert 2 * np.pi * backbone.frequency[k] == pytest.approx(w, rel=2e-4)
        loss = area / (2 * np.pi * MASS * w * w * (amplitude * 1e-6) ** 2)
        assert backbone.damping[k] == pytest.approx(0.003 * omega / w + loss, rel=3e-4)
        assert backbone.loss[k] == pytest.approx(area, rel=3e-4)


def test_refuses_falling_amplitudes_and_missing_mode():
    """Amplitudes in falling order and a mode that does not exist are refused."""
    with pytest.raises(PatchfemError, match="in rising order"):
        find_backbone(RIG, Spring(1.0), np.array([2.0, 1.0]))
    with pytest.raises(PatchfemError, match="mode 3"):
        find_backbone(RIG, Spring(1.0), np.array([2.0]), mode=3)
    assert evaluate_series(np.array([1.0, 1.0 + 0j]), 4) == pytest.approx([2, 1, 0, 1])
