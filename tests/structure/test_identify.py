"""Modes identified from frequency responses: exact responses to round-off, noisy responses within the noise."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.structure.modal_fit import fit_poles, identify_modes

BAND = np.arange(20.0, 400.0, 0.5)


def synthetic_responses(frequencies, zeta, shape, power=0, noise=0.0, absolute=False):
    """Return responses (q, p) of p points to a force at the first point, with noise.

    The responses are derivatives of order `power` of the receptance. The noise is relative to each
    value, or with `absolute` to the mean of a column.
    """
    omega = 2 * np.pi * BAND[:, None]
    natural_omega = 2 * np.pi * np.asarray(frequencies)
    H = (shape * shape[0]) @ (
        1 / (natural_omega**2 - omega**2 + 2j * np.asarray(zeta) * natural_omega * omega)
    )[:, :, None]
    H = H[:, :, 0] * (1j * omega) ** power
    rng = np.random.default_rng(3)
    error = noise * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    return H + error * np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) if absolute else H * (1 + error)


RIGS = {
    "apart": ([73, 143, 290], [0.01, 0.003, 0.02], 4), "rig": ([73, 129, 143], [0.005, 0.005, 0.003], 4),
    "within a bandwidth": ([142, 143, 290], [0.005, 0.005, 0.02], 6), "heavy": ([100, 200], [0.2, 0.1], 3),
    "between samples": ([100.1, 200.2], [1e-4, 1e-4], 3), "one": ([143], [0.003], 1),
}  # fmt: skip


@pytest.mark.share(0, 4, 8, 13, 17)
@pytest.mark.parametrize("power", [0, 1, 2])
@pytest.mark.parametrize("name", RIGS)
def test_exact_modes_are_recovered_from_exact_responses(name, power):
    """Frequencies, damping and residues are recovered from exact responses, without residual terms."""
    frequencies, zeta, n_points = RIGS[name]
    shape = np.random.default_rng(1).normal(size=(n_points, len(frequencies)))
    poles = fit_poles(
        2 * np.pi * BAND,
        synthetic_responses(frequencies, zeta, shape, power),
        np.full(n_points, power),
    )
    assert poles.w.size == len(frequencies)
    np.testing.assert_allclose(poles.w / (2 * np.pi), frequencies, rtol=1e-9)
    np.testing.assert_allclose(poles.zeta, zeta, rtol=1e-6)
    fit = poles.fit
    A, below, above = fit.compute_residues(poles.theta)
    np.testing.assert_allclose(A, (shape * shape[0]).T, atol=1e-6 * np.abs(shape * shape[0]).max())
    assert (
        np.abs(below).max() < 1e-6 * np.abs(A).max()
        and np.abs(above).max() < 1e-6 * np.abs(fit.data).max()
    )


@pytest.mark.share(0, 5, 11)
@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("name", RIGS)
def test_always_noise_causes_small_modal_errors(name, absolute):
    """With noise of 1 % all modes are found, with errors below 0.02 % in frequency, 5 % in damping and 7 % in residues."""
    frequencies, zeta, n_points = RIGS[name]
    shape = np.random.default_rng(1).normal(size=(n_points, len(frequencies)))
    data = synthetic_responses(frequencies, zeta, shape, 2, 0.01, absolute)
    poles = fit_poles(2 * np.pi * BAND, data, np.full(n_points, 2))
    assert poles.w.size == len(frequencies)
    np.testing.assert_allclose(poles.w / (2 * np.pi), frequencies, rtol=2e-4)
    np.testing.assert_allclose(poles.zeta, zeta, rtol=0.05)
    residues = poles.fit.compute_residues(poles.theta).modes
    expected = (shape * shape[0]).T
    assert np.all(np.abs(residues - expected) < 0.07 * np.abs(expected).max(axis=1, keepdims=True))


def test_refuses_responses_without_driven_point_or_modes():
    """Responses without the driven point, without visible modes or of mixed kinds are refused."""
    H = synthetic_responses([143], [0.003], np.ones((2, 1)))
    noise = np.random.default_rng(0).normal(size=(BAND.size, 2)) @ [1, 1j]
    for measured, message in (
        ({((2, 0), (1, 0)): (H[:, 1], 0)}, "a response at the driven point itself (1:x)"),
        ({((1, 0), (1, 0)): (noise, 0)}, "no mode is visible"),
        (
            {((1, 0), (1, 0)): (0 * noise, 0)},
            "the response at the driven point itself, 1:x, is zero",
        ),
        ({((1, 0), (1, 0)): (-H[:, 0], 0)}, "check the sign of the response"),
        ({((1, 0), (1, 0)): (H[:, 0], 0), ((2, 0), (1, 0)): (H[:, 1], 2)}, "are mixed"),
    ):
        with pytest.raises(PatchfemError) as caught:
            identify_modes(BAND, measured, [])
        assert message in str(caught.value)
    with pytest.raises(PatchfemError, match="at least 8 frequencies"):
        identify_modes(BAND[:4], {((1, 0), (1, 0)): (H[:4, 0], 0)}, [])
