"""Known modes come back from their frequency responses: exact ones to round-off, noisy ones within the noise."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses
from patchfem.structure.modal_fit import fit_poles, identify_modes

BAND = np.arange(20.0, 400.0, 0.5)


def responses(f, zeta, shape, power=0, noise=0.0, absolute=False):
    """(q, p) responses of p places to a force at the first, `power` derivatives, with noise on real and imaginary."""
    w = 2 * np.pi * BAND[:, None]
    w0 = 2 * np.pi * np.asarray(f)
    H = (shape * shape[0]) @ (1 / (w0**2 - w**2 + 2j * np.asarray(zeta) * w0 * w))[:, :, None]
    H = H[:, :, 0] * (1j * w) ** power
    rng = np.random.default_rng(3)
    spoiled = noise * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape)) / np.sqrt(2)
    return H + spoiled * np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) if absolute else H * (1 + spoiled)


RIGS = {
    "apart": ([73, 143, 290], [0.01, 0.003, 0.02], 4), "rig": ([73, 129, 143], [0.005, 0.005, 0.003], 4),
    "within a bandwidth": ([142, 143, 290], [0.005, 0.005, 0.02], 6), "heavy": ([100, 200], [0.2, 0.1], 3),
    "between samples": ([100.1, 200.2], [1e-4, 1e-4], 3), "one": ([143], [0.003], 1),
}  # fmt: skip


@pytest.mark.share(0, 4, 8, 13, 17)
@pytest.mark.parametrize("power", [0, 1, 2])
@pytest.mark.parametrize("name", RIGS)
def test_exact_modes_from_exact_responses(name, power):
    f, zeta, places = RIGS[name]
    shape = np.random.default_rng(1).normal(size=(places, len(f)))
    poles = fit_poles(2 * np.pi * BAND, responses(f, zeta, shape, power), np.full(places, power))
    assert poles.w.size == len(f)
    np.testing.assert_allclose(poles.w / (2 * np.pi), f, rtol=1e-9)
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
def test_always_noise_of_one_per_cent_moves_them_little(name, absolute):
    """No mode lost, none made up; frequency 0.02 %, damping 5 %, residues 7 % of the largest."""
    f, zeta, places = RIGS[name]
    shape = np.random.default_rng(1).normal(size=(places, len(f)))
    data = responses(f, zeta, shape, 2, 0.01, absolute)
    poles = fit_poles(2 * np.pi * BAND, data, np.full(places, 2))
    assert poles.w.size == len(f)
    np.testing.assert_allclose(poles.w / (2 * np.pi), f, rtol=2e-4)
    np.testing.assert_allclose(poles.zeta, zeta, rtol=0.05)
    residues = poles.fit.compute_residues(poles.theta).modes
    want = (shape * shape[0]).T
    assert np.all(np.abs(residues - want) < 0.07 * np.abs(want).max(axis=1, keepdims=True))


def test_always_modes_outside_the_band_go_into_the_rest():
    """A mode at 5 Hz and one at 900 Hz: the two inside stay right to the curvature of the tails."""
    f = [5, 100, 200, 900]
    zeta = [0.01] * 4
    shape = np.random.default_rng(2).normal(size=(4, 4))
    data = responses(f, zeta, shape, 0, 1e-3)
    measured = {((k + 1, 0), (1, 0)): (data[:, k], 0) for k in range(4)}
    found = identify_modes(BAND, measured, [])
    inside = [np.abs(found.frequency - one).argmin() for one in (100, 200)]
    np.testing.assert_allclose(found.frequency[inside], [100, 200], rtol=1e-4)
    assert np.all((found.frequency > 20) & (found.frequency < 400))
    got = np.stack([found.motion[k + 1, 0][inside] for k in range(4)])
    signs = np.sign(shape[0, 1:3])
    np.testing.assert_allclose(got, shape[:, 1:3] * signs, atol=0.02 * np.abs(shape).max())


def test_always_a_free_rig_is_told_that_its_rigid_mode_is_missing():
    """Two free masses: of rigid mode and sqrt(2) the elastic one is found, and the rigid one named as left out."""
    rig = masses.build_basis([1.0, 1.0], [((1, 2), 4e5)], [((1, 2), 8.0)], [], 1)
    H = compute_receptance(rig, 2 * np.pi * BAND, rig.shapes, rig.shapes[0])[:, :, 0]
    notes = []
    found = identify_modes(BAND, {((k, 0), (0, 0)): (H[:, k], 0) for k in range(2)}, notes)
    np.testing.assert_allclose(2 * np.pi * found.frequency, rig.omega[1:], rtol=1e-9)
    np.testing.assert_allclose(found.motion[0, 0], np.sqrt(0.5), rtol=1e-6)
    assert len(notes) == 1 and "rigid-body modes" in notes[0]


def test_refuses_responses_without_scale_or_modes():
    H = responses([143], [0.003], np.ones((2, 1)))
    flat = np.random.default_rng(0).normal(size=(BAND.size, 2)) @ [1, 1j]
    for measured, says in (
        ({((2, 0), (1, 0)): (H[:, 1], 0)}, "a response at the driven point itself (1:x)"),
        ({((1, 0), (1, 0)): (flat, 0)}, "no mode is visible"),
        (
            {((1, 0), (1, 0)): (0 * flat, 0)},
            "the response at the driven point itself, 1:x, is zero",
        ),
        ({((1, 0), (1, 0)): (-H[:, 0], 0)}, "check the sign of the response"),
        ({((1, 0), (1, 0)): (H[:, 0], 0), ((2, 0), (1, 0)): (H[:, 1], 2)}, "are mixed"),
    ):
        with pytest.raises(PatchfemError) as caught:
            identify_modes(BAND, measured, [])
        assert says in str(caught.value)
    with pytest.raises(PatchfemError, match="at least 8 frequencies"):
        identify_modes(BAND[:4], {((1, 0), (1, 0)): (H[:4, 0], 0)}, [])
