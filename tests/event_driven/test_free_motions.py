"""Free motions, limit cycles and quasi-static motions of modes with friction against closed forms and SciPy."""

import numpy as np
import pytest
from harmonic_cases import make_elements, make_five_modes
from modal_bases import make_modal_basis, make_shaken_modes
from scipy.integrate import quad, solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import ellipk

from patchfem.core import NotConverged, PatchfemError
from patchfem.event_driven import quasi_static
from patchfem.event_driven.cases import Interface, Load, UndrivenRig
from patchfem.event_driven.free_motions import (
    ROUGH,
    FreeMotions,
    FreeShooting,
    LinearMotion,
    estimate_amplitude,
    find_limit_cycles,
)
from patchfem.event_driven.laws import LAW_OF_NAME, make_law, masing, mirror_state
from patchfem.event_driven.laws.springs import make_cubic
from patchfem.event_driven.periodic import copy_state
from patchfem.event_driven.records import LawNumbers
from patchfem.friction import BondGrowth, Bonds
from patchfem.friction.laws.bouc_wen import BoucWen
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.iwan import Iwan
from patchfem.friction.laws.lugre import LuGre
from patchfem.friction.laws.tanh import TanhLaw
from patchfem.friction.protocol import SteadyLoop

STIFF = np.array([2e4, 1e4, 3e4])
YIELDS = np.array([1e-4, 2e-4, 4e-4])
ONE = make_shaken_modes([700.0], [0.002], [1.0], [1.0])


def make_rig(modes, law, load=1.0):
    """Return modes with a law on their only interface."""
    return UndrivenRig(modes, (Interface(law, Load(load), modes.interfaces[0]),), 1)


def make_coulomb(kinetic, static=None):
    """Return rigid friction under a load of 1 N."""
    return LawNumbers("coulomb", (static or kinetic, kinetic), stiffness=np.inf)


# ---- backbones


def test_exact_backbone_of_duffing_oscillator_agrees_with_closed_form():
    """The undamped Duffing oscillator has the period 4 K(m)/sqrt(1 + c a^2), m = c a^2/(2 (1 + c a^2)), within 1e-9."""
    modes = make_modal_basis(1.0, 0.0)
    rig = UndrivenRig(modes, (Interface(make_cubic(0.5), Load(1.0), modes.output),), 0)
    amplitudes = [0.3, 1.0, 2.0]
    for amplitude, motion in zip(amplitudes, FreeMotions(rig, 0).find(amplitudes)):
        c = 0.5 * amplitude**2
        frequency = np.sqrt(1 + c) / (4 * ellipk(c / (2 * (1 + c))))
        assert motion.omega / (2 * np.pi) == pytest.approx(frequency, rel=1e-9)
        assert abs(motion.zeta) < 1e-9


@pytest.mark.parametrize("is_forced", [False, True])
def test_exact_free_motion_repeats_in_an_own_integration(is_forced):
    """With coupled damping and bonds, whose force approaches its limit exponentially along the path, DOP853 leads from the
    start of a free motion back to it after a period, within 1e-8, under the negative damping or under the force at the
    output; the output has the requested half range."""
    modes = make_five_modes(np.diag(0.004 * np.arange(1, 6)) + 0.002)
    limit = 0.12
    length = 0.2
    law = LawNumbers(
        "bouc_wen", (limit, length, 1.0, 1.0), (0.0,), (1e-2,), stiffness=limit / length
    )
    rig = make_rig(modes, law)
    motions = FreeMotions(rig, 1).find([0.05, 0.3])
    if is_forced:
        motions = FreeMotions(rig, 1, is_forced=True).find([0.05, 0.3], motions)
    motion = motions[1]
    assert motion.loss > 1e-3
    damping = modes.damping_matrix - (0 if is_forced else motion.rate) * np.eye(5)
    push = modes.output * (motion.force if is_forced else 0.0) / modes.mass

    def find_rates(t, y):
        speed = y[5:10] @ modes.slide
        rates = push * np.cos(motion.omega * t) - modes.omega**2 * y[:5] - damping @ y[5:10]
        rates -= modes.slide * limit * y[10] / modes.mass
        return [*y[5:10], *rates, (speed - abs(speed) * y[10]) / length]

    start = motion.state.y[:11]
    period = 2 * np.pi / motion.omega
    run = solve_ivp(
        find_rates, (0, period), start, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True
    )
    assert run.y[:, -1] == pytest.approx(start, abs=1e-8 * np.abs(start).max())
    output = modes.output @ run.sol(np.linspace(0, period, 20001))[:5]
    assert np.ptp(output) / 2 == pytest.approx(0.3, rel=1e-6)
    harmonic = (
        2
        * np.exp(-2j * np.pi * np.arange(20000) / 20000)
        @ run.sol(np.linspace(0, period, 20001))[:5, :-1].T
        / 20000
    )
    assert motion.find_shape() == pytest.approx(harmonic, rel=1e-5)


