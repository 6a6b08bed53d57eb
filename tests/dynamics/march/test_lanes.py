"""Bonds behind shear modes in lanes against the march of each case by itself, and what is read off their samples."""

import numpy as np
import pytest
from march_paths import OMEGA
from modal_bases import basis_of
from test_march_loop import half_plane

from patchfem.core import Response, SineDrive
from patchfem.dynamics import points_model
from patchfem.dynamics.march import lanes
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds
from patchfem.response import loops, measures, spectrum
from patchfem.runs.batch.samples import Samples
from patchfem.slip.shear_modes import shear_modes

ONE = basis_of(OMEGA, 0.05)
TWO = basis_of(OMEGA * np.array([1.0, 0.9]), 0.05, [1.0, 0.2], np.ones(2), [1.0, -0.5])
PUSHES, CYCLES, STEPS, WINDOW = (5.0, 20.0, 49.0, 300.0), 12, 80, 3
LAW, DRIVE = Bonds(0.4, 1e-6), SineDrive(1.0, OMEGA)
BOOKS = {
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


def patch(points: int = 6):
    """(area (p,), pressure (p,), modes) of a patch that a tilt presses harder at one end."""
    compliance, x = half_plane(points, 1e-7)
    area = np.full(points, 1 / points)
    sigma = 60.0 * (1 + 0.8 * x)
    return area, sigma, shear_modes(compliance, LAW.static * area * sigma, LAW.length, 2)


def both(basis, cycles: int = CYCLES) -> tuple:
    """(lanes of a case per push, march of each by itself)."""
    area, sigma, modes = patch()
    cases = [
        lanes.PointsCase(LAW.static * area * sigma, modes.shape, modes.stiffness, LAW.length, push)
        for push in PUSHES
    ]
    return lanes.march(basis, DRIVE, cases, cycles, STEPS, WINDOW), [
        march(
            basis,
            SineDrive(push, OMEGA),
            points_model(LAW, area, sigma, modes),
            cycles,
            STEPS,
            WINDOW,
        )
        for push in PUSHES
    ]


@pytest.fixture(scope="module")
def pairs() -> tuple:
    return both(TWO)


def near(one, other, rel: float = 1e-12):
    np.testing.assert_allclose(one, other, rtol=rel, atol=rel * np.abs(other).max())


@pytest.mark.parametrize("basis", [ONE, TWO], ids=["one mode", "two modes"])
def test_exact_lanes_take_the_steps_of_a_march(basis):
    """Sticking, slipping and dragging cases side by side; to what Newton's last step leaves, 1e-9 of the limit."""
    found, alone = both(basis)
    assert not found.bad.any()
    for k, one in enumerate(alone):
        near(found.extremes[k], one.amplitudes, 1e-7)
        near(found.phasors[k], one.phasors, 1e-7)
        near(found.force[:, k], one.window.force, 1e-7)
        near(found.slip[:, k], one.window.slip, 1e-6)
        near(found.z[:, :, k], one.window.modal, 1e-7)
        near(found.worked[k], one.window_work, 1e-7)
        ledger = one.response.extra["ledger"][:, -1]
        near(found.book["gone"][k], ledger[2], 1e-7)
        assert found.book["created"][k] <= 1e-9 * ledger[2] >= ledger[3]
        for mine, name in BOOKS.items():
            assert found.book[mine][k] == pytest.approx(one.ledger[name], rel=1e-7), name
        gap = found.book["work_in"][k] - sum(
            found.book[name][k] for name in ("stored", "lost", "viscous")
        )
        assert abs(gap) < 1e-9 * found.book["power"][k]


def test_exact_a_case_does_not_hang_on_those_beside_it():
    area, sigma, modes = patch()
    cases = [
        lanes.PointsCase(LAW.static * area * sigma, modes.shape, modes.stiffness, LAW.length, push)
        for push in np.geomspace(5.0, 300.0, 40)
    ]
    many, one = (lanes.march(TWO, DRIVE, part, 4, STEPS, 1) for part in (cases, cases[17:18]))
    near(many.extremes[17], one.extremes[0], 1e-11)
    assert many.extremes.shape == (40, 4, 2)


def test_exact_what_is_read_off_samples_side_by_side(pairs):
    """Each as the readers of one run have it, of the same samples."""
    found, alone = pairs
    seen = Samples(found, TWO, OMEGA, np.array(PUSHES), STEPS, WINDOW)
    book = {"peak_stored": found.book["peak"]} | found.book
    values = seen.values(book, np.full(4, 1e5), np.full(4, 60.0))
    for k, one in enumerate(alone):
        w = one.window
        drive = SineDrive(PUSHES[k], OMEGA)
        here = Response(
            w.time,
            found.z[:, :, k],
            found.rate[:, :, k],
            seen.slide[:, k],
            seen.speed[:, k],
            found.z[:, :, k] @ TWO.output,
            found.rate[:, :, k] @ TWO.output,
            seen.acceleration()[:, k],
            w.base_acceleration,
            found.force[:, k],
            found.slip[:, k],
        )
        near(here.acceleration, w.acceleration, 1e-7)
        turns = loops.find_reversals(
            w.time, here.slide, here.slide_rate, here.force, drive.period, "slide"
        )
        loop = loops.interface_loop(
            loops.mean_half_range(turns),
            spectrum.motion_harmonic(w.time, here.slide, here.slide_rate, OMEGA),
            spectrum.friction_harmonic(here, TWO, drive),
            found.worked[k] / WINDOW,
            1e5,
        )
        expected = (
            {
                "absolute_acceleration_peak": measures.compute_acceleration_peak(here),
                "drift_per_cycle": loops.mean_drift(
                    w.time, here.slide, here.slide_rate, drive.period
                ),
                "secant_stiffness": loops.secant_stiffness(turns),
            }
            | measures.compute_slip_measures(here, drive, STEPS)
            | spectrum.harmonic_measures(*spectrum.odd_harmonics(here, drive))
            | loop
        )
        for name, value in expected.items():
            size = np.abs(here.slide).max() if name == "drift_per_cycle" else abs(value)
            assert values[name][k] == pytest.approx(value, abs=1e-9 * size), (name, PUSHES[k])
