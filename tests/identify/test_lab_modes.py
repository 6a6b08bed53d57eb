"""Modes from records: closed-form responses give back their numbers, a window its bias, friction its sentence."""

import numpy as np
import pytest
from lab_modes import OMEGA, RESIDUE, SAMPLES, STEP, TIME, ZETA, driven_response, free_decay

from patchfem.core import PatchfemError
from patchfem.identify import identify_decay_modes, identify_driven_modes
from patchfem.identify.decay import fit_decay
from patchfem.identify.driven_modes import fit_driven_modes
from patchfem.identify.frequency_response import estimate_response, find_time_step

HERTZ = OMEGA / (2 * np.pi)


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_exact_a_record_gives_its_modes_back_where_the_windowed_estimate_does_not(quantity):
    """Segments of 0.26 s blur the 143 Hz peak, 1.1 Hz wide; the record itself has no window."""
    force, response = driven_response(quantity)
    estimate = estimate_response(STEP, force, response)
    found = fit_driven_modes(STEP, force, response, quantity, estimate)
    np.testing.assert_allclose(found.frequency, HERTZ, rtol=1e-9)
    np.testing.assert_allclose(found.damping, ZETA, rtol=1e-7)
    np.testing.assert_allclose(found.residue, RESIDUE, rtol=1e-7)
    assert estimate.segments == 15 and estimate.window == "hann" and found.misfit < 1e-8
    assert found.estimate_damping[0] > 1.5 * ZETA[0]
    assert 0.2 < found.coherence[0] < found.coherence[1] < 1


def test_exact_a_blow_that_rings_out_within_the_record_needs_no_window():
    """A bell-shaped blow and modes that lose e^-9 and more: one segment, whose H1 is H wherever the blow has power."""
    lines = 2j * np.pi * np.fft.rfftfreq(SAMPLES, STEP)
    force = 50 * np.exp(-(((TIME - 0.4) / 1e-3) ** 2))
    H = sum(a / (w * w + lines**2 + 0.04 * w * lines) for w, a in zip(OMEGA, RESIDUE))
    response = np.fft.irfft(lines**2 * H * np.fft.rfft(force), SAMPLES)
    found = estimate_response(STEP, force, response)
    assert found.window == "none" and found.segments == 1 and found.coherence is None
    truth = (lines**2 * H)[np.searchsorted(lines.imag / (2 * np.pi), found.frequency - 1e-6)]
    np.testing.assert_allclose(found.value, truth, rtol=1e-8)
    modes = fit_driven_modes(STEP, force, response, "acceleration", found)
    np.testing.assert_allclose(modes.damping, 0.02, rtol=1e-7)
    np.testing.assert_allclose(modes.estimate_damping, 0.02, rtol=1e-6)
    listed = identify_driven_modes(
        {"time": TIME, "force": force, "acceleration": response}, None, None, (0, np.inf)
    )
    assert not listed.notes and listed.mass == pytest.approx(1 / 1.2, rel=1e-7)


def test_order_coherence_is_the_share_of_the_response_that_follows_the_input():
    """White noise of variance r beside a unit response: 1/(1 + r), within the scatter of 127 segments."""
    rng = np.random.default_rng(2)
    force = rng.normal(size=2**15)
    for r in (0.25, 1.0):
        found = estimate_response(
            STEP, force, force + np.sqrt(r) * rng.normal(size=force.size), 512, "hann"
        )
        assert np.mean(found.coherence) == pytest.approx(1 / (1 + r), abs=0.02)
        assert abs(np.mean(found.value) - 1) < 0.02


def test_always_noise_leaves_the_damping_within_its_error():
    force, response = driven_response("acceleration")
    noisy = response + 0.1 * np.std(response) * np.random.default_rng(3).normal(size=SAMPLES)
    found = fit_driven_modes(
        STEP, force, noisy, "acceleration", estimate_response(STEP, force, noisy)
    )
    assert found.frequency.size == 2 and found.misfit == pytest.approx(0.1, rel=0.05)
    assert (np.abs(found.damping - ZETA) < 1.5 * found.damping_error).all()  # 1.5 of 95 %: 3 sigma
    np.testing.assert_allclose(found.damping, ZETA, rtol=0.02)


@pytest.mark.parametrize("amplitudes", [(0.3, 0.2), (0.3, 0.0)])
def test_exact_a_free_decay_gives_frequency_damping_and_decrement(amplitudes):
    found = fit_decay(*free_decay(amplitudes))
    n = int(np.count_nonzero(amplitudes))
    np.testing.assert_allclose(found.frequency, HERTZ[:n], rtol=1e-10)
    np.testing.assert_allclose(found.damping, ZETA[:n], rtol=1e-8)
    np.testing.assert_allclose(found.amplitude, amplitudes[:n], rtol=1e-8)
    np.testing.assert_allclose(
        found.decrement(), 2 * np.pi * ZETA[:n] / np.sqrt(1 - ZETA[:n] ** 2), rtol=1e-8
    )