def test_exact_backbone_of_rigid_friction_agrees_with_closed_form():
    """Frequency and damping of a block on rigid friction agree with their closed form within 1e-8. At an amplitude A, with
    h = F/k lost per half period, the gain G = (A/h + 1)/(A/h - 1) gives the net damping ratio -z by pi z/sqrt(1 - z^2) =
    ln G. A high static friction stops the block in each cycle."""
    modes = make_shaken_modes([750.0], [0.003], [1.0], [2.0])
    force = 9.0
    h = force / (0.5 * 750.0**2)
    amplitudes = h * np.array([3.0, 10.0, 200.0])
    gain = np.log((amplitudes + h) / (amplitudes - h))
    net_ratio = gain / np.hypot(np.pi, gain)
    omega = 750.0 * np.sqrt(1 - net_ratio**2)
    motions = FreeMotions(make_rig(modes, make_coulomb(force)), 0).find(2 * amplitudes)
    assert [motion.omega for motion in motions] == pytest.approx(omega, rel=1e-8)
    expected = (net_ratio + 0.003) * 750.0 / omega
    assert [motion.zeta for motion in motions] == pytest.approx(expected, rel=1e-8)
    assert not any(motion.sticks for motion in motions)
    [motion] = FreeMotions(make_rig(modes, make_coulomb(force, 4 * force)), 0).find([4 * h])
    assert motion is None or motion.sticks


def test_motions_stay_with_their_mode_near_internal_resonances():
    """Where a third of the frequency of a second mode is near the first one, motions at amplitudes that are far apart are
    those of small steps between them, and not those of the second mode, whose frequency is half or a third of its own."""
    omega = 2 * np.pi * np.array([120.0, 410.0])
    modes = make_shaken_modes(omega, [0.002, 0.003], [1.0, -0.7], [1.0, 0.4])
    law = LawNumbers("bouc_wen", (150.0, 7.5e-5, 1.5, 0.5), (0.0,), (1e-2,), stiffness=2e6)
    finder = FreeMotions(make_rig(modes, law), 0)
    amplitudes = np.geomspace(3e-5, 3e-3, 9)
    near = finder.find(np.geomspace(3e-5, 3e-3, 41))[::5]
    for far, motion in zip(finder.find(amplitudes), near):
        assert far.omega == pytest.approx(motion.omega, rel=1e-8)
        assert far.zeta == pytest.approx(motion.zeta, rel=1e-6)


def test_no_motion_is_found_without_an_output():
    """A mode that does not move the output has no motion of an amplitude there."""
    modes = make_shaken_modes([700.0], [0.002], [1.0], [0.0])
    rig = make_rig(modes, masing.from_elements(STIFF, YIELDS))
    assert FreeMotions(rig, 0).find([1e-4, 1e-3]) == [None, None]


# ---- limit cycles


def find_accelerations(modes, y, force):
    """Return the modal accelerations under a friction force [N] that opposes the slide."""
    n = modes.omega.size
    damped = modes.damping_matrix @ y[n:]
    return -(modes.omega**2) * y[:n] - damped - modes.slide * force / modes.mass


@pytest.mark.parametrize("zeta", [-0.002, -0.05, -0.3])
def test_exact_limit_cycle_of_block_agrees_with_closed_form(zeta):
    """The limit cycle of a block on rigid friction agrees with its closed form within 1e-8. Each half period loses 2 F/k
    and multiplies the amplitude by exp(pi |zeta|/sqrt(1 - zeta^2)); to first order the amplitude is 4 F/(pi |c| w)."""
    modes = make_shaken_modes([750.0], [zeta], [1.0], [2.0])
    force = 9.0
    [cycle], _ = find_limit_cycles(make_rig(modes, make_coulomb(force)), force)
    gain = np.exp(np.pi * abs(zeta) / np.sqrt(1 - zeta**2))
    shift = force / (0.5 * 750.0**2)
    assert cycle.amplitude == pytest.approx(2 * shift * (gain + 1) / (gain - 1), rel=1e-8)
    assert abs(cycle.amplitude - 2 * shift * (gain + 1) / (gain - 1)) < cycle.error
    assert not cycle.is_stable
    assert cycle.omega == pytest.approx(750.0 * np.sqrt(1 - zeta**2), rel=1e-9)
    estimate = estimate_amplitude(modes, modes.slide, force, 0)
    assert estimate == pytest.approx(cycle.amplitude, rel=(np.pi * zeta) ** 2)


