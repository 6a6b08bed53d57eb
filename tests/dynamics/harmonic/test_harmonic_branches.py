"""Continuation, stability and backbones of the harmonic balance against closed forms and time
integration."""

from dataclasses import replace

import numpy as np
import pytest
from harmonic_cases import (
    make_bond_law,
    make_elements,
    make_five_modes,
    make_sdof,
    make_speed_law,
    march_exactly,
)
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from yielding_points import jenkins_forces

from patchfem.core import G_N, NotConverged, SineDrive
from patchfem.dynamics import (
    LawGroup,
    Spring,
    find_free_motions,
    find_steady_motion,
    list_coexisting_slides,
    make_cycle_response,
    make_free_balance,
    trace_over_frequency,
)
from patchfem.dynamics.harmonic.continuation import PathSettings, follow_curve
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.series import evaluate_series, half_range
from patchfem.hybrid import cases, drives, periodic
from patchfem.hybrid.laws.masing import from_elements
from patchfem.hybrid.records import LawNumbers

W = 2 * np.pi * 143
MASS = 0.884
RIG = make_modal_basis(W, 0.003, mass=MASS)
CUBIC = 0.02 * MASS * W**2 / 1e-6  # 2 % of the stiffness of the flexure at 1 mm [N/m^3]
STIFF = [(RIG.output, Spring(0.0, CUBIC))]
LEVEL = 5 * G_N


# ---- multipliers from the map of a period


def find_multipliers(motion, modes, interfaces) -> np.ndarray:
    """Return the Floquet multipliers of a steady motion with interfaces of the engine `hybrid`."""
    period = 2 * np.pi / motion.omega
    signal = drives.make_tones([(motion.level, motion.omega, 0.0)], period)
    size = motion.amplitude(modes.output)
    options = cases.Options(moves_base=True, rtol=1e-11)
    rig = cases.make_rig(modes, signal, interfaces, (size, size * motion.omega), options)
    start = cases.make_start(rig, interfaces)
    case = cases.Case(rig, start, np.array([period]), np.zeros(1), np.zeros(0), len(interfaces))
    return periodic.find_multipliers(case, motion.modal_state)


def make_interfaces(group) -> list[cases.Interface]:
    """Return the interfaces of the engine `hybrid` for an elastic-plastic element and a cubic spring of a group."""
    interfaces = []
    for row, law in group.parts:
        slide = row if np.ndim(row) else group.modes.interfaces[row]
        if isinstance(law, Jenkins):
            limit, length = law.limit, float(law.limit_slide[0])
            numbers = (0.0, -1.0, limit, length, 1, 0.0, length, 0.0, limit)
            numbers = LawNumbers("masing", numbers)
        else:
            assert law.stiffness == 0 and np.isinf(law.wavelength)
            numbers = LawNumbers("springs", (law.cubic, 0.0, 1.0))
        interfaces.append(cases.Interface(numbers, cases.Load(1.0), slide))
    return interfaces


def find_coexisting_motions(modes, drive, group, tolerance: float = 1e-3) -> list:
    """Return the steady motions with their multipliers, in increasing amplitude of the output."""
    motion = find_steady_motion(modes, drive, group, tolerance=tolerance)
    starts = list_coexisting_slides(motion, drive)
    motions = [find_steady_motion(modes, drive, group, None, tolerance, start) for start in starts]
    interfaces = make_interfaces(motion.group)
    motions = [
        replace(found, multipliers=find_multipliers(found, modes, interfaces)) for found in motions
    ]
    return sorted(motions, key=lambda motion: motion.amplitude(modes.output))


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
    assert path.folds == (pytest.approx(1.0, abs=1e-8),)
    back = follow_curve(circle, [0.6], 0.8, (-0.5, 2.0), False, PathSettings(0.05, 0.05))
    assert back.ended == "end" and (np.diff(back.p) < 0).all() and (back.x > 0).all()


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


def duffing_equation(drive):
    """Return the right-hand side of the Duffing equation under a drive."""

    def state_derivative(t, y):
        z, v = y
        return [v, -(W**2) * z - 0.006 * W * v - CUBIC / MASS * z**3 - drive.values(t)]

    return state_derivative


