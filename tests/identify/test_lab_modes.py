"""Modes from records: closed-form responses give the exact modes, and notes report window bias and friction."""

import numpy as np
import pytest
from lab_modes import OMEGA, RESIDUE, SAMPLES, STEP, TIME, ZETA, driven_response, free_decay

from patchfem.core import PatchfemError
from patchfem.identify import identify_decay_modes, identify_driven_modes
from patchfem.identify.decay import fit_decay
from patchfem.identify.driven_modes import fit_driven_modes
from patchfem.identify.measured_modes import find_time_step

HERTZ = OMEGA / (2 * np.pi)


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_exact_modes_from_record_without_window_bias(quantity):
    """The modes fitted to a record are exact, although segments of 0.26 s would widen the peak at 143 Hz, 1.1 Hz wide."""
    force, response = driven_response(quantity)
    modes = fit_driven_modes(STEP, force, response, quantity)
    np.testing.assert_allclose(modes.frequency, HERTZ, rtol=1e-9)
    np.testing.assert_allclose(modes.damping, ZETA, rtol=1e-7)
    np.testing.assert_allclose(modes.residue, RESIDUE, rtol=1e-7)
    assert modes.misfit < 1e-8


def test_always_noisy_damping_is_within_stated_error():
    """The damping from a record with 10 % noise is within 1.5 times its stated error."""
    force, response = driven_response("acceleration")
    noisy = response + 0.1 * np.std(response) * np.random.default_rng(3).normal(size=SAMPLES)
    modes = fit_driven_modes(STEP, force, noisy, "acceleration")
    assert modes.frequency.size == 2 and modes.misfit == pytest.approx(0.1, rel=0.05)
    assert (
        np.abs(modes.damping - ZETA) < 1.5 * modes.damping_error
    ).all()  # 1.5 times the 95 % error is about three standard deviations
    np.testing.assert_allclose(modes.damping, ZETA, rtol=0.02)


@pytest.mark.parametrize("amplitudes", [(0.3, 0.2), (0.3, 0.0)])
def test_exact_free_decay_frequency_damping_and_amplitude(amplitudes):
    """Frequency, damping and amplitude of a free decay of one or two modes are exact."""
    modes = fit_decay(*free_decay(amplitudes))
    n = int(np.count_nonzero(amplitudes))
    np.testing.assert_allclose(modes.frequency, HERTZ[:n], rtol=1e-10)
    np.testing.assert_allclose(modes.damping, ZETA[:n], rtol=1e-8)
    np.testing.assert_allclose(modes.amplitude, amplitudes[:n], rtol=1e-8)


def test_always_noisy_decay_is_within_stated_error():
    """At least 85 % of 40 damping ratios from decays with 3 % noise are within their stated 95 % errors.

    Frequencies of 110 to 290 Hz and damping ratios of .002 to .03 are random. The errors are not far too wide.
    """
    random = np.random.default_rng(4)
    ratios = []
    for _ in range(20):
        zeta = ZETA * random.uniform(0.5, 3, 2)
        time, value = free_decay(omega=OMEGA * random.uniform(0.8, 1.1, 2), zeta=zeta)
        modes = fit_decay(time, value + 0.01 * random.normal(size=time.size))
        ratios.append(np.abs(modes.damping - zeta) / modes.damping_error)
    ratios = np.array(ratios)
    assert np.mean(ratios <= 1) >= 0.85
    assert np.median(ratios) > 0.15  # 0.34 for normal errors


def test_always_friction_decay_is_reported_as_not_exponential():
    """A decay by dry friction is reported as not exponential, and is fitted by a single mode."""
    time = TIME[:2000]
    value = np.maximum(1 - time / 0.6, 0) * np.cos(OMEGA[0] * time)
    modes = identify_decay_modes({"time": time, "displacement": value}, 0.0)
    assert any("exponential, as with friction damping" in note for note in modes.notes)
    # a single mode, not several modes that approximate the straight line
    assert modes.frequency == pytest.approx(HERTZ[:1], rel=1e-3)
    exponential = identify_decay_modes(dict(zip(("time", "displacement"), free_decay())), 0.0)
    assert len(exponential.notes) == 1 and "logarithmic decrement" in exponential.descriptions[0]


