"""Curves of periodic motions: continuation, folds, stability and coexisting motions, against closed forms and DOP853."""

import numpy as np
import pytest
from event_driven_cases import make_modes
from harmonic_cases import make_elements, make_five_modes, march_exactly
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp

from patchfem.core import G_N, NotConverged, SineDrive
from patchfem.event_driven import cases, drives, periodic_curves, runs
from patchfem.event_driven.laws import masing
from patchfem.event_driven.periodic import Shooting, find_periodic_motion
from patchfem.event_driven.periodic_curves import MotionCurve, PathSettings
from patchfem.event_driven.records import LawNumbers

AMPLITUDE = "relative_displacement_amplitude"
W = 2 * np.pi * 143
MASS = 0.884
RIG = make_modal_basis(W, 0.003, mass=MASS)
CUBIC = 0.02 * MASS * W**2 / 1e-6  # 2 % of the stiffness of the flexure at 1 mm [N/m^3]
LEVEL = 5 * G_N
DRIVE = SineDrive(LEVEL, 2 * np.pi * 160)
STEPS = PathSettings(0.0125, 0.05)
IWAN = LawNumbers("masing", (-0.3, 0.5, 0.8, 0.2, 1, 0.0, 0.2, 0.0, 0.8))
BONDS = LawNumbers(
    "bonds", (0.4, 0.3, 0.3, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.3), (1.0, 3e-3, 9e-6, 0.3)
)


def make_case(modes, laws, drive, cycles: int = 1) -> cases.Case:
    """Return a case of some cycles of a drive, with laws on the slide of the modes."""
    signal = drives.make_tones([(drive.acceleration, drive.omega, 0.0)], drive.period)
    interfaces = [cases.Interface(law, cases.Load(1.0), modes.slide) for law in laws]
    options = cases.Options(moves_base=True, rtol=1e-11)
    rig = cases.make_rig(modes, signal, interfaces, cases.find_sizes(modes, signal, drive), options)
    schedule = cases.make_schedule(cycles, signal.period, 1)
    return cases.Case(
        rig, cases.make_start(rig, interfaces), *schedule, np.zeros(0), len(interfaces)
    )


def trace_frequencies(modes, laws, level, ends):
    """Return the equations and the path of the motions over the frequency [rad/s]."""

    def make(omega):
        return make_case(modes, laws, SineDrive(level, omega))

    first = find_periodic_motion(make(ends[0]))
    equations = MotionCurve(
        make, first.run.final, ends[0], has_kinks=masing.has_many_elements(laws[0])
    )
    return equations, equations.follow(ends, STEPS)


def trace_levels(modes, laws, drive, end=10.0):
    """Return the equations and the path of the motions over the level [m s-2] of a drive, up to `end` times its own."""

    def make(level):
        return make_case(modes, laws, SineDrive(level, drive.omega))

    weak = 1e-2 * drive.acceleration
    start = (find_periodic_motion(make(weak)).run.final, weak)
    equations = MotionCurve(make, *start, has_kinks=False)
    return equations, equations.follow((0.0, end * drive.acceleration), PathSettings(0.005, 0.02))


def list_coexisting_motions(equations, path, drive):
    """Return the motions of a curve over the level under a drive, in increasing amplitude."""
    motions = [point.motion for point in equations.list_crossings(path, drive.acceleration)]
    return sorted(motions, key=lambda motion: motion.run.values[AMPLITUDE])


@pytest.fixture(scope="module")
def curve_of_levels():
    """Equations and path of the motions of the rig with a cubic spring at 160 Hz over the level."""
    return trace_levels(RIG, DUFFING, DRIVE, 7.0)


# ---- continuation


def test_continuation_ends_with_count_of_steps():
    """A curve whose motions take too many steps ends before its bound, and a search for one motion is refused."""
    ends = (2 * np.pi * 100, 2 * np.pi * 130)
    first = (find_periodic_motion(make_sine_case(ends[0])).run.final, ends[0])
    equations = MotionCurve(make_sine_case, *first, has_kinks=False)
    equations.n_steps = periodic_curves.MAX_STEPS - 5e3
    path = equations.follow(ends, STEPS)
    assert path.ended == "cost" and 1 < len(path.points) and path.points[-1].w[-1] < ends[1]

    shooting = Shooting(make_sine_case(ends[0]))
    shooting.limit_steps(100)
    with pytest.raises(NotConverged, match=r"needs more than 1e\+02 steps"):
        shooting.relax(10)


