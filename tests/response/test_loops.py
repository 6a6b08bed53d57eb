"""The friction loop of a window: range, stiffness, damping and drift, from uniform and non-uniform samples."""

from math import acos, pi, sin

import friction_forms
import numpy as np
import problems
import pytest
from scene_texts import COULOMB, DRIVE, MODE, POINT

from patchfem import run
from patchfem.response import compute_harmonic, loops

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


def unevenly(count, steps):
    """The same with more samples in the second half of every cycle, and twins an ulp apart, as events have them."""
    time = evenly(count, steps)[0]
    extra = (time[:-1] + 0.3 * np.diff(time))[np.arange(count * steps) % steps > steps // 2]
    twins = np.nextafter(time[7::31], -np.inf)
    time = np.unique(np.concatenate([time, extra, twins]))
    return time, OMEGA * time


def fourier_coefficients(time, slide, force):
    """Return the first Fourier coefficients of slide and force by the trapezoidal rule."""
    weight = np.full(time.size, 1.0)
    weight[[0, -1]] = 0.5
    return compute_harmonic(time, weight, slide - slide.mean(), OMEGA), compute_harmonic(
        time, weight, force, OMEGA
    )


# stiffness and damping


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
    assert loops.mean_half_range(turns) == pytest.approx(amplitude, rel=1e-12)
    assert loops.secant_stiffness(turns) == pytest.approx(1 / max(amplitude, length), rel=1e-9)
    found = loops.interface_loop(
        loops.mean_half_range(turns), *fourier_coefficients(t, q, f), work, 0.5
    )
    turn = acos(1 - 2 * length / amplitude) if amplitude > length else pi
    stiffness = (turn - sin(2 * turn) / 2) / (pi * length)
    assert found["loop_area"] == work
    assert found["equivalent_stiffness"] == pytest.approx(stiffness, rel=1e-6)
    assert found["equivalent_damping"] == pytest.approx(
        float(area) / (2 * pi * 0.5 * amplitude**2), rel=1e-6, abs=1e-12
    )


def test_order_half_range_between_samples_is_four():
    """The error of the half range falls with the fourth power of the step."""
    errors = []
    for steps in (20, 40, 80):
        phase = 2 * pi * (np.arange(3 * steps + 1) + 0.35) / steps
        turns = loops.find_reversals(
            phase / OMEGA, np.sin(phase), OMEGA * np.cos(phase), phase, PERIOD
        )
        assert len(turns) == 3
        errors.append(abs(loops.mean_half_range(turns) - 1))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.1)
    assert errors[-1] < 1e-7


@pytest.mark.parametrize("rest", [0.0, 0.9])
@pytest.mark.parametrize("fall", [0.4])
def test_exact_secant_stiffness_at_force_jump(rest, fall):
    """The secant stiffness at a rest with jumps of the force depends only on the forces before and after the rest."""
    phase = 2 * pi * np.arange(3 * 400 + 1) / 400 - 1.0
    turn, part = np.divmod(phase, pi)
    way = 1 - 2 * (turn % 2)
    slide = -way * np.cos(np.clip(part * pi / (pi - rest), 0, pi))
    force = np.where(part < pi - rest, way * np.where(part < pi / 2, 1.0, 1 - fall), way * 0.123)
    turns = loops.find_reversals(phase / OMEGA, slide, np.zeros(phase.size), force, PERIOD, "jumps")
    assert loops.secant_stiffness(turns) * loops.mean_half_range(turns) == pytest.approx(
        -fall / 2, abs=1e-12
    )
    assert loops.mean_half_range(turns) == pytest.approx(
        1.0, abs=2e-4
    )  # samples alone, without rates


