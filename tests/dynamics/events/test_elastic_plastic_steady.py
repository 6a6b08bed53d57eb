"""Periodic motions by the map from yield to yield: closed form, long runs, finite differences,
energies and limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve
from test_elastic_plastic import ONE, basis, random_rig

from patchfem.core import NotConverged, PatchfemError, SineDrive
from patchfem.dynamics import continue_to_steady_state as settled
from patchfem.dynamics import make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.dynamics.events.period import PeriodMap
from patchfem.dynamics.events.steady import solve_steady as steady
from patchfem.structure.drives import make_levels

FACES = np.array([[1.0, 0.4], [0.3, -1.0]])
PAIR = basis([1.0, 2.3], [0.01, 0.02], FACES[0], [1.0, 0.5], [1.0, 0.2], None, FACES)
TWO = [make_elements([2.0, 1.0], [0.1, 0.3]), make_elements([1.5], [0.12])]


def jenkins_amplitude(stiffness, limit, zeta, ratio, guess):
    """Amplitude of one mode of frequency 1 behind one element, driven at `ratio` by a unit sine: the half period from
    one turning point to the next, a stick and a slip, each by the exponential of its matrix."""

    def moved(x, spring, force, phase, time):
        matrix = np.zeros((5, 5))
        matrix[0, 1] = 1.0
        matrix[1, :2] = (-1 - spring, -2 * zeta)
        matrix[1, 2] = -1.0
        matrix[1, 4] = -force
        matrix[2, 3] = ratio
        matrix[3, 2] = -ratio
        return (expm(matrix * time) @ [*x, np.sin(phase), np.cos(phase), 1.0])[:2]

    def misses(unknown):
        top, phase, stick = unknown
        held = moved((top, 0.0), stiffness, limit - stiffness * top, phase, stick)
        end = moved(held, 0.0, -limit, phase + ratio * stick, np.pi / ratio - stick)
        return held[0] - top + 2 * limit / stiffness, end[0] + top, end[1]

    found = fsolve(misses, guess, xtol=1e-13)
    assert np.abs(misses(found)).max() < 1e-13
    return found[0]


@pytest.mark.parametrize(
    ("stiffness", "printed"), [(10, 0.249538145), (100, 0.285786312), (1000, 0.288449682)]
)
def test_exact_printed_amplitudes_at_resonance(stiffness, printed):
    found = steady(ONE, SineDrive(1.0, 1.0), [make_elements([stiffness], [0.8 / stiffness])])
    assert found.amplitude == pytest.approx(printed, abs=6e-10)
    assert (found.regime, found.symmetric) == ("slides", True) and found.residual < 1e-13
    assert np.abs(found.multipliers).max() < 1


@pytest.mark.parametrize(("ratio", "limit"), [(1.0, 0.5), (1.2, 0.3), (0.7, 0.2), (1.4, 0.6)])
def test_exact_one_element_in_closed_form(ratio, limit):
    modes = basis([1.0], [0.05], [1.0], [1.0], [1.0])
    group = [make_elements([3.0], [limit / 3])]
    drive = SineDrive(1.0, ratio)
    found = steady(modes, drive, group)
    run = simulate(
        modes, drive, group, 1, window=1, start=found.start, memory=found.memory
    ).response
    # it turns over, so what has slipped does too
    assert run.slip.max() == pytest.approx(-run.slip.min(), rel=1e-9)
    top = np.argmax(run.slide)  # where a rough look has the turning point and the yield
    stick = (run.slide[top:] > run.slide[top] - 2 * limit / 3).sum() / 400 * drive.period
    want = jenkins_amplitude(
        3.0, limit, 0.05, ratio, (1.02 * found.amplitude, ratio * run.time[top] + 0.02, stick)
    )
    assert found.amplitude == pytest.approx(want, rel=1e-11)


@pytest.mark.parametrize(
    ("seed", "cycles"),
    [
        (101, 150),
        (109, 1050),
        (102, 250),
        *(pytest.param(seed, 5000, marks=pytest.mark.slow) for seed in range(112, 123)),
    ],
)
def test_exact_random_rigs_against_long_runs(seed, cycles):
    """The symmetric motion has the amplitude and the rates of a long run, also if it starts from
    an early cycle."""
    modes, drive, k, y = random_rig(seed, 200)
    group = [make_elements(k, y)]
    found = steady(modes, drive, group)
    run = simulate(modes, drive, group, 60, window=1)
    mine = settled(modes, drive, group, *run.end)
    long = simulate(modes, drive, group, cycles, window=1)
    before = simulate(modes, drive, group, cycles - 1, window=1).end[0]
    end = np.concatenate([long.end[0].z, long.end[0].v])
    size = np.abs(end).max()
    rest = 1 - np.abs(found.multipliers).max()
    # it repeats
    assert np.abs(end - np.concatenate([before.z, before.v])).max() < 5e-10 * size * rest
    assert found.amplitude == pytest.approx(long.output_amplitude, rel=1e-9)
    assert np.abs(mine.start.v - long.end[0].v).max() < 1e-9 * size * drive.omega
    assert max(found.residual, mine.residual) < 1e-12
    assert np.abs(found.multipliers[0]) == pytest.approx(np.abs(mine.multipliers[0]), abs=1e-6)
    if cycles < 5000:
        assert np.abs(mine.start.z - long.end[0].z).max() < 1e-9 * size


def test_exact_two_interfaces_against_a_long_run():
    found = steady(PAIR, SineDrive(1.0, 1.4), TWO)
    long = simulate(PAIR, SineDrive(1.0, 1.4), TWO, 400, window=1)
    assert found.amplitude == pytest.approx(long.output_amplitude, rel=1e-12)
    again = simulate(
        PAIR, SineDrive(1.0, 1.4), TWO, 20, window=1, start=found.start, memory=found.memory
    )
    np.testing.assert_allclose(again.end[0].z, found.start.z, rtol=1e-12)
    np.testing.assert_allclose(again.end[0].v, found.start.v, rtol=1e-12)


def columns(one, drive, point, half, step):
    """Derivative of a map by central differences."""
    out = []
    for k in range(point.unknowns.size):
        move = step * np.eye(point.unknowns.size)[k]
        ends = [
            one(drive, point.with_unknowns(point.unknowns + side * move), half, False).end.unknowns
            for side in (1, -1)
        ]
        out.append((ends[0] - ends[1]) / (2 * step))
    return np.array(out).T


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("rig", ["two interfaces", "elements"])
def test_order_the_derivative_is_that_of_finite_differences(rig, half):
    modes = PAIR
    drive = SineDrive(1.0, 0.7)
    groups = TWO
    if rig == "elements":
        modes, drive, k, y = random_rig(104, 200)
        groups = [make_elements(k, y)]
    one = PeriodMap(modes, groups)
    found = steady(modes, drive, groups)
    slope = one(drive, found.point, half).slope
    assert slope.shape == (found.point.unknowns.size,) * 2 and slope.shape[0] > 2 * modes.omega.size
    # between two events the map is a sum of sines and exponentials: differences are of second order
    misses = [
        np.abs(columns(one, drive, found.point, half, step) - slope).max() for step in (4e-6, 2e-6)
    ]
    assert misses[0] < 1e-6 * np.abs(slope).max()


def linear_amplitude(modes, drive, stiffness):
    """Output of modes beside a spring, by the complex response."""
    n = modes.omega.size
    face = modes.slide
    matrix = (
        np.diag(modes.omega**2)
        + stiffness * np.outer(face, face) / modes.mass
        + 1j * drive.omega * modes.damping_matrix
        - drive.omega**2 * np.eye(n)
    )
    return drive.acceleration * abs(modes.output @ np.linalg.solve(matrix, modes.base))


@pytest.mark.parametrize("seed", [100, 104, 112])
@pytest.mark.parametrize("held", [True, False])
def test_exact_limits_are_the_linear_response(seed, held):
    """Elements that never yield are a spring, and elements without strength are nothing."""
    modes, drive, k, y = random_rig(seed, 50)
    found = steady(modes, drive, [make_elements(k, y * 1e6 if held else y * 0)])
    assert found.regime == "stuck" and found.multipliers.size == 2 * modes.omega.size
    assert found.amplitude == pytest.approx(
        linear_amplitude(modes, drive, k.sum() if held else 0.0), rel=1e-12
    )


def test_refuses_what_does_not_repeat():
    group = [make_elements([4.0], [0.05])]
    with pytest.raises(PatchfemError, match="a single sine without end"):
        steady(ONE, make_levels([1.0, 2.0], 1.0, 5), group)
    free = basis([1.0], [0.0], [1.0], [1.0], [1.0])
    with pytest.raises(NotConverged, match="grows from period to period"):  # 0.7 is below pi/4
        steady(free, SineDrive(1.0, 1.0), [make_elements([20.0], [0.7 / 20])])


def test_exact_a_last_step_that_forgets_a_turn_ends_the_search():
    """Newton's last step may leave a turning place that the period behind it slips past: the
    point before it counts."""
    r = np.random.default_rng(1068)
    count = int(np.exp(r.uniform(0, np.log(40))))
    omega = r.choice([0.0, 1.0, np.exp(r.uniform(-1, 2))])
    zeta = float(r.choice([0.0, 0.003, 0.1, 1.0, 2.5]))
    shares = r.uniform(0.3, 1.5, 3) * r.choice([-1, 1], 3)
    mass = float(np.exp(r.uniform(-1, 1)))
    modes = replace(basis([omega], [zeta], *([one] for one in shares)), mass=mass)
    y = np.exp(r.uniform(-3, 0, count))
    k = np.exp(r.uniform(-1, 2, count))
    k *= mass * np.exp(r.uniform(-2, 0.3)) / (k @ y)
    drive = SineDrive(1.0, float(np.exp(r.uniform(-1, 1))))
    groups = [make_elements(k, y)]
    done = simulate(modes, drive, groups, 40, window=4)
    one = settled(modes, drive, groups, *done.end)
    on = simulate(modes, drive, groups, 2, window=1, start=one.start, memory=one.memory)
    assert one.amplitude == pytest.approx(on.output_amplitude, rel=1e-9)
    np.testing.assert_allclose(
        [on.end[0].z, on.end[0].v], [one.start.z, one.start.v], atol=1e-9 * on.output_amplitude
    )