def test_exact_modal_mass_from_driven_point_response():
    """A response at the driven point gives the modal mass and the output rows."""
    force, response = driven_response("acceleration")
    modes = identify_driven_modes({"time": TIME, "force": force, "acceleration": response})
    assert modes.mass == pytest.approx(1 / 1.2, rel=1e-6)
    np.testing.assert_allclose(modes.rows["output"], [1, np.sqrt(0.5)], rtol=1e-6)
    assert modes.descriptions[0].startswith("damping 0.004 +-") and not modes.notes


def test_exact_participation_from_base_motion():
    """A record of base motion gives the participation factors of the modes but no modal mass."""
    base, relative = driven_response("acceleration")
    modes = identify_driven_modes(
        {"time": TIME, "base_acceleration": base, "acceleration": base - relative / 2}
    )
    np.testing.assert_allclose(modes.rows["base"] ** 2, RESIDUE / 2, rtol=1e-6)
    np.testing.assert_allclose(modes.rows["output"] * modes.rows["base"], RESIDUE / 2, rtol=1e-6)
    assert modes.mass is None and "gives no modal mass" in modes.notes[-1]
    modes = identify_driven_modes(
        {"time": TIME, "base_acceleration": base, "acceleration": base - relative}
    )
    # the participation cannot exceed one, so the output row is larger
    assert np.sum(modes.rows["base"] ** 2) == pytest.approx(1, rel=1e-9)
    np.testing.assert_allclose(modes.rows["output"] * modes.rows["base"], RESIDUE, rtol=1e-6)


def test_refuses_invalid_records_with_reason():
    """Records with a wrong sign, without input, without modes in the band or unsuitable sampling are refused."""
    force, response = driven_response("acceleration")
    with pytest.raises(PatchfemError, match="moves against the force"):
        identify_driven_modes({"time": TIME, "force": -force, "acceleration": response})
    with pytest.raises(
        PatchfemError,
        match=r"one input \(force or base_acceleration\), but the record has time, acc",
    ):
        identify_driven_modes({"time": TIME, "acceleration": response})
    with pytest.raises(PatchfemError, match="between 300 and 400 Hz"):
        identify_driven_modes({"time": TIME, "force": force, "acceleration": response}, (300, 400))
    with pytest.raises(PatchfemError, match="one response is needed"):
        identify_decay_modes({"time": TIME, "force": force})
    with pytest.raises(PatchfemError, match="the input is zero"):
        fit_driven_modes(STEP, 0 * force, response, "acceleration")
    # the windows of all segments hide an impact at the first sample
    impact = np.where(TIME > 0, 0.0, 100.0)
    with pytest.raises(PatchfemError, match="constant after the start of the record"):
        fit_driven_modes(STEP, impact, response, "acceleration")
    with pytest.raises(PatchfemError, match="the record has 500 samples; at least 512"):
        fit_driven_modes(STEP, force[:500], response[:500], "acceleration")
    with pytest.raises(PatchfemError, match="evenly sampled"):
        find_time_step(TIME**1.01)
    with pytest.raises(PatchfemError, match="grows instead of decaying"):
        fit_decay(TIME[:500], np.exp(3 * TIME[:500]) * np.cos(OMEGA[0] * TIME[:500]))
    with pytest.raises(PatchfemError, match="no decaying oscillation"):
        fit_decay(TIME[:500], np.ones(500))


@pytest.mark.parametrize("rate, noise", [(0.0, 0.0), (0.005, 0.05)])
def test_refuses_undamped_decay_without_calling_it_growing(rate, noise):
    """A record whose damping ratio is zero within its error neither decays nor grows.

    Once an undamped oscillation was said to grow, because its damping ratio was -1e-17.
    """
    rng = np.random.default_rng(1)
    time = TIME[:500]
    record = np.exp(rate * time) * np.cos(OMEGA[0] * time) + noise * rng.normal(size=500)
    with pytest.raises(
        PatchfemError, match=r"neither decays nor grows beyond its error of [\de.-]+;"
    ):
        fit_decay(time, record)
    growing = np.exp(60 * rate * time) * record
    if rate:
        with pytest.raises(PatchfemError, match="grows instead of decaying"):
            fit_decay(time, growing)