@pytest.mark.long
def test_closed_curve_ends_after_one_turn(curve_of_levels):
    """At 160 Hz the level of the motions has a maximum L over their amplitude. Under the level (0.99 + p^2) L their curve
    over p is closed: it is followed once, and turns back where the level is L, at p = 0.1 and at p = -0.1."""
    equations, path = curve_of_levels
    highest = max(path.folds)
    start = equations.list_crossings(path, 0.99 * highest)[0].motion.run.final

    def make(p):
        return make_case(RIG, DUFFING, SineDrive((0.99 + p * p) * highest, DRIVE.omega))

    closed = MotionCurve(make, start, 0.0, has_kinks=False).follow((-0.2, 0.2), PathSettings())
    assert closed.ended == "loop" and closed.folds == pytest.approx((0.1, -0.1), rel=2e-3)
    assert (np.abs(np.array(closed.folds) - (0.1, -0.1)) < closed.fold_errors).all()
    p = np.array([point.w[-1] for point in closed.points])
    size = np.array([point.motion.run.values[AMPLITUDE] for point in closed.points])
    turned = np.unwrap(np.arctan2(p / 0.1, (size - size.mean()) / np.ptp(size)))
    assert 2 * np.pi <= abs(turned[-1] - turned[0]) < 2.2 * np.pi


def make_sine_case(omega: float) -> cases.Case:
    """Return the case of a period of the rig with a cubic spring at a frequency [rad/s]."""
    return make_case(RIG, DUFFING, SineDrive(LEVEL, omega))


# ---- folds and stability of the rig with a cubic spring


DUFFING = [LawNumbers("springs", (CUBIC, 0.0, 1.0))]


def test_folds_are_near_those_of_one_harmonic():
    """The folds are the extremes of the frequency over the amplitude on the relation of one harmonic, level =
    a |W^2 - w^2 + 3 c a^2/(4 m) + 2 i xi W w|, within the 2 % by which higher harmonics move them. There a multiplier
    passes 1."""
    ends = (2 * np.pi * 130, 2 * np.pi * 220)
    _, path = trace_frequencies(RIG, DUFFING, LEVEL, ends)
    assert path.ended == "end"

    # with s = W^2 + 3 c a^2/(4 m): w^2 = s - d +- sqrt(d^2 - 2 s d + (level/a)^2), d = (0.006 W)^2/2
    a = np.geomspace(1e-4, 2e-2, 1_000_001)
    stiffness = W**2 + 0.75 * CUBIC / MASS * a * a
    half_damping = 0.5 * (0.006 * W) ** 2
    root = half_damping**2 - 2 * stiffness * half_damping + (LEVEL / a) ** 2
    a = a[root >= 0]
    frequency = np.sqrt((stiffness - half_damping + np.sqrt(np.maximum(root, 0)))[root >= 0])
    expected = (frequency.min(), frequency[-1])
    folds = sorted(path.folds)
    assert folds == pytest.approx(sorted(expected), rel=2e-2)

    largest = np.array([np.abs(point.motion.multipliers).max() for point in path.points])
    omega = np.array([point.w[-1] for point in path.points])
    changes = np.flatnonzero(np.diff(largest > 1))
    assert sorted(omega[changes]) == pytest.approx(folds, rel=2e-3)


def test_exact_motions_and_stability_agree_with_dop853(curve_of_levels):
    """At 160 Hz three motions exist, of which the middle one is unstable. DOP853 returns to the state of each after a
    period, and its differences give the Floquet multipliers within 1e-4."""
    motions = list_coexisting_motions(*curve_of_levels, DRIVE)
    assert [motion.is_stable for motion in motions] == [True, False, True]

    def integrate(start):
        def state_derivative(t, y):
            z, v = y
            force = W**2 * z + 0.006 * W * v + CUBIC / MASS * z**3
            return [v, -force - DRIVE.values(t)]

        span = (0, DRIVE.period)
        return solve_ivp(state_derivative, span, start, "DOP853", rtol=1e-12, atol=1e-15).y[:, -1]

    scale = np.array([1.0, DRIVE.omega])
    for motion in motions:
        start = motion.run.case.y[:2]
        size = motion.run.values[AMPLITUDE]
        assert integrate(start) / scale == pytest.approx(start / scale, abs=1e-7 * size)
        columns = [
            (integrate(start + step) - integrate(start - step)) / (2 * step.max())
            for step in 1e-8 * np.diag(scale)
        ]
        exact = np.linalg.eigvals(np.array(columns).T)
        exact = exact[np.argsort(-np.abs(exact))]
        assert np.abs(motion.multipliers) == pytest.approx(np.abs(exact), rel=1e-4)
    assert motions[1].multipliers[0].real > 1.06


