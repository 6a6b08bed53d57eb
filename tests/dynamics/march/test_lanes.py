"""March of bonds behind shear modes in lanes, against single marches and the measures of single
runs."""

import numpy as np
import pytest
from march_paths import OMEGA
from modal_bases import make_modal_basis
from test_march_loop import half_plane_compliance

from patchfem.core import Response, SineDrive
from patchfem.dynamics import points_model
from patchfem.dynamics.march import lanes
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.response import loops, measures, spectrum
from patchfem.runs.batch.samples import Samples
from patchfem.slip.shear_modes import shear_modes

ONE = make_modal_basis(OMEGA, 0.05)
TWO = make_modal_basis(OMEGA * np.array([1.0, 0.9]), 0.05, [1.0, 0.2], np.ones(2), [1.0, -0.5])
ACCELERATIONS, CYCLES, STEPS, WINDOW = (5.0, 20.0, 49.0, 300.0), 12, 80, 3
LAW, DRIVE = Bonds(0.4, 1e-6), SineDrive(1.0, OMEGA)
LEDGER_NAMES = {
    "work_in": "work_in",
    "viscous": "viscous",
    "power": "power",
    "lost": "friction",
    "peak": "peak_stored",
    "booked": "booked",
    "sampled": "sampled",
    "passed": "passed",
    "stored": "stored",
}


def tilted_patch(points: int = 6):
    """Return area (p,), pressure (p,) and shear modes of a patch with a higher pressure at one
    end."""
    compliance, x = half_plane_compliance(points, 1e-7)
    area = np.full(points, 1 / points)
    sigma = 60.0 * (1 + 0.8 * x)
    return area, sigma, shear_modes(compliance, LAW.static * area * sigma, LAW.length, 2)


def march_both_ways(basis, cycles: int = CYCLES) -> tuple:
    """Return the lanes with one case per acceleration, and the march of each case by itself."""
    area, sigma, modes = tilted_patch()
    cases = [
        lanes.PointsCase(
            LAW.static * area * sigma, modes.shape, modes.stiffness, LAW.length, acceleration
        )
        for acceleration in ACCELERATIONS
    ]
    return lanes.march(basis, DRIVE, cases, cycles, STEPS, WINDOW), [
        march(
            basis,
            SineDrive(acceleration, OMEGA),
            points_model(LAW, area, sigma, modes),
            cycles,
            STEPS,
            WINDOW,
        )
        for acceleration in ACCELERATIONS
    ]


@pytest.fixture(scope="module")
def two_mode_marches() -> tuple:
    """Return lanes and single marches of two modes."""
    return march_both_ways(TWO)


def assert_close(found, expected, rel: float = 1e-12):
    """Assert that two arrays agree within a relative tolerance of the largest value."""
    np.testing.assert_allclose(found, expected, rtol=rel, atol=rel * np.abs(expected).max())


@pytest.mark.parametrize("basis", [ONE, TWO], ids=["one mode", "two modes"])
def test_exact_lanes_agree_with_single_marches(basis):
    """Cases that stick, slip partially and slip fully in lanes agree with single marches within
    1e-7, the slip within 1e-6; the difference is the remaining residual of Newton's method."""
    batch, marches = march_both_ways(basis)
    assert not batch.n_unsolved.any()
    for k, single in enumerate(marches):
        assert_close(batch.extremes[k], single.extremes, 1e-7)
        assert_close(batch.phasors[k], single.phasors, 1e-7)
        assert_close(batch.force[:, k], single.window.force, 1e-7)
        assert_close(batch.slip[:, k], single.window.slip, 1e-6)
        assert_close(batch.z[:, :, k], single.window.modal, 1e-7)
        assert_close(batch.friction_work[k], single.window_work, 1e-7)
        ledger = single.response.extra["ledger"][:, -1]
        assert_close(batch.energies["gone"][k], ledger[2], 1e-7)
        assert batch.energies["created"][k] <= 1e-9 * ledger[2] >= ledger[3]
        for lane_name, name in LEDGER_NAMES.items():
            assert batch.energies[lane_name][k] == pytest.approx(single.ledger[name], rel=1e-7), (
                name
            )
        imbalance = batch.energies["work_in"][k] - sum(
            batch.energies[name][k] for name in ("stored", "lost", "viscous")
        )
        assert abs(imbalance) < 1e-9 * batch.energies["power"][k]


def test_exact_batch_measures_agree_with_single_measures(two_mode_marches):
    """The measures of samples in lanes agree within 1e-9 with the measures of single runs from the
    same samples."""
    batch, marches = two_mode_marches
    samples = Samples(batch, TWO, OMEGA, np.array(ACCELERATIONS), STEPS, WINDOW)
    energies = {"peak_stored": batch.energies["peak"]} | batch.energies
    values = samples.values(energies, np.full(4, 1e5), np.full(4, 60.0))
    for k, single in enumerate(marches):
        window = single.window
        drive = SineDrive(ACCELERATIONS[k], OMEGA)
        response = Response(
            window.time,
            batch.z[:, :, k],
            batch.rate[:, :, k],
            samples.slide[:, k],
            samples.speed[:, k],
            batch.z[:, :, k] @ TWO.output,
            batch.rate[:, :, k] @ TWO.output,
            samples.acceleration()[:, k],
            window.base_acceleration,
            batch.force[:, k],
            batch.slip[:, k],
        )
        assert_close(response.acceleration, window.acceleration, 1e-7)
        reversals = loops.find_reversals(
            window.time, response.slide, response.slide_rate, response.force, drive.period, "slide"
        )
        loop = loops.interface_loop(
            loops.mean_half_range(reversals),
            spectrum.motion_harmonic(window.time, response.slide, response.slide_rate, OMEGA),
            spectrum.friction_harmonic(response, TWO, drive),
            batch.friction_work[k] / WINDOW,
            1e5,
        )
        expected = (
            {
                "absolute_acceleration_peak": measures.compute_peak(response.acceleration),
                "drift_per_cycle": loops.mean_drift(
                    window.time, response.slide, response.slide_rate, drive.period
                ),
                "secant_stiffness": loops.secant_stiffness(reversals),
            }
            | measures.compute_slip_measures(response, drive, STEPS)
            | spectrum.harmonic_measures(*spectrum.odd_harmonics(response, drive))
            | loop
        )
        for name, value in expected.items():
            size = np.abs(response.slide).max() if name == "drift_per_cycle" else abs(value)
            assert values[name][k] == pytest.approx(value, abs=1e-9 * size), (
                name,
                ACCELERATIONS[k],
            )