def find_reversal(modes, force, half_period):
    """Return the state (2 n,) at a reversal that becomes its opposite after half a period under a constant force.

    With E = exp(A T/2) and the equilibrium e under the force, E (y - e) + e = -y.
    """
    n = modes.omega.size
    matrix = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-np.diag(modes.omega**2), -modes.damping_matrix]]
    )
    equilibrium = np.append(modes.slide * force / (modes.mass * modes.omega**2), np.zeros(n))
    flow = expm(matrix * half_period)
    return np.linalg.solve(flow + np.eye(2 * n), (flow - np.eye(2 * n)) @ equilibrium)


def test_exact_limit_cycle_of_two_modes_agrees_with_closed_form():
    """The limit cycle of two modes under rigid friction is that whose reversals after half a period have no velocity at the
    interface, within 1e-8 of its frequency, and its error contains the amplitude."""
    modes = make_shaken_modes([750.0, 2600.0], [-0.01, 0.02], [1.0, 0.7], [1.0, -0.4])
    [cycle], _ = find_limit_cycles(make_rig(modes, make_coulomb(9.0, 10.0)), 10.0)
    half_period = brentq(
        lambda time: modes.slide @ find_reversal(modes, 9.0, time)[2:],
        *(np.pi / cycle.omega * np.array([1 - 1e-4, 1 + 1e-4])),
        xtol=1e-16,
        rtol=1e-14,
    )
    assert cycle.omega == pytest.approx(np.pi / half_period, rel=1e-8)
    start = find_reversal(modes, 9.0, half_period)
    run = solve_ivp(
        lambda t, y: [*y[2:], *find_accelerations(modes, y, -9.0)],
        (0.0, half_period),
        start,
        "DOP853",
        rtol=1e-12,
        atol=1e-15,
        dense_output=True,
    )
    output = modes.output @ run.sol(np.linspace(0, half_period, 100001))[:2]
    amplitude = np.abs(output).max()
    assert cycle.amplitude == pytest.approx(amplitude, rel=1e-7)
    assert abs(cycle.amplitude - amplitude) < cycle.error + 1e-9 * amplitude
    assert not cycle.is_stable


def test_exact_elastic_plastic_elements_have_stable_and_unstable_cycle():
    """Elastic-plastic elements have a stable and an unstable limit cycle. In an integration by DOP853 amplitudes near the
    stable cycle approach it, and amplitudes near the unstable cycle leave it."""
    modes = make_shaken_modes([750.0], [-0.01], [1.0], [1.0])
    rig = make_rig(modes, masing.from_elements(STIFF, YIELDS))
    (low, high), min_amplitude = find_limit_cycles(rig, float(STIFF @ YIELDS))
    assert min_amplitude == 0.0
    assert low.is_stable and not high.is_stable and low.amplitude < high.amplitude
    assert high.error < 1e-6 * high.amplitude and low.error < 1e-6 * low.amplitude

    def find_next_maximum(amplitude: float) -> float:
        """Return the next maximum of the displacement after a slide from -amplitude to amplitude."""
        stretches = np.minimum(YIELDS, amplitude)

        def find_rates(t, y):
            elastic = (np.abs(y[2:]) < YIELDS) | (y[2:] * y[1] < 0)
            force = float(STIFF @ np.clip(y[2:], -YIELDS, YIELDS))
            return [y[1], *find_accelerations(modes, y[:2], force), *(elastic * y[1])]

        def find_speed(t, y):
            return y[1]

        find_speed.terminal = True
        state = np.array([amplitude, 0.0, *stretches])
        time = 0.0
        for direction in (1.0, -1.0):
            find_speed.direction = direction
            state[1] = -direction * 1e-12
            run = solve_ivp(
                find_rates,
                (time, time + 0.1),
                state,
                "DOP853",
                events=[find_speed],
                rtol=1e-9,
                atol=1e-13,
                max_step=1e-4,
            )
            state = run.y[:, -1].copy()
            time = run.t[-1]
        return state[0]

    # An offset from the cycle changes by only a few percent per period.
    for cycle in (low, high):
        starts = cycle.amplitude * np.array([1 + 1e-4, 1 - 1e-4])
        above, below = (find_next_maximum(start) - start for start in starts)
        assert (above < 0 < below) if cycle.is_stable else (below < 0 < above)


