"""The friction loop of a window: range, stiffness, damping and drift, from uniform and non-uniform samples."""

from math import acos, pi, sin

import friction_forms
import numpy as np
import problems
import pytest
from scene_texts import COULOMB, DRIVE, MODE, POINT

from patchfem import run
from patchfem.measures import compute_step_harmonic, loops
from patchfem.measures.measures import compute_harmonic

OMEGA = 2 * pi * 143
PERIOD = 2 * pi / OMEGA
BLOCK = (
    POINT
    + COULOMB
    + "{more}\n"
    + MODE
    + DRIVE.replace('"5 g"', '"{drive}"').replace("30", "{cycles}")
)


def evenly(count, steps):
    """(time, drive phase) of `count` whole cycles with both ends."""
    phase = 2 * pi * np.arange(count * steps + 1) / steps
    return phase / OMEGA, phase


def fourier_coefficients(time, slide, force):
    """Return the first Fourier coefficients of slide and force by the trapezoidal rule."""
    weight = np.full(time.size, 1.0)
    weight[[0, -1]] = 0.5
    return compute_harmonic(time, weight, slide - slide.mean(), OMEGA), compute_harmonic(
        time, weight, force, OMEGA
    )


def simulate_jenkins_loop(amplitude, length, steps):
    """Return time, slide, rate and force of the second of two cycles of a Jenkins element."""
    time, phase = evenly(2, steps)
    slide = amplitude * np.sin(phase)
    force = np.zeros(phase.size)
    stretch = 0.0
    for k in range(1, phase.size):
        stretch = min(max(stretch + slide[k] - slide[k - 1], -length), length)
        force[k] = stretch / length
    late = slice(steps, None)
    return time[late], slide[late], OMEGA * amplitude * np.cos(phase[late]), force[late]


@pytest.mark.parametrize("amplitude, length", [(3.0, 1.0), (1.0, 2.0)])
def test_exact_jenkins_loop_agrees_with_closed_form(amplitude, length):
    """Area, secant and equivalent stiffness of a bilinear loop agree with the closed form (Caughey 1960) within 1e-6."""
    t, q, v, f = simulate_jenkins_loop(amplitude, length, 20_000)
    work = np.sum((f[1:] + f[:-1]) / 2 * np.diff(q))
    area, _ = friction_forms.jenkins_loop(amplitude, length)
    assert work == pytest.approx(float(area), rel=1e-6, abs=1e-12)
    turns = loops.find_reversals(t, q, v, f, PERIOD)
    assert turns[:, [0, 2]] == pytest.approx(np.array([[-amplitude, amplitude]]), rel=1e-12)
    harmonics = fourier_coefficients(t, q, f)
    found = loops.measure_sampled_loop(turns, loops.CycleLoop(*harmonics, work), 0.5)
    assert found["secant_stiffness"] == pytest.approx(1 / max(amplitude, length), rel=1e-9)
    turn = acos(1 - 2 * length / amplitude) if amplitude > length else pi
    stiffness = (turn - sin(2 * turn) / 2) / (pi * length)
    assert found["loop_area"] == work
    assert found["equivalent_stiffness"] == pytest.approx(stiffness, rel=1e-6)
    assert found["equivalent_damping"] == pytest.approx(
        float(area) / (2 * pi * 0.5 * amplitude**2), rel=1e-6, abs=1e-12
    )


def sample_slide_densely(done, begin: float, samples: int = 20_000) -> np.ndarray:
    """Return the slide (k,) [m] at the middles of equal parts of one cycle, at step tolerance 1e-12."""
    model = done.plan.model
    rig = done.plan.model.rig
    times = (begin + (np.arange(samples) + 0.5) / samples) * PERIOD
    law = problems.make_coulomb(*model.rig.friction.interfaces[0].friction_limits(model.point.load))
    motion = problems.run_motion(rig.modes, rig.drive.signal, [law], rig.drive.cycles, times)
    response = motion.make_response(rig.modes, rig.drive.signal)
    return response.slide[np.searchsorted(response.time, times)]


@pytest.mark.parametrize("more, drive", [("", "7 g"), ("kinetic = 0.2", "5 g")])
def test_exact_drift_and_damping_of_event_engine(more, drive):
    """Drift and equivalent damping of a run agree within their errors with 20 000 samples per cycle of the exact motion."""
    done = run(BLOCK.format(more=more, drive=drive, cycles=21))
    slides = [sample_slide_densely(done, begin) for begin in (19, 20)]
    drift = done.measures["drift_per_cycle"]
    damping = done.measures["equivalent_damping"]
    rough = 1e-8 * np.ptp(slides[0]) * 1e-3  # of the midpoint rule across stops: 1/20000^2
    assert abs(drift.value - (slides[1].mean() - slides[0].mean())) <= drift.error + rough
    wide = np.mean([np.ptp(one) / 2 for one in slides])
    truth = done.measures["loop_area"].value / (2 * pi * 0.884 * OMEGA**2 * wide**2)
    # (pi/20000)^2/2 at the top
    assert damping.value == pytest.approx(truth, rel=damping.error / truth + 2e-8)


def test_exact_first_harmonic_of_square_wave():
    """The first harmonic of a square wave with non-uniform samples is -12j/pi within 1e-14."""
    time = np.array([0.0, 0.1, 0.5, 0.8, 1.0])
    force = compute_step_harmonic(time, np.array([3.0, 3.0, -3.0, -3.0]), 2 * pi)
    assert force == pytest.approx(-12j / pi, rel=1e-14)