def test_always_a_noisy_decay_lies_within_its_error():
    time, value = free_decay()
    rng = np.random.default_rng(4)
    for _ in range(2):
        found = fit_decay(time, value + 0.01 * rng.normal(size=time.size))
        assert (np.abs(found.damping - ZETA) < 1.6 * found.damping_error).all()


def test_always_a_decay_by_dry_friction_is_said_not_to_be_exponential():
    """Coulomb friction takes the same from every cycle: a straight line, then rest."""
    time = TIME[:2000]
    value = np.maximum(1 - time / 0.6, 0) * np.cos(OMEGA[0] * time)
    found = identify_decay_modes({"time": time, "displacement": value}, 0.0)
    assert any("exponential, as with friction damping" in note for note in found.notes)
    # one mode, not the several that would make the line
    assert found.frequency == pytest.approx(HERTZ[:1], rel=1e-3)
    clean = identify_decay_modes(dict(zip(("time", "displacement"), free_decay())), 0.0)
    assert len(clean.notes) == 1 and "logarithmic decrement" in clean.descriptions[0]


def test_exact_modal_mass_and_shares_of_a_force_at_its_own_place():
    force, response = driven_response("acceleration")
    found = identify_driven_modes(
        {"time": TIME, "force": force, "acceleration": response}, None, None, (0, np.inf)
    )
    assert found.mass == pytest.approx(1 / 1.2, rel=1e-6)
    np.testing.assert_allclose(found.rows["output"], [1, np.sqrt(0.5)], rtol=1e-6)
    assert "widen the peak at 143 Hz" in found.notes[0]
    assert "0.004, and the value from the whole" in found.notes[0]


def test_exact_base_motion_determines_participations_but_no_mass():
    """Absolute acceleration of a block that holds 0.9 of its mass in two modes: A = -base * output each."""
    base, relative = driven_response("acceleration")
    found = identify_driven_modes(
        {"time": TIME, "base_acceleration": base, "acceleration": base - relative / 2},
        None,
        None,
        (0, np.inf),
    )
    np.testing.assert_allclose(found.rows["base"] ** 2, RESIDUE / 2, rtol=1e-6)
    np.testing.assert_allclose(found.rows["output"] * found.rows["base"], RESIDUE / 2, rtol=1e-6)
    assert found.mass is None and "gives no modal mass" in found.notes[-1]
    found = identify_driven_modes(
        {"time": TIME, "base_acceleration": base, "acceleration": base - relative},
        None,
        None,
        (0, np.inf),
    )
    # more is not possible, the output grows
    assert np.sum(found.rows["base"] ** 2) == pytest.approx(1, rel=1e-9)
    np.testing.assert_allclose(found.rows["output"] * found.rows["base"], RESIDUE, rtol=1e-6)


def test_refuses_records_by_name():
    force, response = driven_response("acceleration")
    with pytest.raises(PatchfemError, match="moves against the force"):
        identify_driven_modes(
            {"time": TIME, "force": -force, "acceleration": response}, None, None, (0, np.inf)
        )
    with pytest.raises(
        PatchfemError,
        match=r"one input \(force or base_acceleration\), but the record has time, acc",
    ):
        identify_driven_modes({"time": TIME, "acceleration": response}, None, None, (0, np.inf))
    with pytest.raises(PatchfemError, match="between 300 and 400 Hz"):
        identify_driven_modes(
            {"time": TIME, "force": force, "acceleration": response}, None, None, (300, 400)
        )
    with pytest.raises(PatchfemError, match="one response is needed"):
        identify_decay_modes({"time": TIME, "force": force})
    with pytest.raises(PatchfemError, match="the input is zero"):
        estimate_response(STEP, 0 * force, response)
    with pytest.raises(PatchfemError, match="a segment has 10 samples"):
        estimate_response(STEP, force, response, 10)
    with pytest.raises(PatchfemError, match="evenly sampled"):
        find_time_step(TIME**1.01)
    with pytest.raises(PatchfemError, match="grows instead of decaying"):
        fit_decay(TIME[:500], np.exp(3 * TIME[:500]) * np.cos(OMEGA[0] * TIME[:500]))
    with pytest.raises(PatchfemError, match="no decaying oscillation"):
        fit_decay(TIME[:500], np.ones(500))