@pytest.mark.slow
def test_exact_all_three_motions_near_fold_are_found():
    """Near the end of the upper branch two stable motions and one unstable motion are found,
    although two of them differ by only 8 %."""
    limit = 0.3 * 26 * 4.4482216152605
    laws = [masing.from_elements([limit / 1e-6], [1e-6]), LawNumbers("springs", (2e10, 0.0, 1.0))]
    for hertz in np.linspace(147.2, 147.6, 5):
        drive = SineDrive(6 * G_N, 2 * np.pi * hertz)
        motions = list_coexisting_motions(*trace_levels(RIG, laws, drive), drive)
        assert [motion.is_stable for motion in motions] == [True, False, True], hertz


# ---- laws with memory


def test_curve_passes_where_the_reversal_is_at_the_start_of_the_period():
    """Below 5.167 g the stick of an elastic-plastic element with a cubic spring begins before the start of the period, and
    above it after it. The curve of levels passes there, because no derivative refers to states beyond the reversal."""
    limit = 0.3 * 26 * 4.4482216152605
    laws = [masing.from_elements([limit / 1e-6], [1e-6]), LawNumbers("springs", (2e10, 0.0, 1.0))]

    def make(level):
        return make_case(RIG, laws, SineDrive(level, 2 * np.pi * 147.2))

    level = 5.14 * G_N
    start = (find_periodic_motion(make(level)).run.final, level)
    equations = MotionCurve(make, *start, has_kinks=False)
    path = equations.follow((5.13 * G_N, 5.2 * G_N), PathSettings(0.003, 0.03))
    speeds = np.array([point.w[1] for point in path.points])
    assert path.ended == "end" and speeds[0] < 0 < speeds[-1]