@pytest.mark.parametrize("early", [0.05, 0.8])
@pytest.mark.parametrize("length", [1e-4, 2.0])
def test_exact_secant_stiffness_of_unresolved_reversal(length, early):
    """The secant stiffness of a slider agrees with its limit within 1e-6, although no step resolves its elastic range."""
    phase = 2 * pi * (np.arange(3 * 100 + 1) + early) / 100
    slide = np.sin(phase)
    force = np.zeros(phase.size)
    for k in range(1, phase.size):
        force[k] = np.clip(force[k - 1] + (slide[k] - slide[k - 1]) / length, -1, 1)
    turns = loops.find_reversals(
        phase / OMEGA, slide, OMEGA * np.cos(phase), force, PERIOD, "slide"
    )
    assert loops.secant_stiffness(turns) == pytest.approx(1 / max(1.0, length), rel=1e-6)


def test_always_no_secant_without_reversals():
    """A slide without reversals has no secant stiffness."""
    time = np.linspace(0, PERIOD, 9)
    zero = np.zeros(9)
    force = np.arange(9.0)
    assert (
        loops.secant_stiffness(loops.find_reversals(time, zero, zero, force, PERIOD, "jumps"))
        is None
    )
    # both ends of the window are its turns
    up = loops.find_reversals(time, time, 1 + zero, force, PERIOD, "jumps")
    assert up[0][1].force is None and loops.secant_stiffness(up) is None
    assert loops.find_reversals(time[:5], zero[:5], zero[:5], force[:5], PERIOD) == []
    assert loops.mean_half_range([]) == 0.0


# drift


@pytest.mark.parametrize("samples", [unevenly])
@pytest.mark.parametrize("count", [2, 10])
def test_exact_mean_drift_of_nonuniform_samples(count, samples):
    """The drift per cycle agrees with the true one within 1e-9, for uniform and non-uniform samples."""
    time, phase = samples(count, 60)
    slide = 3e-6 * np.sin(phase + 0.3) + 2e-7 * phase / (2 * pi) + 1e-6
    rate = OMEGA * (3e-6 * np.cos(phase + 0.3) + 2e-7 / (2 * pi))
    assert loops.mean_drift(time, slide, rate, PERIOD) == pytest.approx(2e-7, rel=1e-9)
    assert loops.mean_drift(time, np.full(time.size, 0.3), 0 * rate, PERIOD) == 0.0


# scenes


def sample_slide_densely(done, begin: float, samples: int = 20_000) -> np.ndarray:
    """Return the slide (k,) [m] at the middles of equal parts of one cycle, at step tolerance 1e-12."""
    model = done.plan.model
    rig = done.plan.model.rig
    times = (begin + (np.arange(samples) + 0.5) / samples) * PERIOD
    law = problems.make_coulomb(*model.friction_limits(model.point.load))
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


@pytest.mark.parametrize("border, secant", [(0.05, None), (0.002, 0.0)])
def test_exact_secant_of_rate_dependent_force_is_zero(border, secant):
    """The secant stiffness of a force that depends on the rate is zero, as is the force at each reversal.

    There is no secant if the largest slide lies far from a reversal. `border` is the time from the last reversal before
    the first cycle to the beginning of this cycle, in periods.
    """
    decay = 0.02 * OMEGA
    turn = np.arctan2(-decay, OMEGA) / OMEGA  # exp(-decay t) cos(OMEGA t) is largest there
    time = turn + (border + np.linspace(-0.5, 4.0, 1801)) * PERIOD
    time = np.sort(
        np.append(
            time[time >= turn + border * PERIOD], turn + np.arange(0.5, border + 4, 0.5) * PERIOD
        )
    )
    wave = np.exp(-decay * time)
    slide = 1e-5 * wave * np.cos(OMEGA * time)
    rate = -1e-5 * wave * (decay * np.cos(OMEGA * time) + OMEGA * np.sin(OMEGA * time))
    turns = loops.find_reversals(time, slide, rate, np.tanh(rate / 1e-4), PERIOD)
    # the range is that of the cycle all the same
    assert turns[0][1].slide == pytest.approx(slide[0], rel=1e-12)
    found = loops.secant_stiffness(turns)
    assert found is None if secant is None else found == pytest.approx(secant, abs=1e-6)