def test_exact_branch_stability_agrees_with_time_integration():
    """At 160 Hz DOP853 stays on each branch over 5 cycles. The Floquet multipliers are the eigenvalues of differences of
    DOP853 over a cycle, within 1e-3, and one of the middle branch is above 1."""
    drive = SineDrive(LEVEL, 2 * np.pi * 160)
    points = find_coexisting_motions(RIG, drive, STIFF, 1e-7)
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
        columns = []
        for step in (np.array([1e-8, 0.0]), np.array([0.0, 1e-8 * drive.omega])):
            ends = [
                solve_ivp(
                    duffing_equation(drive),
                    (0, drive.period),
                    start + sign * step,
                    "DOP853",
                    rtol=1e-12,
                    atol=1e-15,
                ).y[:, -1]
                for sign in (1, -1)
            ]
            columns.append((ends[0] - ends[1]) / (2 * step.max()))
        exact = np.linalg.eigvals(np.array(columns).T)
        exact = exact[np.argsort(-np.abs(exact))]
        assert np.abs(p.multipliers) == pytest.approx(np.abs(exact), rel=1e-3)
    assert points[1].multipliers[0].real > 1.06


def test_exact_folds_agree_with_closed_form():
    """The folds of the branch with one harmonic are the extremes of the frequency over the amplitude on the relation
    level = a |W^2 - w^2 + 3 c a^2/(4 m) + 2 i xi W w|, within 1e-4 of the width of the sweep."""
    branch = trace_over_frequency(RIG, SineDrive(LEVEL, W), STIFF, (130.0, 220.0), harmonics=1)

    # with s = W^2 + 3 c a^2/(4 m): w^2 = s - d +- sqrt(d^2 - 2 s d + (level/a)^2), d = (0.006 W)^2/2
    a = np.geomspace(1e-4, 2e-2, 1_000_001)
    stiffness = W**2 + 0.75 * CUBIC / MASS * a * a
    half_damping = 0.5 * (0.006 * W) ** 2
    root = half_damping**2 - 2 * stiffness * half_damping + (LEVEL / a) ** 2
    a = a[root >= 0]
    frequency = np.sqrt((stiffness - half_damping + np.sqrt(np.maximum(root, 0)))[root >= 0]) / (
        2 * np.pi
    )
    expected = (frequency.min(), frequency[-1])
    assert sorted(branch.folds) == pytest.approx(sorted(expected), abs=1e-3)
    for p in branch.points:
        size = abs(p.slides[0, 1])
        stiff = W**2 - p.omega**2 + 0.75 * CUBIC / MASS * size**2
        assert size * np.hypot(stiff, 0.006 * W * p.omega) == pytest.approx(LEVEL, rel=1e-6)


@pytest.mark.slow
def test_exact_all_three_motions_near_fold_are_found():
    """Near the end of the upper branch two stable motions and one unstable motion are found,
    although two of them differ by only 8 %."""
    w = 2 * np.pi * 143
    mass = 0.884
    limit = 0.3 * 26 * 4.4482216152605
    modes = make_modal_basis(w, 0.003, mass=mass)
    laws = [(0, Jenkins([limit / 1e-6], [1e-6])), (modes.output, Spring(0.0, 2e10))]
    for hertz in np.linspace(147.2, 147.6, 5):
        drive = SineDrive(6 * G_N, 2 * np.pi * hertz)
        points = find_coexisting_motions(modes, drive, LawGroup(modes, laws))
        assert [p.stable for p in points] == [True, False, True], hertz


# ---- Floquet multipliers


def test_exact_multipliers_of_bonds_agree_with_dop853():
    """For one mode with bonds, whose state u obeys u' = (q' - |q'| u)/length, the multipliers agree with those of
    differences of DOP853 solutions within 1e-4."""
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
    exact = np.linalg.eigvals(columns)
    exact = exact[np.argsort(-np.abs(exact))]
    numbers = LawNumbers(
        "bonds",
        (limit, length, length, 0.0, 1.0, 1.0),
        (1.0, 0.0, 0.0, length),
        (1.0, 1e-2 * length, 1e-4 * length**2, length),
    )
    multipliers = find_multipliers(
        p, modes, [cases.Interface(numbers, cases.Load(1.0), modes.slide)]
    )
    assert np.abs(multipliers[:2]) == pytest.approx(np.abs(exact[:2]), abs=1e-4)


def test_exact_multipliers_of_many_elements_agree_with_perturbed_march():
    """For five modes and eight elements, all of which slip in a cycle, the multipliers agree with those of differences of a
    march over a period within 6e-3; the stretches of the elements at its start leave no trace."""
    modes, (k, w), drive = make_five_modes(), make_elements(8), SineDrive(1.5, 0.8)
    p = find_steady_motion(modes, drive, Jenkins(k, w), tolerance=1e-5)

    def march_period(state):
        """Return modes, rates and stretches of the elements after a period of 800 steps."""
        rows = march_exactly(modes, drive, k, w, state[:10], state[10:], 800)[0]
        stretch = state[10:]
        for change in np.diff(rows[:, :5] @ modes.slide):
            stretch = np.clip(stretch + change, -w, w)
        return np.concatenate([rows[-1], stretch])

    response = make_cycle_response(p, modes, drive, 800)
    slides = np.append(np.tile(response.slide[:-1], 2), response.slide[0])
    stretch = jenkins_forces(slides, k, w)[1]
    start = np.concatenate([response.modal[0], response.modal_rate[0], stretch])
    columns = [
        (march_period(start + step) - march_period(start - step)) / 2e-5
        for step in 1e-5 * np.eye(start.size)
    ]
    exact = np.sort(np.abs(np.linalg.eigvals(np.array(columns).T)))[::-1]
    interface = cases.Interface(from_elements(k, w), cases.Load(1.0), modes.slide)
    multipliers = np.abs(find_multipliers(p, modes, [interface]))
    assert multipliers == pytest.approx(exact[:10], abs=6e-3)
    assert exact[9] > 0.2 and exact[10] < 1e-6