def test_limit_cycles_beyond_the_friction_are_refused():
    """Friction that supports no motion up to the largest amplitude is refused."""
    modes = make_shaken_modes([750.0], [-0.9], [1.0], [2.0])
    with pytest.raises(NotConverged, match="could not be followed"):
        find_limit_cycles(make_rig(modes, make_coulomb(9.0, 900.0)), 9.0)


# ---- quasi-static motions and loops


def test_exact_quasi_static_motion_of_one_mode_agrees_with_closed_form():
    """With elastic-plastic elements omega^2 = omega_0^2 + F(A)/(m A) and zeta = zeta_0 omega_0/omega + loss/(2 pi m omega^2
    A^2), within 1e-12; an amplitude without an equilibrium gives NaN."""
    rig = make_rig(ONE, masing.from_elements(STIFF, YIELDS))
    a = np.geomspace(3e-5, 3e-3, 9)
    force = (STIFF * np.minimum(a[:, None], YIELDS)).sum(axis=1)
    loss = (4 * STIFF * YIELDS * np.maximum(a[:, None] - YIELDS, 0)).sum(axis=1)
    omega = np.sqrt(700.0**2 + force / (0.5 * a))
    motions = quasi_static.find_static_motions(rig, 0, a, ONE.output)
    assert [motion.omega for motion in motions] == pytest.approx(omega, rel=1e-12)
    expected = 0.002 * 700 / omega + loss / (2 * np.pi * 0.5 * (omega * a) ** 2)
    assert [motion.zeta for motion in motions] == pytest.approx(expected, rel=1e-12)
    loops = [SteadyLoop(*motion) for motion in zip(force, loss)]
    from_loops = quasi_static.find_static_motions_from_loops(ONE, ONE.slide, 0, a, loops)
    assert [motion.omega for motion in from_loops] == pytest.approx(omega, rel=1e-12)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_exact_amplitude_without_equilibrium_gives_nan():
    """An amplitude without an equilibrium gives NaN and does not change the results at other amplitudes."""
    rig = make_rig(ONE, masing.from_elements(STIFF, YIELDS))
    a = np.geomspace(3e-5, 3e-3, 4)
    expected = quasi_static.find_static_motions(rig, 0, a, ONE.output)
    a[2] = np.inf
    motions = quasi_static.find_static_motions(rig, 0, a, ONE.output)
    assert np.isnan(motions[2].omega) and np.isnan(motions[2].zeta)
    for k in (0, 1, 3):
        assert motions[k].omega == pytest.approx(expected[k].omega, rel=1e-12)


def test_exact_two_modes_satisfy_secant_eigenproblem():
    """The quasi-static motion of two modes satisfies the eigenvalue problem with the secant stiffness within 1e-9, and
    tends to the free mode at large amplitudes."""
    modes = make_shaken_modes([700.0, 2500.0], [0.002, 0.01], [1.0, 0.6], [1.0, -0.3])
    rig = make_rig(modes, masing.from_elements(STIFF, YIELDS))
    motion, large_motion = quasi_static.find_static_motions(rig, 0, [3e-4, 3.0], modes.output)
    slide = float(modes.slide @ motion.z)
    secant = STIFF @ np.minimum(slide, YIELDS) / slide
    stiffness = np.diag(modes.omega**2) + secant / 0.5 * np.outer(modes.slide, modes.slide)
    assert stiffness @ motion.z == pytest.approx(motion.omega**2 * motion.z, rel=1e-9)
    assert modes.output @ motion.z == pytest.approx(3e-4, rel=1e-12)
    assert large_motion.omega == pytest.approx(700.0, rel=1e-4)


def test_refuses_rate_dependent_friction():
    """Friction that depends on the sliding speed has no quasi-static backbone and is refused."""
    rig = make_rig(ONE, LawNumbers("tanh", (0.3, 1e-3)), 9.0)
    with pytest.raises(PatchfemError, match="sliding speed"):
        quasi_static.find_static_motions(rig, 0, [1e-4], ONE.output)


@pytest.mark.parametrize("u", [1e-4, 2.5e-3, 8e-3])
@pytest.mark.parametrize("chi, beta", [(-0.4, 0.5), (0.0, 0.0), (-0.7, 2.0)])
def test_exact_loop_of_the_iwan_law_is_the_integral_of_first_loading(u, chi, beta):
    """Force and area of a loop of Iwan's law agree with a quadrature of its curve of first loading within 1e-9."""
    numbers = (chi, beta, 30.0, 4e-3, 1, 0.0, 4e-3, 0.0, 30.0)
    force, area = masing.find_loop(LawNumbers("masing", numbers), u)
    p = np.array(numbers)
    assert force == pytest.approx(float(masing.load_first(p, u)), rel=1e-12)
    # With x = t^5 the slope of the integrand is finite at 0.
    end = min(u, 4e-3)
    work = quad(lambda t: 5 * t**4 * float(masing.load_first(p, t**5)), 0, end**0.2, epsrel=1e-12)[
        0
    ]
    work += 30.0 * (u - end)
    assert area == pytest.approx(8 * work - 4 * force * u, rel=1e-9, abs=1e-12)


