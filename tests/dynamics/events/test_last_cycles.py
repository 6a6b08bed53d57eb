"""Measures of the last cycles of the event engine, against Gauss quadrature of the series, closed
forms and fits to samples."""

import numpy as np
import pytest
from modal_bases import make_modal_basis

from patchfem.core import SineDrive
from patchfem.dynamics import InterfaceMeasure, RunMeasure, make_elements
from patchfem.dynamics.events import histories
from patchfem.response import (
    find_reversals,
    mean_half_range,
    measure_ringing_in_sticks,
    secant_stiffness,
)

GAUSS_POINT, WEIGHT = np.polynomial.legendre.leggauss(16)


def make_mode(omega, zeta, mass=1.0):
    """Return the basis of a single mode."""
    return make_modal_basis(omega, zeta, mass=mass)


def make_three_modes() -> tuple:
    """Return modes and elements of three modes with two interfaces."""
    faces = np.array([[1.0, -0.8, 0.5], [0.4, 0.9, -0.6]])
    modes = make_modal_basis(
        [1.0, 2.3, 3.1], 0.05, faces, [0.8, 0.3, -0.5], [1.0, -0.6, 0.3], mass=1.3
    )
    return modes, [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2]), make_elements([2.0], [0.15])]


def run_with_rows(modes, drive, groups, cycles=24, window=5) -> tuple:
    """Return the run, its rows in the window, and its result."""
    run = histories.start_event_run(modes, drive, groups, cycles, window)
    rows = []
    append_end_row = run._append_end_row
    run._append_end_row = lambda row: rows.append(append_end_row(row)) or rows[-1]
    result = run.run(0, None)
    return run, rows[0][:-1], result


@pytest.mark.parametrize("omega", [1.0105, 1.0109])
def test_exact_secant_stiffness_with_reversal_near_end_of_cycle(omega):
    """The secant stiffness is exact within 1e-9 if the slide reverses within a thousandth of a
    period of the end of a cycle, near resonance."""
    drive = SineDrive(1.5, omega)
    _, _, result = run_with_rows(
        make_mode(1.0, 0.05), drive, [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])]
    )
    window = result.window
    phase = window.time[np.argmax(window.slide[:-1])] / drive.period
    assert abs(phase - round(phase)) < 2e-3
    reversals = find_reversals(
        window.time, window.slide, window.slide_rate, window.force, drive.period, "slide"
    )
    assert result.reading.interface_value(InterfaceMeasure.SECANT, 0) == pytest.approx(
        secant_stiffness(reversals), rel=1e-9
    )