@pytest.mark.parametrize("speed", [0.1, 3e-3])
def test_exact_product_of_multipliers_of_rate_law_is_its_damping(speed):
    """Liouville's formula: the product of the multipliers is exp(-int (2 zeta + dF/dv) dt), within 1 %, also for a law
    whose force changes its sign between two samples of a cycle."""
    modes = make_sdof(0.05)
    drive = SineDrive(1.0, 1.2)
    p = find_steady_motion(modes, drive, make_speed_law(0.4, speed), tolerance=1e-3)
    response = make_cycle_response(p, modes, drive, 2**17)
    slope = 0.4 / speed / np.cosh(np.minimum(np.abs(response.slide_rate / speed), 300)) ** 2
    damping = drive.period * (0.1 + slope[:-1].mean())
    numbers = LawNumbers("tanh", (0.4, speed))
    multipliers = find_multipliers(
        p, modes, [cases.Interface(numbers, cases.Load(1.0), modes.slide)]
    )
    assert np.prod(multipliers).real == pytest.approx(np.exp(-damping), rel=1e-2)


# ---- backbones


def find_backbone(modes, law, amplitudes, harmonics):
    """Return the free motions of the first mode at amplitudes [m]."""
    group = LawGroup(modes, law)
    equations = make_free_balance(modes, group, 0, amplitudes[-1], harmonics)
    return [found.motion for found in find_free_motions(equations, amplitudes)]


@pytest.mark.parametrize("is_forced", [False, True])
def test_exact_free_motion_satisfies_modal_equations(is_forced):
    """With coupled damping every harmonic of the free motion satisfies the modal equations, including the negative
    damping, or the force at a point in the first harmonic, and the output has the requested half range."""
    modes = make_five_modes(np.diag(0.004 * np.arange(1, 6)) + 0.002)
    group = LawGroup(modes, Jenkins(*make_elements(20, total=0.6, limit=0.12)))
    excitation = np.outer(modes.output, modes.output) / 0.36 if is_forced else None
    equations = make_free_balance(modes, group, 1, 0.3, 5, output=modes.output)
    motions = find_free_motions(equations, [0.05, 0.3])
    assert motions[1].motion.loss > 1e-3
    if is_forced:
        forced = make_free_balance(modes, group, 1, 0.3, 5, excitation, modes.output)
        motions = find_free_motions(forced, [0.05, 0.3], starts=motions)
    for found in motions:
        motion = found.motion
        for k in range(6):
            force = excitation * (k == 1) if is_forced else np.eye(5)
            a = np.diag(modes.omega**2 - (k * motion.omega) ** 2) + 1j * k * motion.omega * (
                modes.damping_matrix - 2 * motion.zeta * motion.omega * force
            )
            residual = a @ motion.modal[k] + modes.slide * motion.forces[0, k] / modes.mass
            assert np.abs(residual).max() < 1e-9 * motion.amplitude
        assert motion.modal[1, 1] == pytest.approx(motion.amplitude, abs=1e-12)
        assert motion.slides[0] == pytest.approx(motion.modal @ modes.slide)
        output = evaluate_series(motion.modal @ modes.output, 2**16)
        assert np.ptp(output) / 2 == pytest.approx(found.amplitude, rel=1e-7)


def test_exact_backbone_of_duffing_oscillator_agrees_with_closed_form():
    """The backbone of the undamped Duffing oscillator has the period 4 K(m)/sqrt(1 + c a^2) with m
    = c a^2/(2 (1 + c a^2)), within 1e-4."""
    for motion in find_backbone(make_sdof(0.0), Spring(0.0, 0.5), [0.3, 1.0, 2.0], 15):
        c = 0.5 * half_range(motion.slides[0]) ** 2
        frequency = np.sqrt(1 + c) / (4 * ellipk(c / (2 * (1 + c))))
        assert motion.omega / (2 * np.pi) == pytest.approx(frequency, rel=1e-4)
        assert abs(motion.zeta) < 1e-9
