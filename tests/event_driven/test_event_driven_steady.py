"""Steady motions by shooting: published values, closed forms, number of stops, coexisting and growing motions."""

from math import pi

import numpy as np
import pytest
from event_driven_cases import coulomb, make_oscillator
from vibration_forms import sliding_amplitude, two_stop_amplitude

from patchfem.event_driven import runs
from patchfem.event_driven.laws import masing
from patchfem.event_driven.periodic import find_periodic_motion
from patchfem.event_driven.records import Window

AMPLITUDE = "relative_displacement_amplitude"


def find(friction, zeta=0.0, ratio=1.0, level=1.0, kinetic=None, **options):
    """Return the steady motion of a mass under Coulomb friction, its amplitude, and its stops in a period."""
    case = make_oscillator(
        coulomb(friction, kinetic), load=1.0, acceleration=level, zeta=zeta, omega=ratio, cycles=1, rtol=1e-11,
        **options,
    )  # fmt: skip
    motion = find_periodic_motion(case)
    row = motion.run.record.faces[0]
    stops = int(row[Window.STARTS]) if row[Window.STUCK] > 1e-9 * motion.period else 0
    return motion, motion.run.values[AMPLITUDE], stops


@pytest.mark.parametrize(
    ("friction", "zeta", "expected", "stops"),
    [
        (0.8, 0.003, 0.28704671337871602595, 2),
        (0.8, 0.0, 0.29943104174842751488, 2),
        (0.5, 0.003, 60.5632260810004979, 0),
        (0.79, 0.0, 0.435537658848, 2),
        (0.95, 0.0, two_stop_amplitude(0.95), 2),
        (pi / 4 + 1e-6, 0.0, two_stop_amplitude(pi / 4 + 1e-6), 2),
    ],
)
def test_exact_resonance_amplitudes_agree_with_published_values(friction, zeta, expected, stops):
    """Amplitudes at resonance agree within 1e-9 with published values, or with the closed form of two stops, which is
    ill-conditioned near pi/4."""
    motion, amplitude, found = find(friction, zeta)
    rel = 1e-9 + 1e-14 / max(friction - pi / 4, 1e-4) ** 2 + (friction < pi / 4 + 1e-5) * 1e-7
    assert amplitude == pytest.approx(expected, rel=rel)
    assert found == stops and motion.is_stable and not motion.grows


def test_exact_rest_and_growth():
    """Above the drive friction holds the mass; below pi/4 the undamped motion grows for ever."""
    assert find(1.2, 0.003)[1] == pytest.approx(0.0, abs=1e-15)
    assert find(pi / 4 - 1e-4)[0].grows


@pytest.mark.parametrize(
    ("hertz", "level", "amplitude"), [(135, 6, 5.22698), (150, 7, 6.66151), (155, 8, 4.29575)]
)
def test_table_check_7_amplitudes_without_damping(hertz, level, amplitude):
    """Amplitudes without damping agree with table check 7 of the report within 2e-6."""
    found, stops = find(1.0, ratio=hertz / 143, level=level / 4)[1:]
    assert found / (level / 4) == pytest.approx(amplitude, rel=2e-6) and stops == 0


@pytest.mark.parametrize(
    ("hertz", "knee"), [(135, 1.2466), (143, 1.2792), (150, 1.3108), (155, 1.3337)]
)
def test_table_check_8_transition_to_sliding(hertz, knee):
    """The last stop vanishes at the ratio of drive to friction in table check 8 of the report, within 1e-3."""
    stops = [find(1.0, 0.003, hertz / 143, knee + offset)[2] for offset in (-1e-3, 1e-3)]
    assert stops == [2, 0]


@pytest.mark.parametrize(
    ("level", "ratio", "n_stops"), [(3.0, 0.11, 4), (2.0, 0.06, 8), (2.0, 0.05, 10)]
)
def test_exact_number_of_stops_below_resonance(level, ratio, n_stops):
    """A slow drive has more stops per cycle, and the amplitude of a long run."""
    _, amplitude, stops = find(1.0, 0.0005, ratio, level)
    case = make_oscillator(
        coulomb(), load=1.0, acceleration=level, zeta=0.0005, omega=ratio, cycles=80, rtol=1e-11
    )
    expected = runs.run_case(case).values[AMPLITUDE]
    assert stops == n_stops and amplitude == pytest.approx(expected, rel=1e-9)


def test_exact_stuck_and_sliding_motion_coexist():
    """With kinetic below static friction the rig stays at rest, or slides steadily after a displacement, at the same
    drive level."""
    rest = find(1.0, 0.05, level=0.9, kinetic=0.3)
    moving = find(1.0, 0.05, level=0.9, kinetic=0.3, z=8.0)
    assert rest[1] == pytest.approx(0.0, abs=1e-12)
    expected = 0.9 * sliding_amplitude(1.0, 0.3 / 0.9, 0.05)
    assert moving[1] == pytest.approx(expected, rel=1e-9) and moving[0].is_stable


@pytest.mark.share(0, 1, 2)
@pytest.mark.parametrize(("count", "zeta"), [(1, 0.003), (5, 0.03), (20, 0.01), (300, 0.01)])
def test_exact_elements_agree_with_a_long_run(count, zeta):
    """Amplitudes with many Jenkins elements agree within 1e-8 with long runs."""
    law = masing.from_elements(np.full(count, 4.0 / count), np.linspace(0.05, 0.4, count))
    case = make_oscillator(law, load=1.0, zeta=zeta, omega=1.1, cycles=1500, rtol=1e-11)
    motion = find_periodic_motion(case)
    expected = runs.run_case(case).values[AMPLITUDE]
    assert motion.run.values[AMPLITUDE] == pytest.approx(expected, rel=1e-8)
