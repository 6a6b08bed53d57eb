"""What the last cycles show, against the same series sampled at Gauss points, closed forms and
fits to samples."""

import numpy as np
import pytest
from modal_bases import basis_of

from patchfem.compiled.no_jit import load_uncompiled
from patchfem.core import SineDrive
from patchfem.dynamics import InterfaceMeasure, RunMeasure, make_elements
from patchfem.dynamics.events import histories
from patchfem.response import (
    find_reversals,
    mean_half_range,
    measure_ringing_in_sticks,
    secant_stiffness,
)

read = load_uncompiled("patchfem.dynamics.events.read_kernels")
PLACE, WEIGHT = np.polynomial.legendre.leggauss(16)


def basis(omega, zeta, mass=1.0):
    return basis_of(omega, zeta, mass=mass)


def several() -> tuple:
    """(ModalBasis, groups) of three modes behind two interfaces."""
    faces = np.array([[1.0, -0.8, 0.5], [0.4, 0.9, -0.6]])
    modes = basis_of([1.0, 2.3, 3.1], 0.05, faces, [0.8, 0.3, -0.5], [1.0, -0.6, 0.3], mass=1.3)
    return modes, [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2]), make_elements([2.0], [0.15])]


def run_of(modes, drive, groups, cycles=24, window=5) -> tuple:
    """(the run, its rows in the window, what it shows)."""
    run = histories.start_event_run(modes, drive, groups, cycles, window)
    kept = []
    ended = run._append_end_row
    run._append_end_row = lambda late: kept.append(ended(late)) or kept[-1]
    done = run.run(0, None)
    return run, kept[0][:-1], done


@pytest.mark.parametrize("omega", [1.01, 1.0105, 1.0107, 1.0109])
def test_exact_secant_stiffness_where_the_slide_turns_at_the_border_of_a_cycle(omega):
    """Near resonance the largest slide is reached within a thousandth of a period of the border."""
    drive = SineDrive(1.5, omega)
    _, _, done = run_of(basis(1.0, 0.05), drive, [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])])
    ends = done.window
    phase = ends.time[np.argmax(ends.slide[:-1])] / drive.period
    assert abs(phase - round(phase)) < 2e-3
    turns = find_reversals(
        ends.time, ends.slide, ends.slide_rate, ends.force, drive.period, "slide"
    )
    assert done.reading.interface_value(InterfaceMeasure.SECANT, 0) == pytest.approx(
        secant_stiffness(turns), rel=1e-9
    )


@pytest.mark.parametrize("drive", [SineDrive(1.5, 1.3), SineDrive(1.5, 0.4)])
@pytest.mark.parametrize("many", [False, True])
def test_exact_reading_is_the_sum_over_samples_of_the_series(drive, many):
    """Integrals, harmonics, drift and ranges off `dense_kernels.evaluate_rows` at 16 Gauss
    points of every piece."""
    modes, groups = (
        several() if many else (basis(1.0, 0.05), [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])])
    )
    run, rows, done = run_of(modes, drive, groups)
    n = modes.omega.size
    half = rows[:, 1:2] / 2
    owner = np.repeat(np.arange(len(rows)), PLACE.size)
    tau = (half * (1 + PLACE)).ravel()
    weight = (half * WEIGHT).ravel()
    out = run.evaluate_rows(rows, owner, tau)
    time = rows[owner, 0] + tau
    ends = done.window
    friction_force = run._response_from_columns(out, time).acceleration
    span = weight.sum()
    x = done.reading
    assert x.span == pytest.approx(span, rel=1e-13) and x.period == drive.period
    turn = np.exp(-1j * drive.omega * time) * weight
    size = np.abs(friction_force).max()
    for harmonic, wave in zip((1, 3), x.acceleration_harmonics):
        wanted = (
            2
            / span
            * abs(np.sum(weight * friction_force * np.exp(-1j * harmonic * drive.omega * time)))
        )
        assert wave == pytest.approx(wanted, rel=1e-11, abs=1e-13 * size)
    # samples miss the peak
    assert x.acceleration == pytest.approx(np.abs(ends.acceleration).max(), rel=1e-4)
    assert x.acceleration >= np.abs(ends.acceleration).max() * (1 - 1e-13)
    assert x.output_amplitude == pytest.approx(np.ptp(ends.output) / 2, rel=1e-12)
    for f, one in enumerate(done.loops):
        slide, rate, force = (out[:, 2 * n + 1 + 6 * f + k] for k in range(3))
        q, pull = (2 / span * np.sum(turn * part) for part in (slide, force))
        assert abs(one.force_harmonic / one.displacement_harmonic - pull / q) <= 1e-11 * abs(
            pull / q
        )
        assert abs(one.displacement_harmonic) == pytest.approx(abs(q), rel=1e-11)
        assert one.work == pytest.approx(np.sum(weight * force * rate), rel=1e-10)
        assert x.interface_value(InterfaceMeasure.END_WORK, f) == pytest.approx(one.work, rel=1e-10)
        assert x.interface_value(InterfaceMeasure.PATH_WORK, f) == pytest.approx(
            np.sum(weight * np.abs(force * rate)), rel=0.05
        )
        places, forces = (
            ends.extra[name][:, f] if many else getattr(ends, one_name)
            for name, one_name in (("slides", "slide"), ("forces", "force"))
        )
        rates = ends.extra["slide_rates"][:, f] if many else ends.slide_rate
        assert (
            x.interface_value(InterfaceMeasure.MIN_SLIDE, f),
            x.interface_value(InterfaceMeasure.MAX_SLIDE, f),
        ) == pytest.approx((places.min(), places.max()), rel=1e-12)
        assert one.max_force == pytest.approx(np.abs(forces).max(), rel=1e-12)
        turns = find_reversals(ends.time, places, rates, forces, drive.period, "slide")
        assert x.interface_value(InterfaceMeasure.MEAN_RANGE, f) / 2 == pytest.approx(
            mean_half_range(turns), rel=1e-9
        )
        assert x.interface_value(InterfaceMeasure.SECANT, f) == pytest.approx(
            secant_stiffness(turns), rel=1e-9
        )
    slide = out[:, 2 * n + 1]
    end = rows[-1, 0] + rows[-1, 1]
    means = [
        np.sum((weight * slide)[part])
        for part in (time < rows[0, 0] + drive.period, time > end - drive.period)
    ]
    assert x.drift == pytest.approx((means[1] - means[0]) / drive.period / 4, rel=1e-9, abs=1e-14)