@pytest.mark.parametrize(
    "law", [IWAN, masing.from_elements([3.0, 4.0, 5.0], [0.05, 0.1, 0.02]), BONDS]
)
def test_points_of_curve_agree_with_long_runs(law):
    """Points of the curve of a mass on a spring through its resonance have the amplitudes and losses of runs from rest of
    100 cycles, within 2e-3; the memory of the transient may shift the loop of a run. All points are stable."""
    modes = make_modes(zeta=0.02)
    _, path = trace_frequencies(modes, [law], 0.5, (0.6, 3.0))
    assert path.ended == "end" and not path.folds
    assert all(point.motion.is_stable for point in path.points)
    for point in path.points[:: len(path.points) // 5]:
        values = point.motion.run.values
        run = runs.run_case(make_case(modes, [law], SineDrive(0.5, point.w[-1]), 100)).values
        for name in (AMPLITUDE, "loop_area"):
            assert values[name] == pytest.approx(run[name], rel=2e-3), (point.w[-1], name)


def test_exact_multipliers_of_bonds_agree_with_dop853():
    """For one mode with bonds, whose state u obeys u' = (q' - |q'| u)/length, the multipliers agree with those of
    differences of DOP853 solutions within 1e-4."""
    modes = make_modes(zeta=0.05)
    drive = SineDrive(1.0, 1.2)
    limit = 0.4
    length = 0.3
    motion = find_periodic_motion(make_case(modes, [BONDS], drive))

    def integrate_period(state):
        def state_derivative(t, y):
            z, v, u = y
            return [v, -z - 0.1 * v - limit * u - np.sin(1.2 * t), (v - abs(v) * u) / length]

        span = (0, drive.period)
        return solve_ivp(state_derivative, span, state, "DOP853", rtol=1e-10, atol=1e-12).y[:, -1]

    # The modes of the motion, with the stretch that repeats
    start = np.append(motion.run.case.y[:2], 0.0)
    for _ in range(20):
        start[2] = integrate_period(start)[2]
    assert integrate_period(start) == pytest.approx(start, abs=2e-5)
    columns = [
        (integrate_period(start + d) - integrate_period(start - d)) / 2e-4 for d in 1e-4 * np.eye(3)
    ]
    exact = np.linalg.eigvals(np.array(columns).T)
    exact = exact[np.argsort(-np.abs(exact))]
    found = motion.multipliers[np.argsort(-np.abs(motion.multipliers))]
    assert np.abs(found[:2]) == pytest.approx(np.abs(exact[:2]), abs=1e-4)


def test_exact_multipliers_of_many_elements_agree_with_perturbed_march():
    """For five modes and eight elements, all of which slip in a cycle, the multipliers agree with those of differences of a
    march over a period within 6e-3; the stretches of the elements at its start leave no trace."""
    modes = make_five_modes()
    k, w = make_elements(8)
    drive = SineDrive(1.5, 0.8)
    motion = find_periodic_motion(make_case(modes, [masing.from_elements(k, w)], drive))

    def march_period(state):
        """Return modes, rates and stretches of the elements after a period of 800 steps."""
        rows = march_exactly(modes, drive, k, w, state[:10], state[10:], 800)[0]
        stretch = state[10:]
        for change in np.diff(rows[:, :5] @ modes.slide):
            stretch = np.clip(stretch + change, -w, w)
        return np.concatenate([rows[-1], stretch])

    # The modes of the motion, with the stretches that repeat
    start = np.append(motion.run.case.y[:10], np.zeros(8))
    for _ in range(3):
        start[10:] = march_period(start)[10:]
    assert march_period(start) == pytest.approx(start, abs=1e-4)
    columns = [
        (march_period(start + step) - march_period(start - step)) / 2e-5
        for step in 1e-5 * np.eye(start.size)
    ]
    exact = np.sort(np.abs(np.linalg.eigvals(np.array(columns).T)))[::-1]
    found = np.sort(np.abs(motion.multipliers))[::-1]
    assert found[:10] == pytest.approx(exact[:10], abs=6e-3)
    assert exact[9] > 0.2 and exact[10] < 1e-6


@pytest.mark.parametrize("speed", [0.1, 3e-3])
def test_product_of_multipliers_of_rate_law_is_its_damping(speed):
    """Liouville's formula: the product of the multipliers is exp(-int (2 zeta + dF/dv) dt), within 1 %, also for a law
    whose force changes within a small part of the cycle."""
    modes = make_modes(zeta=0.05)
    drive = SineDrive(1.0, 1.2)
    motion = find_periodic_motion(make_case(modes, [LawNumbers("tanh", (0.4, speed))], drive))

    def state_derivative(t, y):
        z, v, _ = y
        force = 0.4 * np.tanh(v / speed)
        slope = 0.4 / speed * (1 - np.tanh(v / speed) ** 2)
        return [v, -z - 0.1 * v - force - np.sin(1.2 * t), 0.1 + slope]

    start = np.append(motion.run.case.y[:2], 0.0)
    end = solve_ivp(state_derivative, (0, drive.period), start, "LSODA", rtol=1e-10, atol=1e-12)
    assert np.prod(motion.multipliers).real == pytest.approx(np.exp(-end.y[2, -1]), rel=1e-2)


# Peaks by stiffness, for friction limit 0.8 and damping ratio 0.003; DOP853 at 1e-12
PEAKS = {10: 0.249538145, 100: 0.285786312, 1000: 0.288449682}


@pytest.mark.parametrize("stiffness", PEAKS)
def test_exact_peaks_at_resonance_agree_with_dop853(stiffness):
    """Amplitudes at resonance with an elastic-plastic element agree with values by DOP853 to their last digit."""
    modes = make_modes(zeta=0.003)
    law = masing.from_elements([stiffness], [0.8 / stiffness])
    motion = find_periodic_motion(make_case(modes, [law], SineDrive(1.0, 1.0)))
    assert motion.run.values[AMPLITUDE] == pytest.approx(PEAKS[stiffness], rel=1e-8)
