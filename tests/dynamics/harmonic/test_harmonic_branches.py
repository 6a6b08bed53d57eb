"""Continuation, stability and backbone against closed forms, time integration and perturbed marches."""

import numpy as np
import pytest
from harmonic_cases import bonds, five, many, march, of_speed, plain_jenkins, sdof
from modal_bases import basis_of
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from patchfem import plan, run
from patchfem.core import G_N, NotConverged, PatchfemError, SineDrive
from patchfem.dynamics import (
    FreeBalance,
    LawGroup,
    Spring,
    add_stability,
    evaluate_series,
    find_branches,
    find_point,
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
RIG = basis_of(W, 0.003, mass=MASS)
CUBIC = 0.02 * MASS * W**2 / 1e-6  # 2 % of the flexure at 1 mm
STIFF = [(RIG.output, Spring(0.0, CUBIC))]
LEVEL = 5 * G_N


# ---- following a curve


def test_exact_a_circle_and_its_folds():
    """x^2 + p^2 = 1 from x = 0.6, p = 0.8: through p = 1 and back down to p = -0.5 on the other side."""

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


def test_exact_a_pitchfork_is_a_crossing():
    """x (p - 1/3 - x^2) = 0 along x = 0: a branch meets at 1/3."""

    def fork(x, p):
        return x * (p - 1 / 3) - x**3, np.array([[p - 1 / 3 - 3 * x[0] ** 2]]), x

    path = follow_curve(fork, [0.0], 0.0, (0.0, 1.0), True, PathSettings(0.02, 0.02, size=1.0))
    assert (
        path.ended == "end" and len(path.crossings) == 1 and abs(path.crossings[0] - 1 / 3) < 0.02
    )


def test_refuses_a_start_off_every_branch():
    with pytest.raises(NotConverged, match="the first point of the curve"):
        follow_curve(
            lambda x, p: (x**2 + 1 + p**2, np.diag(2 * x), np.array([2 * p])),
            [0.3],
            0.5,
            (0.0, 1.0),
        )


# ---- the fold of the stiffened rig


def duffing(drive, friction=0.0):
    def rhs(t, y):
        z, v = y
        return [v, -(W**2) * z - 0.006 * W * v - CUBIC / MASS * z**3 - drive.values(t)]

    return rhs


def test_exact_both_stable_branches_by_time_integration():
    """At 160 Hz DOP853 stays on each stable branch over 5 cycles and leaves the unstable one at its multiplier."""
    drive = SineDrive(LEVEL, 2 * np.pi * 160)
    found = find_branches(RIG, drive, STIFF, tolerance=1e-7)
    assert [p.stable for p in found] == [True, False, True]
    for p in found:
        r = make_cycle_response(p, RIG, drive, 200)
        start = np.array([r.modal[0, 0], r.modal_rate[0, 0]])
        run_ = solve_ivp(
            duffing(drive),
            (0, 5 * drive.period),
            start,
            "DOP853",
            rtol=1e-11,
            atol=1e-13,
            t_eval=r.time * 0.99999,
        )
        assert np.abs(
            run_.y[0] - np.interp(r.time * 0.99999, r.time, r.modal[:, 0])
        ).max() < 3e-4 * p.amplitude([1.0])
        assert not np.isnan(run_.y).any()
    middle = found[1]
    vector = np.linalg.eig(find_motion_monodromy(middle, RIG))
    k = int(np.argmax(np.abs(vector[0])))
    # the state of the map is (z, z'/omega)
    push = vector[1][:, k].real * np.array([1.0, drive.omega])
    r = make_cycle_response(middle, RIG, drive, 200)
    start = np.array([r.modal[0, 0], r.modal_rate[0, 0]])
    push *= 1e-6 / abs(push[0])
    ends = [
        solve_ivp(
            duffing(drive),
            (0, 3 * drive.period),
            start + s * push,
            "DOP853",
            rtol=1e-11,
            atol=1e-14,
        ).y[:, -1]
        for s in (1, -1)
    ]
    growth = (ends[0] - ends[1])[0] / (2 * push[0])
    assert growth == pytest.approx(vector[0][k].real ** 3, rel=1e-3) and growth > 1.2


def test_exact_levels_jump_up_and_come_back():
    """The level at 150 Hz, raised: the folds of the one-harmonic relation level(amplitude)."""
    drive = SineDrive(LEVEL, 2 * np.pi * 150)
    found = trace_over_level(RIG, drive, STIFF, (0.2 * G_N, 12 * G_N), harmonics=1)

    def level(a):
        return a * np.hypot(
            W**2 - drive.omega**2 + 0.75 * CUBIC / MASS * a * a, 0.006 * W * drive.omega
        )

    a = np.linspace(1e-5, 4e-3, 400_001)
    turn = np.flatnonzero(np.diff(np.sign(np.diff(level(a)))))
    assert sorted(found.folds) == pytest.approx(sorted(level(a)[turn + 1]), rel=1e-3)
    assert [level(np.abs(p.coefficients[0, 1])) for p in found.points] == pytest.approx(
        [p.level for p in found.points], rel=1e-6
    )


def test_refuses_what_is_no_sweep():
    for bad in ([100.0], [100.0, -5.0], [100.0, np.nan, 120.0]):
        with pytest.raises(PatchfemError, match="positive"):
            trace_over_frequency(RIG, SineDrive(1.0, W), STIFF, bad)
        with pytest.raises(PatchfemError, match="positive"):
            trace_over_level(RIG, SineDrive(1.0, W), STIFF, bad)


# ---- multipliers


def test_exact_multipliers_of_the_linear_modes():
    modes = five()
    found = add_stability(
        find_point(modes, SineDrive(1.0, 1.2), Spring(0.0), harmonics=1), modes
    ).multipliers
    power = np.exp(2 * np.pi / 1.2 * modes.omega * (-0.02 + 1j * np.sqrt(1 - 0.02**2)))
    want = np.concatenate([power, power.conj()])
    assert max(np.abs(found - w).min() for w in want) < 1e-12


@pytest.mark.share(0)
@pytest.mark.parametrize("omega", [0.8, 1.2])
def test_exact_a_perturbed_march_of_elements(omega):
    """Five modes, 40 elements: the map of the modal state, memories as they are, by central differences of a march."""
    modes, (k, w), drive = five(), many(40), SineDrive(1.5, omega)
    p = find_point(modes, drive, Jenkins(k, w), tolerance=1e-5)
    r = make_cycle_response(p, modes, drive, 2000)
    stretch = plain_jenkins(np.append(np.tile(r.slide[:-1], 2), r.slide[0]), k, w)[1]
    start = np.concatenate([r.modal[0], r.modal_rate[0]])
    columns = []
    for j in (0, 1, 4, 5, 6):
        push = np.zeros(10)
        push[j] = 1e-4
        ends = [march(modes, drive, k, w, start + s * push, stretch, 2000)[0][-1] for s in (1, -1)]
        columns.append((ends[0] - ends[1]) / 2e-4)
    found = find_motion_monodromy(p, modes, 4096)
    unit = np.repeat([1.0, omega], 5)
    block = (found[:10, :10] * unit[:, None] / unit)[:, [0, 1, 4, 5, 6]]
    assert np.abs(block - np.array(columns).T).max() < 1.5e-3 * np.abs(block).max()
    assert np.sum(np.abs(find_multipliers(found)) < 1e-4) >= found.shape[0] - 10


def test_exact_bonds_forget_as_a_march_does():
    """One mode and the recursion: the whole map (z, v, u) by DOP853 on z'' and u' = (q' - |q'| u)/length."""
    modes = sdof(0.05)
    drive = SineDrive(1.0, 1.2)
    limit = 0.4
    length = 0.3
    p = find_point(modes, drive, bonds(limit, length), tolerance=1e-6)
    r = make_cycle_response(p, modes, drive, 4096)

    def rhs(t, y):
        z, v, u = y
        return [v, -z - 0.1 * v - limit * u - np.sin(1.2 * t), (v - abs(v) * u) / length]

    def end(y):
        return solve_ivp(rhs, (0, drive.period), y, "DOP853", rtol=1e-10, atol=1e-12).y[:, -1]

    start = np.array([r.modal[0, 0], r.modal_rate[0, 0], r.force[0] / limit])
    assert end(start) == pytest.approx(start, abs=2e-5)
    columns = np.stack([(end(start + d) - end(start - d)) / 2e-4 for d in 1e-4 * np.eye(3)], axis=1)
    unit = np.array([1.0, 1.2, 1 / length])  # rates over the angle, the stretch u length
    found = find_motion_monodromy(p, modes, 4096) * unit[:, None] / unit
    assert found == pytest.approx(columns, abs=2e-5)


# ---- backbone


def test_exact_the_jacobian_of_the_free_balance():
    """Against central differences, with a law of the rate and coupled modes."""
    modes = five(np.diag(0.04 * np.arange(1, 6)) + 0.02)
    group = LawGroup(modes, [of_speed(0.4, 0.3), Spring(0.3, 0.8), bonds(0.5, 0.4)], 1024)
    equations = FreeBalance(HarmonicBalance(modes, group.rows, group), 1, 3, 2.0)
    x = np.append(np.random.default_rng(4).normal(size=7) * 0.5, [1.1, 0.07])
    found = np.stack(
        [
            (equations.evaluate(x + d, 0.6).residual - equations.evaluate(x - d, 0.6).residual)
            / 2e-6
            for d in 1e-6 * np.eye(9)
        ],
        axis=1,
    )
    assert equations.evaluate(x, 0.6).jacobian == pytest.approx(found, abs=1e-7)


def test_exact_the_free_motion_balances_every_mode():
    """Coupled damping: the modal equations with the balancing negative damping, harmonic by harmonic."""
    modes = five(np.diag(0.04 * np.arange(1, 6)) + 0.02)
    group = LawGroup(modes, Jenkins(*many(20)), 512)
    omega, shape = modes.compute_stuck_mode(group.rows, group.stiffness(), 1)
    for free in trace_free_motions(
        FreeBalance(HarmonicBalance(modes, group.rows, group), 1, 5, omega),
        [0.05, 0.3],
        omega,
        shape,
    ):
        for k in range(6):
            a = np.diag(modes.omega**2 - (k * free.omega) ** 2) + 1j * k * free.omega * (
                modes.damping_matrix - 2 * free.zeta * free.omega * np.eye(5)
            )
            rest = a @ free.modal[k] + modes.slide * free.forces[0, k] / modes.mass
            assert np.abs(rest).max() < 1e-9 * free.amplitude
        assert free.modal[1, 1] == free.amplitude and free.slides[0] == pytest.approx(
            free.modal @ modes.slide
        )


def test_exact_backbone_of_the_undamped_duffing_oscillator():
    """Period 4 K(m)/sqrt(1 + c a^2), m = c a^2/(2 (1 + c a^2)); a is the peak, the amplitudes are of one harmonic."""
    found = find_backbone(sdof(0.0), Spring(0.0, 0.5), np.array([0.3, 1.0, 2.0]), harmonics=15)
    for a, f, z in zip(found.slide, found.frequency, found.damping):
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
        ('law = "nonlocal"\nstatic = 0.3\nbond_length = "2 um"', bonds(30.0, 2e-6)),
    ],
    ids=["elastic-plastic", "bonds"],
)
def test_exact_backbone_is_that_of_the_loops_of_a_bench(text, law):
    """A scene's bench measures stiffness and area of the loop; with one harmonic they are the backbone's."""
    omega = W
    amplitudes = np.array([4.0])
    found = find_backbone(RIG, law, amplitudes * 1e-6, harmonics=1)
    for k, amplitude in enumerate(amplitudes):
        result = run(plan(BENCH.format(law=text, amplitude=amplitude)))
        stiffness = result.measures["equivalent_stiffness"].value
        area = result.measures["loop_area"].value
        w = np.sqrt(omega**2 + stiffness / MASS)
        assert 2 * np.pi * found.frequency[k] == pytest.approx(w, rel=2e-4)
        loss = area / (2 * np.pi * MASS * w * w * (amplitude * 1e-6) ** 2)
        assert found.damping[k] == pytest.approx(0.003 * omega / w + loss, rel=3e-4)
        assert found.loss[k] == pytest.approx(area, rel=3e-4)


