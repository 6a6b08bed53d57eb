"""Segalman's four-parameter model: its numbers, its dissipation in micro-slip, and one law in every run."""

import numpy as np
import pytest
from law_runs import LOAD, bench_along, fitted, masses, rig, shrinking
from march_paths import share_one_loop
from scene_texts import COATED, DRIVE, MODE, mistakes, only
from stepped_laws import SteppedIwan

from patchfem.friction.laws.iwan import from_keys, largest, sliders
from patchfem.scene.scene import loads

LAW = 'law = "iwan"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nchi = -0.4\nbeta = 0.3\n'
FORCE, STIFFNESS, CHI, BETA = 0.31 * LOAD, 1.3e7, -0.4, 0.3


def density(force, stiffness, chi, beta):
    """(R, S, phi_max) of rho = R phi^chi + S delta(phi - phi_max)."""
    top = force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))
    r = stiffness * (chi + 1) / ((1 + beta) * top**(chi + 1))
    return r, beta * r * top**(chi + 1) / (chi + 1), top


def loading(slide, force, stiffness, chi, beta):
    """Force of a first loading to slide, int rho min(phi, u)."""
    r, s, top = density(force, stiffness, chi, beta)
    u = np.minimum(slide, top)
    return r * u**(chi + 2) / (chi + 2) + u * (r * (top**(chi + 1) - u**(chi + 1)) / (chi + 1) + s)


@pytest.mark.parametrize("chi, beta", [(-0.4, 0.3), (-0.9, 0.0), (0.0, 2.0), (-0.99, 0.01)])
def test_exact_the_four_parameters(chi, beta):
    k, most = sliders(3.0, 2e6, chi, beta)
    assert (k > 0).all() and (np.diff(most) > 0).all() and most[0] > 0
    assert k.sum() == pytest.approx(2e6, rel=1e-14) and k @ most == pytest.approx(3.0, rel=1e-14)
    assert largest(3.0, 2e6, chi, beta) == pytest.approx(density(3.0, 2e6, chi, beta)[2], rel=1e-14)
    slide = np.linspace(0.0, 1.2, 1000) * largest(3.0, 2e6, chi, beta)
    assert np.minimum.outer(slide, most) @ k == pytest.approx(loading(slide, 3.0, 2e6, chi, beta), abs=2e-6 * 3.0)


@pytest.mark.parametrize("chi", [-0.7, -0.4, 0.0])
def test_order_dissipation_of_micro_slip_is_chi_plus_three(chi):
    """A cycle of slide amplitude u loses 4 R u^(chi + 3)/((chi + 2)(chi + 3)); the force is nearly as the slide."""
    law = LAW.replace("-0.4", str(chi))
    r, _, top = density(FORCE, STIFFNESS, chi, BETA)
    forces, losses = [], []
    for share in (1e-3, 1e-2):
        u, time = share * top, np.arange(801) / 40000
        found = bench_along(law, time, u * np.sin(2 * np.pi * 100 * time))
        losses.append(found.ledger[2, -1] - found.ledger[2, 400])
        forces.append(np.abs(found.force).max())
        assert losses[-1] == pytest.approx(4 * r * u**(chi + 3) / ((chi + 2) * (chi + 3)), rel=2e-3)
    assert np.log(losses[1] / losses[0]) / np.log(forces[1] / forces[0]) == pytest.approx(chi + 3, abs=0.1)


def test_exact_a_bench_loop_is_the_density_itself():
    """A slide with open minor loops against the density by quadrature, each of its 200 000 sliders clipped."""
    time, slide = shrinking()
    found = bench_along(LAW, time, slide)
    r, s, top = density(FORCE, STIFFNESS, CHI, BETA)
    count = 200_000
    phi = top * ((np.arange(count) + 0.5) / count)**(1 / (CHI + 1))  # alike in stiffness
    weight, stretch, last, force = r * top**(CHI + 1) / (CHI + 1) / count, np.zeros(count), 0.0, [0.0]
    for dq in np.diff(slide):
        stretch, last = np.clip(stretch + dq, -phi, phi), min(max(last + dq, -top), top)
        force.append(weight * stretch.sum() + s * last)
    assert np.abs(found.force).max() == pytest.approx(FORCE, rel=1e-9)  # all slips once
    assert np.abs(found.force - force).max() <= 1e-6 * FORCE
    book = found.ledger
    assert book[0, -1] == pytest.approx(book[1, -1] + book[2, -1], rel=1e-12) and np.diff(book[2]).min() >= -1e-18
    assert not book[3].any()