@pytest.mark.parametrize("drive", [SineDrive(1.5, 1.3), SineDrive(1.5, 0.4)])
@pytest.mark.parametrize("several_interfaces", [False, True])
def test_exact_measures_agree_with_gauss_quadrature(drive, several_interfaces):
    """Integrals, harmonics, drift and ranges agree with quadrature at 16 Gauss points of every
    piece of the motion."""
    modes, groups = (
        make_three_modes()
        if several_interfaces
        else (make_mode(1.0, 0.05), [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])])
    )
    run, rows, result = run_with_rows(modes, drive, groups)
    n = modes.omega.size
    half_span = rows[:, 1:2] / 2
    owner = np.repeat(np.arange(len(rows)), GAUSS_POINT.size)
    tau = (half_span * (1 + GAUSS_POINT)).ravel()
    weight = (half_span * WEIGHT).ravel()
    values = run.evaluate_rows(rows, owner, tau)
    time = rows[owner, 0] + tau
    window = result.window
    acceleration = run._response_from_columns(values, time).acceleration
    span = weight.sum()
    measures = result.reading
    assert measures.span == pytest.approx(span, rel=1e-13) and measures.period == drive.period
    rotation = np.exp(-1j * drive.omega * time) * weight
    scale = np.abs(acceleration).max()
    for harmonic, wave in zip((1, 3), measures.acceleration_harmonics):
        expected = (
            2
            / span
            * abs(np.sum(weight * acceleration * np.exp(-1j * harmonic * drive.omega * time)))
        )
        assert wave == pytest.approx(expected, rel=1e-11, abs=1e-13 * scale)
    # the samples slightly underestimate the peak
    assert measures.acceleration == pytest.approx(np.abs(window.acceleration).max(), rel=1e-4)
    assert measures.acceleration >= np.abs(window.acceleration).max() * (1 - 1e-13)
    assert measures.output_amplitude == pytest.approx(np.ptp(window.output) / 2, rel=1e-12)
    for interface, loop in enumerate(result.loops):
        slide, rate, force = (values[:, 2 * n + 1 + 6 * interface + k] for k in range(3))
        slide_harmonic, force_harmonic = (
            2 / span * np.sum(rotation * part) for part in (slide, force)
        )
        assert abs(
            loop.force_harmonic / loop.displacement_harmonic - force_harmonic / slide_harmonic
        ) <= 1e-11 * abs(force_harmonic / slide_harmonic)
        assert abs(loop.displacement_harmonic) == pytest.approx(abs(slide_harmonic), rel=1e-11)
        assert loop.work == pytest.approx(np.sum(weight * force * rate), rel=1e-10)
        assert measures.interface_value(InterfaceMeasure.END_WORK, interface) == pytest.approx(
            loop.work, rel=1e-10
        )
        assert measures.interface_value(InterfaceMeasure.PATH_WORK, interface) == pytest.approx(
            np.sum(weight * np.abs(force * rate)), rel=0.05
        )
        slides, forces = (
            window.extra[name][:, interface] if several_interfaces else getattr(window, one_name)
            for name, one_name in (("slides", "slide"), ("forces", "force"))
        )
        rates = (
            window.extra["slide_rates"][:, interface] if several_interfaces else window.slide_rate
        )
        assert (
            measures.interface_value(InterfaceMeasure.MIN_SLIDE, interface),
            measures.interface_value(InterfaceMeasure.MAX_SLIDE, interface),
        ) == pytest.approx((slides.min(), slides.max()), rel=1e-12)
        assert loop.max_force == pytest.approx(np.abs(forces).max(), rel=1e-12)
        reversals = find_reversals(window.time, slides, rates, forces, drive.period, "slide")
        assert measures.interface_value(
            InterfaceMeasure.MEAN_RANGE, interface
        ) / 2 == pytest.approx(mean_half_range(reversals), rel=1e-9)
        assert measures.interface_value(InterfaceMeasure.SECANT, interface) == pytest.approx(
            secant_stiffness(reversals), rel=1e-9
        )
    slide = values[:, 2 * n + 1]
    end = rows[-1, 0] + rows[-1, 1]
    means = [
        np.sum((weight * slide)[part])
        for part in (time < rows[0, 0] + drive.period, time > end - drive.period)
    ]
    assert measures.drift == pytest.approx(
        (means[1] - means[0]) / drive.period / 4, rel=1e-9, abs=1e-14
    )


def test_exact_release_phase_agrees_with_event_log():
    """Number and mean phase modulo pi of the releases agree with the list of events in the
    window."""
    modes = make_mode(1.0, 0.05)
    groups = [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])]
    _, rows, result = run_with_rows(modes, SineDrive(1.5, 1.3), groups)
    in_window = (result.log.time > rows[0, 0]) & (np.abs(result.log.kind) == 1)
    assert in_window.sum() == result.reading.run[RunMeasure.N_RELEASES] > 4
    expected = np.angle(np.mean(np.exp(2j * result.log.phase[in_window]))) / 2 % np.pi
    assert result.reading.slip_start_phase == pytest.approx(expected, abs=1e-12)


def test_exact_ringing_of_stuck_element_agrees_with_closed_form():
    """Frequency and damping of the ringing of a stuck element agree with the closed form and with a
    fit to the samples."""
    modes = make_mode(1.0, 0.02)
    drive = SineDrive(1.0, 0.31)
    result = histories.simulate(modes, drive, [make_elements([60.0], [0.02])], 20, window=4)
    amplitude, omega, damping = result.ring
    assert omega == pytest.approx(np.sqrt(61.0 - 0.02**2)) and damping == pytest.approx(
        0.02 / np.sqrt(61.0)
    )
    assert amplitude > 1e-5
    fitted, errors = measure_ringing_in_sticks(result.window, modes, drive, result.log)
    assert fitted["ring_frequency"] == pytest.approx(
        omega / (2 * np.pi), abs=errors["ring_frequency"] + 1e-9
    )
    assert fitted["ring_damping"] == pytest.approx(damping, abs=errors["ring_damping"] + 1e-8)


def test_exact_short_sticks_have_no_ringing():
    """If the periods of stick are short, no ringing is reported."""
    result = histories.simulate(
        make_mode(1.0, 0.02), SineDrive(1.0, 1.0), [make_elements([3.0], [0.1])], 20, window=4
    )
    assert result.ring[0] == 0.0