def test_exact_backbone_ends_at_the_held_and_the_free_modes():
    """Five modes: at small amplitude those of the held contact, at large ones the free ones; the ring-down of a march
    between them loses what the backbone says."""
    modes, (k, w) = five(), many(50)
    found = find_backbone(modes, Jenkins(k, w), np.array([1e-3, 0.2, 1.0, 300.0]), harmonics=9)
    held = np.sqrt(
        np.linalg.eigvalsh(
            np.diag(modes.omega**2) + np.outer(modes.slide, modes.slide) * k.sum() / 2
        )[0]
    )
    assert 2 * np.pi * found.frequency[[0, -1]] == pytest.approx([held, 1.0], rel=2e-3)
    assert found.damping.argmax() in (1, 2) and found.loss[0] == pytest.approx(0.0, abs=1e-12)


def test_order_of_the_loss_of_an_iwan_joint():
    """Limit slides spread like w^chi: the loss in microslip goes like A^(3 + chi) (Segalman 2005), 4000 elements."""
    chi = -0.4
    w = ((np.arange(4000) + 0.5) / 4000) ** (1 / (1 + chi))
    found = find_backbone(
        sdof(0.0), Jenkins(np.full(4000, 1e-6), w), np.array([0.1, 0.2, 0.4]), harmonics=1
    )
    slope = np.diff(np.log(found.loss)) / np.log(2)
    assert slope == pytest.approx([3 + chi] * 2, abs=0.01)
    assert np.diff(np.log(found.damping)) / np.log(2) == pytest.approx([1 + chi] * 2, abs=0.01)


def test_exact_backbone_is_where_the_response_is_in_quadrature():
    """With one harmonic the forced motion 90 degrees behind, at the balancing level, is the free one."""
    law = Jenkins([0.2], [0.5])
    modes = sdof(0.01)
    free = find_backbone(modes, law, np.array([2.0]), harmonics=1)
    omega = 2 * np.pi * free.frequency[0]
    level = 2 * free.damping[0] * omega**2 * 2.0
    forced = find_point(modes, SineDrive(level, omega), law, harmonics=1)
    assert np.abs(forced.coefficients[0, 1]) == pytest.approx(2.0, rel=1e-6)
    assert np.angle(forced.coefficients[0, 1] / (-1j)) == pytest.approx(np.pi / 2, abs=1e-6)


def test_refuses_amplitudes_that_fall():
    with pytest.raises(PatchfemError, match="in rising order"):
        find_backbone(RIG, Spring(1.0), np.array([2.0, 1.0]))
    with pytest.raises(PatchfemError, match="mode 3"):
        find_backbone(RIG, Spring(1.0), np.array([2.0]), mode=3)
    assert evaluate_series(np.array([1.0, 1.0 + 0j]), 4) == pytest.approx([2, 1, 0, 1])