def test_exact_the_compiled_bench_is_the_plain_law():
    time, slide = shrinking(60)
    found, law, one = bench_along(LAW, time, slide), from_keys(loads_of(LAW), LOAD), np.full(1, LOAD)
    law = SteppedIwan(law.stiffness, law.yield_slide)
    state = law.start(one)
    for k, dq in enumerate(np.diff(slide)):
        step = law.step(state, dq, one, one, 1.0)
        state = step.state
        assert found.force[k + 1] == pytest.approx(law.traction(state)[0], abs=1e-10)
        assert found.ledger[1, k + 1] == pytest.approx(law.stored(state)[0], abs=1e-16)
        assert found.ledger[2, k + 1] - found.ledger[2, k] == pytest.approx(step.dissipated[0], abs=1e-16)


def loads_of(law):
    return loads('[normal]\nload = "100 N"\n[friction]\n' + law + '[slide]\nkind = "sine"\namplitude = "1 um"\n'
                 'frequency = "1 Hz"\n').friction


def test_exact_a_march_settles_on_the_harmonic_balance():
    """Two engines that share nothing but the sliders, each within its own bars."""
    marched, steady = rig(LAW), rig(LAW, "accuracy.method=harmonic")
    assert marched.outcome.value == "steady"
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area"):
        a, b = marched.measures[name], steady.measures[name]
        assert abs(a.value - b.value) <= a.error + b.error + 1e-3 * abs(b.value), name
    assert marched.measures["energy_balance"].value < 1e-9
    assert marched.measures["energy_created"].value <= 1e-12 * marched.measures["energy_dissipated"].value


def test_exact_two_alike_interfaces_move_alike(monkeypatch):
    share_one_loop(monkeypatch)
    both = masses(LAW, 2)
    slides, alone = both.response.extra["slides"], masses(LAW, 1).response.slide
    assert slides[:, 0] == pytest.approx(slides[:, 1], abs=1e-12 * np.abs(slides).max())
    assert slides[:, 0] == pytest.approx(alone, abs=1e-7 * np.abs(alone).max())


def test_exact_a_fit_finds_the_numbers_of_a_loop(tmp_path):
    time, slide = shrinking(60)
    force = bench_along(LAW, time, slide).force
    found = fitted(tmp_path, LAW.replace("0.31", "0.4").replace("-0.4", "-0.6"), (time, slide, force),
                   "friction.static=0.1..0.7,friction.chi=-0.9..-0.1")
    assert found.keys.fit.values == pytest.approx([0.31, -0.4], rel=1e-5)


def test_refuses_what_the_law_cannot_do():
    scene = '[normal]\nload = "100 N"\n[friction]\n' + LAW + MODE + DRIVE
    for key in ("stiffness", "chi", "beta"):
        bare = "".join(line for line in scene.splitlines(True) if not line.startswith(f"{key} ="))
        assert f"friction.{key}: missing" in only(bare)
    assert "friction.chi" in only(scene, "friction.chi=0.1") and "friction.chi" in only(scene, "friction.chi=-1")
    assert "5e6 N/m" in only(scene, "friction.stiffness=3")
    assert "static: must be > 0" in only(scene, "friction.static=0")
    assert "laws with a kinetic coefficient are coulomb" in only(scene, "friction.kinetic=0.2")
    sliding = '[slide]\nkind = "sine"\namplitude = "1 um"\nfrequency = "1 Hz"\n'
    held = '[friction]\n' + LAW + sliding
    assert "'iwan' with [contact.shear]" in only(COATED + "[contact.shear]\n" + held)
    assert "put the shapes on the upper" in only(COATED + '[contact.tilt]\nangle = "0.01 mrad"\non = "lower"\n' + held)
    varying = '[normal]\nload = "100 N"\namplitude = "10 N"\nfrequency = "5 Hz"\n'
    assert "normal.amplitude: not supported yet with law 'iwan'" in mistakes(varying + held)[0]
    assert "'iwan' with normal.amplitude" in mistakes(varying + "[friction]\n" + LAW + MODE + DRIVE)[0]
    assert loads(scene, sets=["friction.law=coulomb"]).remarks