def test_exact_releases_are_those_of_the_log():
    """Mean phase modulo pi of the releases of the first interface within the window."""
    modes = basis(1.0, 0.05)
    groups = [make_elements([0.5, 1.0, 0.4], [0.1, 0.4, 0.2])]
    _, rows, done = run_of(modes, SineDrive(1.5, 1.3), groups)
    late = (done.log.time > rows[0, 0]) & (np.abs(done.log.kind) == 1)
    assert late.sum() == done.reading.run[RunMeasure.N_RELEASES] > 4
    wanted = np.angle(np.mean(np.exp(2j * done.log.phase[late]))) / 2 % np.pi
    assert done.reading.start == pytest.approx(wanted, abs=1e-12)


def test_exact_a_run_in_brief_shows_what_the_run_shows():
    """One that has not settled to the last bit; one that repeats, of which few cycles are read,
    to round-off."""
    for modes, groups in (several(), (basis(1.0, 0.05), [make_elements([1.0], [0.3])])):
        for cycles, same in ((24, 0.0), (400, 1e-12)):
            drive = SineDrive(1.5, 1.3)
            whole = histories.simulate(modes, drive, groups, cycles, 5)
            # in the arrays of the first
            one, two = histories.simulate_batch([(modes, drive, groups, None)] * 2, cycles, 5)
            assert whole.repeats == one.repeats == (cycles == 400)
            np.testing.assert_array_equal(one.amplitudes, whole.amplitudes)
            np.testing.assert_array_equal(two.amplitudes, whole.amplitudes)
            np.testing.assert_array_equal(two.reading.faces, one.reading.faces)
            share = one.reading.span / whole.reading.span
            for name in ("output_amplitude", "acceleration", "start"):
                assert getattr(one.reading, name) == pytest.approx(
                    getattr(whole.reading, name), rel=same
                )
            for a, b in zip(one.loops, whole.loops):
                assert a.work / share == pytest.approx(
                    b.work, rel=same
                ) and a.max_force == pytest.approx(b.max_force, rel=same)
                assert abs(
                    a.force_harmonic / a.displacement_harmonic
                    - b.force_harmonic / b.displacement_harmonic
                ) <= max(same, 1e-15) * abs(b.force_harmonic / b.displacement_harmonic)
            assert one.ledger["friction"] == pytest.approx(whole.ledger["friction"], rel=1e-14)


def test_exact_ring_of_an_element_that_holds():
    """In closed form, as a fit to the samples finds it, at the frequency of mode and element
    together."""
    modes = basis(1.0, 0.02)
    drive = SineDrive(1.0, 0.31)
    done = histories.simulate(modes, drive, [make_elements([60.0], [0.02])], 20, window=4)
    amplitude, own, damping = done.ring
    assert own == pytest.approx(np.sqrt(61.0 - 0.02**2)) and damping == pytest.approx(
        0.02 / np.sqrt(61.0)
    )
    assert amplitude > 1e-5
    fitted, errors = measure_ringing_in_sticks(done.window, modes, drive, done.log)
    assert fitted["ring_frequency"] == pytest.approx(
        own / (2 * np.pi), abs=errors["ring_frequency"] + 1e-9
    )
    assert fitted["ring_damping"] == pytest.approx(damping, abs=errors["ring_damping"] + 1e-8)


def test_exact_nothing_rings_where_sticks_are_short():
    done = histories.simulate(
        basis(1.0, 0.02), SineDrive(1.0, 1.0), [make_elements([3.0], [0.1])], 20, window=4
    )
    assert done.ring[0] == 0.0
