"""Periodic motions by the map from yield to yield: closed form, long runs, finite differences,
energies and limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve
from test_elastic_plastic import ONE, make_basis, random_rig

from patchfem.core import NotConverged, PatchfemError, SineDrive
from patchfem.dynamics import continue_to_steady_state as continue_to_steady
from patchfem.dynamics import make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.dynamics.events.period import PeriodMap
from patchfem.dynamics.events.steady import solve_steady as steady
from patchfem.structure.drives import make_levels

INTERFACES = np.array([[1.0, 0.4], [0.3, -1.0]])
PAIR = make_basis([1.0, 2.3], [0.01, 0.02], INTERFACES[0], [1.0, 0.5], [1.0, 0.2], None, INTERFACES)
TWO = [make_elements([2.0, 1.0], [0.1, 0.3]), make_elements([1.5], [0.12])]


def jenkins_amplitude(stiffness, limit, zeta, ratio, guess):
    """Return the amplitude of a mode of frequency 1 with one Jenkins element, under a unit sine at
    `ratio`.

    The half period between two reversals consists of a stick and a slip, each solved by a matrix
    exponential.
    """

    def propagate(x, spring, force, phase, time):
        matrix = np.zeros((5, 5))
        matrix[0, 1] = 1.0
        matrix[1, :2] = (-1 - spring, -2 * zeta)
        matrix[1, 2] = -1.0
        matrix[1, 4] = -force
        matrix[2, 3] = ratio
        matrix[3, 2] = -ratio
        return (expm(matrix * time) @ [*x, np.sin(phase), np.cos(phase), 1.0])[:2]

    def residuals(unknown):
        peak, phase, stick = unknown
        stick_end = propagate((peak, 0.0), stiffness, limit - stiffness * peak, phase, stick)
        end = propagate(stick_end, 0.0, -limit, phase + ratio * stick, np.pi / ratio - stick)
        return stick_end[0] - peak + 2 * limit / stiffness, end[0] + peak, end[1]

    solution = fsolve(residuals, guess, xtol=1e-13)
    assert np.abs(residuals(solution)).max() < 1e-13
    return solution[0]


@pytest.mark.parametrize(("ratio", "limit"), [(1.0, 0.5), (0.7, 0.2)])
def test_exact_amplitude_of_one_element_agrees_with_closed_form(ratio, limit):
    """The amplitude of a mode with one element agrees within 1e-11 with a solution by matrix
    exponentials."""
    modes = make_basis([1.0], [0.05], [1.0], [1.0], [1.0])
    group = [make_elements([3.0], [limit / 3])]
    drive = SineDrive(1.0, ratio)
    motion = steady(modes, drive, group)
    run = simulate(
        modes, drive, group, 1, window=1, start=motion.start, memory=motion.memory
    ).response
    # the motion is antisymmetric, and so is the slip
    assert run.slip.max() == pytest.approx(-run.slip.min(), rel=1e-9)
    peak = np.argmax(run.slide)  # rough position of the reversal, as a start value
    stick = (run.slide[peak:] > run.slide[peak] - 2 * limit / 3).sum() / 400 * drive.period
    expected = jenkins_amplitude(
        3.0, limit, 0.05, ratio, (1.02 * motion.amplitude, ratio * run.time[peak] + 0.02, stick)
    )
    assert motion.amplitude == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize(
    ("seed", "cycles"),
    [
        (101, 150),
        (102, 250),
        *(pytest.param(seed, 5000, marks=pytest.mark.slow) for seed in range(112, 123)),
    ],
)
def test_exact_random_rigs_agree_with_long_runs(seed, cycles):
    """The steady motion of random rigs has the amplitude and multipliers of a long run within 1e-9,
    also if it starts from an early cycle."""
    modes, drive, k, y = random_rig(seed, 200)
    group = [make_elements(k, y)]
    motion = steady(modes, drive, group)
    run = simulate(modes, drive, group, 60, window=1)
    continued = continue_to_steady(modes, drive, group, *run.end)
    long = simulate(modes, drive, group, cycles, window=1)
    previous = simulate(modes, drive, group, cycles - 1, window=1).end[0]
    end = np.concatenate([long.end[0].z, long.end[0].v])
    scale = np.abs(end).max()
    decay = 1 - np.abs(motion.multipliers).max()
    # the long run is periodic
    assert np.abs(end - np.concatenate([previous.z, previous.v])).max() < 5e-10 * scale * decay
    assert motion.amplitude == pytest.approx(long.output_amplitude, rel=1e-9)
    assert np.abs(continued.start.v - long.end[0].v).max() < 1e-9 * scale * drive.omega
    assert max(motion.residual, continued.residual) < 1e-12
    assert np.abs(motion.multipliers[0]) == pytest.approx(
        np.abs(continued.multipliers[0]), abs=1e-6
    )
    if cycles < 5000:
        assert np.abs(continued.start.z - long.end[0].z).max() < 1e-9 * scale


def test_exact_two_interfaces_agree_with_long_run():
    """The steady motion of two interfaces has the amplitude of a run of 400 cycles within 1e-12 and
    repeats over 20 cycles."""
    motion = steady(PAIR, SineDrive(1.0, 1.4), TWO)
    long = simulate(PAIR, SineDrive(1.0, 1.4), TWO, 400, window=1)
    assert motion.amplitude == pytest.approx(long.output_amplitude, rel=1e-12)
    repeated = simulate(
        PAIR, SineDrive(1.0, 1.4), TWO, 20, window=1, start=motion.start, memory=motion.memory
    )
    np.testing.assert_allclose(repeated.end[0].z, motion.start.z, rtol=1e-12)
    np.testing.assert_allclose(repeated.end[0].v, motion.start.v, rtol=1e-12)


def derivative_by_differences(period_map, drive, point, half, step):
    """Return the derivative of a map by central differences."""
    out = []
    for k in range(point.unknowns.size):
        change = step * np.eye(point.unknowns.size)[k]
        ends = [
            period_map(
                drive, point.with_unknowns(point.unknowns + sign * change), half, False
            ).end.unknowns
            for sign in (1, -1)
        ]
        out.append((ends[0] - ends[1]) / (2 * step))
    return np.array(out).T


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("rig", ["two interfaces", "elements"])
def test_exact_derivative_of_map_agrees_with_differences(rig, half):
    """The derivative of the period map agrees with central differences within 1e-6."""
    modes = PAIR
    drive = SineDrive(1.0, 0.7)
    groups = TWO
    if rig == "elements":
        modes, drive, k, y = random_rig(104, 200)
        groups = [make_elements(k, y)]
    period_map = PeriodMap(modes, groups)
    motion = steady(modes, drive, groups)
    slope = period_map(drive, motion.point, half).slope
    assert (
        slope.shape == (motion.point.unknowns.size,) * 2 and slope.shape[0] > 2 * modes.omega.size
    )
    # between two events the map is smooth, so that central differences have second-order errors
    errors = [
        np.abs(derivative_by_differences(period_map, drive, motion.point, half, step) - slope).max()
        for step in (4e-6, 2e-6)
    ]
    assert errors[0] < 1e-6 * np.abs(slope).max()


def linear_amplitude(modes, drive, stiffness):
    """Return the output amplitude of modes with a linear spring, from the complex response."""
    n = modes.omega.size
    slide = modes.slide
    matrix = (
        np.diag(modes.omega**2)
        + stiffness * np.outer(slide, slide) / modes.mass
        + 1j * drive.omega * modes.damping_matrix
        - drive.omega**2 * np.eye(n)
    )
    return drive.acceleration * abs(modes.output @ np.linalg.solve(matrix, modes.base))


@pytest.mark.parametrize("seed", [104, 112])
@pytest.mark.parametrize("is_stuck", [True, False])
def test_exact_limiting_cases_agree_with_linear_response(seed, is_stuck):
    """Elements that never yield act as a spring, and elements without strength have no effect,
    within 1e-12."""
    modes, drive, k, y = random_rig(seed, 50)
    motion = steady(modes, drive, [make_elements(k, y * 1e6 if is_stuck else y * 0)])
    assert motion.regime == "stuck" and motion.multipliers.size == 2 * modes.omega.size
    assert motion.amplitude == pytest.approx(
        linear_amplitude(modes, drive, k.sum() if is_stuck else 0.0), rel=1e-12
    )


def test_refuses_motion_that_is_not_periodic():
    """Drives of several levels and growing motions have no steady motion and are refused."""
    group = [make_elements([4.0], [0.05])]
    with pytest.raises(PatchfemError, match="a single sine without end"):
        steady(ONE, make_levels([1.0, 2.0], 1.0, 5), group)
    free = make_basis([1.0], [0.0], [1.0], [1.0], [1.0])
    with pytest.raises(NotConverged, match="grows from period to period"):  # limit 0.7 < pi/4
        steady(free, SineDrive(1.0, 1.0), [make_elements([20.0], [0.7 / 20])])


def test_exact_search_ends_if_last_step_loses_a_reversal():
    """If the last step of Newton's method loses a reversal, the search returns the point before
    this step, which is periodic within 1e-9."""
    rng = np.random.default_rng(1068)
    count = int(np.exp(rng.uniform(0, np.log(40))))
    omega = rng.choice([0.0, 1.0, np.exp(rng.uniform(-1, 2))])
    zeta = float(rng.choice([0.0, 0.003, 0.1, 1.0, 2.5]))
    components = rng.uniform(0.3, 1.5, 3) * rng.choice([-1, 1], 3)
    mass = float(np.exp(rng.uniform(-1, 1)))
    modes = replace(make_basis([omega], [zeta], *([motion] for motion in components)), mass=mass)
    y = np.exp(rng.uniform(-3, 0, count))
    k = np.exp(rng.uniform(-1, 2, count))
    k *= mass * np.exp(rng.uniform(-2, 0.3)) / (k @ y)
    drive = SineDrive(1.0, float(np.exp(rng.uniform(-1, 1))))
    groups = [make_elements(k, y)]
    result = simulate(modes, drive, groups, 40, window=4)
    motion = continue_to_steady(modes, drive, groups, *result.end)
    repeated = simulate(modes, drive, groups, 2, window=1, start=motion.start, memory=motion.memory)
    assert motion.amplitude == pytest.approx(repeated.output_amplitude, rel=1e-9)
    np.testing.assert_allclose(
        [repeated.end[0].z, repeated.end[0].v],
        [motion.start.z, motion.start.v],
        atol=1e-9 * repeated.output_amplitude,
    )
