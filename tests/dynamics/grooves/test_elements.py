"""Laws of constant load along the flanks of grooves: their own equations by scipy, Coulomb's law as the limit, the law
itself on flat ground, books, order."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from patchfem.core import BaseSine, ModalBasis, Outcome, Start
from patchfem.dynamics.grooves.climbing import ElementsModel
from patchfem.dynamics.grooves.run import model_of
from patchfem.dynamics.march.instances import follow_path
from patchfem.dynamics.march.march import march
from patchfem.dynamics.march.models import element_model
from patchfem.friction.grooves import STEADY, Grooves, Swing
from patchfem.friction.laws.bouc_wen import BoucWen
from patchfem.friction.laws.elastic_plastic import parallel
from patchfem.friction.laws.iwan import Iwan, sliders
from patchfem.friction.laws.lugre import LuGre
from patchfem.response.measures import energy_balance

LOAD, MU = 115.65, 0.4
ONE = np.ones(1)
BASIS = ModalBasis(("axial",), np.array([2 * np.pi * 143]), np.array([0.003]), ONE, ONE, ONE, 1.194)
DRIVE = BaseSine(49.0, 2 * np.pi * 143)
GROOVES = Grooves(80e-6, 7.5e-6, 0.4)
PART = np.array([0.2, 0.5, 0.3]), np.array([0.3, 1.0, 2.1])  # of the slip force, of the length


def law_of(name, length=2e-6):
    """The law whose slip force is mu N, with the length mu N/stiffness."""
    if name == "elements":
        share, reach = PART
        return Iwan(MU * share / (length * reach), length * reach)
    if name == "bouc-wen":
        return BoucWen(MU, length, 2.0, 0.7)
    return LuGre(MU, 0.8 * MU, MU / length, 5e-3, 2e-4, 5e-4)


NAMES = ("elements", "bouc-wen", "lugre")


def model(name, grooves=GROOVES, length=2e-6, swing=STEADY):
    return ElementsModel(grooves, LOAD, MU, law_of(name, length).element(LOAD), swing)


def slid(name, grooves, slide, dt=1e-3, swing=STEADY):
    contact = model(name, grooves, swing=swing).build()
    forces, energies = np.zeros((slide.size, 3)), np.zeros((slide.size, 2))
    kind = model(name, grooves).kind
    assert follow_path(slide, dt, kind, contact, 1e-9, energies, forces) == 0
    return forces, energies


def twin(name, grooves, slide, dt, swing=STEADY):
    """Mean force and energy lost (k - 1,) of the steps of a slide: the NumPy law under the mean normal force, before
    and after half of its change, where the stretch of what stays is kept and that of what comes is none."""
    law, one = law_of(name), np.ones(1)

    def pressed(state, r0, r1):
        kept = min(1.0, r0 / r1)
        stretch, *rest = state[:-1]
        after = (kept * stretch, *rest, r1 * one)
        return after, float((law.stored((stretch, *rest, r0 * one)) - law.stored(after))[0])

    def pull(state, v):
        return float(law.traction((*state[:1], rates(state, v), v, state[-1]) if name == "lugre" else state)[0])

    def rates(state, v):
        return v - abs(v) * state[0] * law.stiffness / law.limit(abs(v))

    loads = swing.about(LOAD, dt * np.arange(slide.size))
    normal = loads[0] * np.hypot(1, float(grooves.slope(slide[0])))
    state, place, speed, forces, losses = law.start(normal * one), 0.0, 0.0, [], []
    for (q, end), (load, later) in zip(pairwise(slide), pairwise(loads)):
        dq = end - q
        inner = 0.5 * (q + end) + 0.5 * dq * np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)])
        path, t = np.array([5, 8, 5]) / 18 @ np.hypot(1, grooves.slope(inner)) * dq, float(grooves.slope(end))
        after = normal
        for _ in range(100):
            mean = 0.5 * (normal + after)
            half, first = pressed(state, normal, mean)
            step = law.step(half, path, mean * one, mean * one, dt)
            pulled, old = float(step.mean[0]), after
            held = 2 * pulled - place
            held = held if name == "lugre" else min(max(held, -MU * after), MU * after)
            after = later * np.hypot(1, t) + held * t
            if abs(after - old) < 1e-14 * LOAD:
                break
        state, last = pressed(step.state, mean, after)
        speed = dq / dt * np.hypot(1, t)
        place, normal = pull(state, speed), after
        forces.append((0.5 * (load + later) * float(grooves.rise(q, end)) + pulled * path) / dq)
        losses.append(first + float(step.dissipated[0]) + last)
    return np.array(forces), np.array(losses)


@pytest.mark.share(0, 1)
@pytest.mark.parametrize("swing", [STEADY, Swing(40.0, 2 * np.pi * 97, 0.7)])
@pytest.mark.parametrize("name", NAMES)
def test_exact_a_slow_slide_by_the_numpy_law(name, swing):
    slide = 30e-6 * np.sin(np.linspace(0, 7.3, 101))
    forces, energies = slid(name, GROOVES, slide, swing=swing)
    mean, lost = twin(name, GROOVES, slide, 1e-3, swing)
    np.testing.assert_allclose(forces[:-1, 1], mean, rtol=1e-8, atol=1e-9 * LOAD)
    np.testing.assert_allclose(energies[:-1, 0], lost, rtol=1e-7, atol=1e-11 * lost.sum())
    assert energies[:-1, 0].min() > -1e-12 * energies[:-1, 0].sum()  # no change of load gives energy
    work = forces[:-1, 1] @ np.diff(slide)
    assert work - energies[:-1, 0].sum() == pytest.approx(energies[-1, 1] - energies[0, 1], rel=1e-9)


@pytest.mark.slow  # a loop to compile for this alone
def test_exact_a_slow_slide_by_the_equation_of_bouc_and_wen():
    """phi = f/R follows the law while R falls; while R grows, R phi stays but for the slide. R = N sqrt(1 + t^2)/(1 -
    phi t); scipy integrates phi over the slide."""
    turns, steps, phi = [0.0, 27e-6, -14e-6, 9e-6], 2000, np.zeros(1)
    slide = np.concatenate([[0.0], *(np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(turns))])
    forces, seen = slid("bouc-wen", GROOVES, slide)[0], 0
    for number, (begin, end) in enumerate(pairwise(turns)):
        way = np.sign(end - begin)

        def slope(q, y, way=way):
            t, bend, z = float(GROOVES.slope(q)), float(GROOVES.bend(q)), way * y[0] / MU
            own = MU / 2e-6 * (1 - abs(z)**2 * (0.7 * np.sign(z) + 0.3)) * np.hypot(1, t)
            rise = bend * (t / (1 + t * t) + y[0] / (1 - y[0] * t)) + t / (1 - y[0] * t) * own  # of ln R over q
            return [own if rise * way <= 0 else own - y[0] * rise / (1 + t * y[0] / (1 - y[0] * t))]

        found = solve_ivp(slope, (begin, end), phi, "DOP853", rtol=1e-9, atol=1e-13, max_step=abs(end - begin) / 200,
                          dense_output=True)
        phi = found.y[:, -1]
        for k in range(number * steps + 50, (number + 1) * steps, 157):
            t, ratio = float(GROOVES.slope(slide[k])), found.sol(slide[k])[0]
            assert forces[k, 0] == pytest.approx(LOAD * (t + ratio) / (1 - ratio * t), abs=1e-5 * LOAD)
            seen += 1
    assert seen > 30


@pytest.mark.share(0)
@pytest.mark.parametrize("name", NAMES)
def test_exact_flat_grooves_are_the_law_itself(name):
    """Flanks of a slope of 1e-12 and the law of rigs without grooves."""
    alone, on = (march(BASIS, DRIVE, one, 6, 200, window=3) for one in (
        element_model(law_of(name).element(LOAD)), model(name, Grooves(80e-6, 1e-17))))
    assert on.outcome is None
    assert on.amplitudes[-1, 1] == pytest.approx(alone.amplitudes[-1, 1], rel=1e-9)
    np.testing.assert_allclose(on.response.force, alone.response.force, rtol=0, atol=1e-9 * LOAD)


@pytest.mark.share(0)
@pytest.mark.parametrize("name", ["elements", "bouc-wen"])
def test_always_a_stiff_law_is_coulombs_on_the_flank(name):
    """The amplitude goes to that of the exact stops and releases."""
    true = march(BASIS, DRIVE, model_of(GROOVES, LOAD, MU, MU, None, BASIS), 6, 100, window=3).amplitudes[-1, 1]
    far, near, last = (abs(march(BASIS, DRIVE, model(name, GROOVES, length), 6, steps, window=3).amplitudes[-1, 1]
                           - true) for length, steps in ((4e-7, 400), (1e-7, 800), (2.5e-8, 1600)))
    assert far > 1.5 * near and near > 1.5 * last and last < 0.03 * true


@pytest.mark.share(0, 1)
@pytest.mark.parametrize("lifted", [0.0, 0.5])
@pytest.mark.parametrize("name", NAMES)
def test_order_two_in_the_step_and_the_books_close(name, lifted):
    grooves, values = Grooves(80e-6, 7.5e-6, 0.3, lifted), []
    for steps in (200, 400, 800, 1600):
        done = march(BASIS, DRIVE, model(name, grooves), 3, steps, window=3)
        assert done.outcome is None and energy_balance(done.ledger) < 1e-11
        values.append(float(done.amplitudes[-1, 1]))
    changes = np.abs(np.diff(values))
    assert changes[0] / changes[2] > 6 and changes[2] < 5e-4 * abs(values[-1])


def test_exact_no_friction_to_speak_of_is_a_mass_in_a_valley():
    """A free motion about the bottom of a groove is that of the exact steps without friction."""
    start, still = Start(np.array([10e-6]), np.array([0.02])), BaseSine(0.0, DRIVE.omega)
    true = march(BASIS, still, model_of(GROOVES, LOAD, 0.0, 0.0, None, BASIS), 1, 100, start=start).response.slide
    faint = parallel([1e-10 * LOAD / 2e-6], [2e-6])
    coarse, fine = (np.abs(march(BASIS, still, ElementsModel(GROOVES, LOAD, 1e-10, faint), 1, 100 * part, start=start)
                           .response.slide[::part] - true).max() for part in (4, 8))
    assert fine < 3e-4 * np.abs(true).max() and coarse > 3.8 * fine


def test_exact_equal_sliders_are_one():
    """Iwan's cells of one length and one slider of that length: the same force at every sample."""
    slide = 20e-6 * np.sin(np.linspace(0, 7.3, 301))
    made = []
    for one in (parallel([MU * LOAD / 2e-6], [2e-6]), parallel(np.full(4, MU * LOAD / 8e-6), np.full(4, 2e-6))):
        contact, forces, energies = ElementsModel(GROOVES, LOAD, MU, one), np.zeros((301, 3)), np.zeros((301, 2))
        assert follow_path(slide, 1e-3, contact.kind, contact.build(), 1e-9, energies, forces) == 0
        made.append(forces)
    np.testing.assert_allclose(made[0], made[1], rtol=0, atol=1e-9 * LOAD)


def test_always_iwans_law_slips_at_its_limit():
    """One way along the grooves, beyond the longest slider: N (t + mu)/(1 - mu t)."""
    law = Iwan(*sliders(MU, MU / 1e-8, -0.5, 0.5))
    slide, contact = np.linspace(0, 160e-6, 8001), ElementsModel(GROOVES, LOAD, MU, law.element(LOAD))
    forces, energies = np.zeros((slide.size, 3)), np.zeros((slide.size, 2))
    assert follow_path(slide, 1e-3, contact.kind, contact.build(), 1e-9, energies, forces) == 0
    true = LOAD * GROOVES.ratio(slide, 1.0, MU)
    np.testing.assert_allclose(forces[200:-1, 0], true[200:-1], rtol=0, atol=3e-3 * true.max())


def test_always_a_lifted_mass_that_leaves_the_grooves_is_said():
    one = ElementsModel(Grooves(80e-6, 7.5e-6, 0.0, 3.0), 20.0, MU, parallel([MU * 20.0 / 1e-6], [1e-6]))
    done = march(BASIS, BaseSine(400.0, 2 * np.pi * 143), one, 5, 100)
    assert done.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in done.message