def test_exact_loop_of_bonds_agrees_with_closed_form():
    """A loop of Bouc-Wen's law with n = s = 1, whose force F obeys L F' = limit sgn(v) - F along the path, agrees with its
    closed form within 1e-9: the tip is limit tanh(u/L), the area 4 limit (u - L tanh(u/L))."""
    limit = 9.0
    length = 2e-4
    law = LawNumbers("bouc_wen", (limit, length, 1.0, 1.0), (0.0,), (1e-2,))
    for u in (2e-6, 2e-4, 2e-3):
        loop = quasi_static.find_loop(Interface(law, Load(1.0), np.ones(1)), u)
        tip = np.tanh(u / length)
        assert loop.force == pytest.approx(limit * tip, rel=1e-9)
        assert loop.area == pytest.approx(4 * limit * (u - length * tip), rel=1e-6)


def test_elements_are_those_of_the_law():
    """The elements of a law are those from which it was made, in the order of their yield displacements."""
    stiffness, yields = masing.list_elements(masing.from_elements(*make_elements(7)))
    assert stiffness == pytest.approx(make_elements(7)[0], rel=1e-12)
    assert yields == pytest.approx(make_elements(7)[1], rel=1e-12)
    rig = make_rig(ONE, masing.from_elements(STIFF, YIELDS)).with_elements(
        lambda k, x: (2 * k, x / 2)
    )
    changed, halves = masing.list_elements(rig.interfaces[0].law)
    assert changed == pytest.approx(2 * STIFF, rel=1e-12) and halves == pytest.approx(YIELDS / 2)
    assert rig.stiffness == pytest.approx([2 * STIFF.sum()])


def test_always_larger_steps_change_motions_little():
    """Motions with larger steps, from which the errors follow, are within 1e-7 of the fine ones."""
    rig = make_rig(ONE, masing.from_elements(STIFF, YIELDS))
    amplitudes = [1e-4, 1e-3]
    fine = FreeMotions(rig, 0).find(amplitudes)
    for motion, other in zip(fine, FreeMotions(rig, 0, accuracy=ROUGH).find(amplitudes, fine)):
        assert motion.omega == pytest.approx(other.omega, rel=1e-7)
        assert motion.zeta == pytest.approx(other.zeta, rel=1e-6)


# ---- symmetry


RECORDS = {
    "coulomb": Coulomb(0.3, 0.4),
    "tanh": TanhLaw(0.3, 5.0),
    "elastic-plastic": ElasticPlastic(0.3, 0.01),
    "iwan": Iwan(0.3, 40.0, -0.4, 0.5),
    "bouc-wen": BoucWen(0.3, 0.01, 1.5, 0.7),
    "lugre": LuGre(0.3, 0.2, 30.0, 4.0, 0.01, 0.02),
    "nonlocal": Bonds(0.3, 0.01, growth=BondGrowth(1.0, 0.01, 1e-3)),
}


@pytest.mark.parametrize("name", LAW_OF_NAME)
def test_always_motion_of_opposite_sign_follows_from_the_first_one(name):
    """A contact at rest that is started to the other side has the opposite motion, so that half a period determines a free
    motion; its states and memory are those that are given the opposite sign."""
    law = make_law(name, RECORDS[name], 3e4)
    shooting = FreeShooting(
        FreeMotions(make_rig(ONE, law), 0), LinearMotion(900.0, np.ones(1), 0.1), 0.05
    )

    def mirror(state):
        state = copy_state(state)
        mirror_state(state, 1, [law])
        return state

    # `advance` gives the end of each half period the opposite sign.
    start = shooting.state
    other = copy_state(start)
    other.y[:2] *= -1
    opposite, same = shooting.advance(start), mirror(shooting.advance(other))
    for _ in range(3):
        known = slice(shooting.extra[0])
        assert opposite.y[known] == pytest.approx(same.y[known], rel=1e-9)
        assert np.abs(same.y[:2]).min() > 0
        for one in (opposite, same):
            one.y[shooting.extra] = start.y[
                shooting.extra
            ]  # frequency and rate, which follow the phase
        opposite, same = shooting.advance(opposite), shooting.advance(same)
