"""Several tones at once: superposition of closed forms, beats, energies under friction, refusals."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.structure.tones import count_beat_cycles

MODE = {"name": "axial", "frequency": 100.0, "damping": 0.02, "slide": 1.0}
RIG = {
    "structure": {"moving_mass": 0.9, "mode": [MODE]},
    "drive": {
        "kind": "base",
        "waveform": "tones",
        "frequencies": ["96 Hz", "102 Hz"],
        "accelerations": ["1 g", "0.5 g"],
        "phases": ["0 deg", "40 deg"],
        "cycles": 160,
    },
}
PLASTIC = {
    "normal": {"load": "20 N"},
    "friction": {"law": "elastic-plastic", "static": 0.3, "bond_length": "5 um"},
}


def from_rest(t, omega, zeta, parts):
    """Displacement of an oscillator from rest under tones (f, a, phase) of the base, in closed form."""
    own = omega * np.sqrt(1 - zeta**2)
    out = 0.0
    for f, a, phi in parts:
        w = 2 * np.pi * f
        steady = -a * np.exp(1j * phi) / (omega**2 - w * w + 2j * zeta * omega * w)
        place = steady.imag
        rate = (1j * w * steady).imag
        free = place * np.cos(own * t) + (rate + zeta * omega * place) / own * np.sin(own * t)
        out = out + (steady * np.exp(1j * w * t)).imag - np.exp(-zeta * omega * t) * free
    return out


def test_exact_tones_on_a_linear_rig_are_the_sum_of_each():
    result = pf.run(RIG)
    parts = ((96, 9.80665, 0), (102, 9.80665 / 2, np.radians(40)))
    true = from_rest(result.response.time, 2 * np.pi * 100, 0.02, parts)
    assert np.abs(result.response.output - true).max() < 1e-6 * np.abs(true).max()
    # one beat of 1/6 s in cycles of 96 Hz
    assert result.outcome == "steady" and result.extra["window"] == 16
    t = np.linspace(10, 10 + 1 / 6, 20001)
    late = from_rest(t, 2 * np.pi * 100, 0.02, parts)
    assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
        np.ptp(late) / 2, rel=1e-5
    )


def test_exact_energies_balance_under_two_tones():
    m = pf.run(RIG | PLASTIC).measures
    assert m["drift_per_cycle"].value is None
    assert "within their beat without any drift" in m["drift_per_cycle"].reason
    assert m["energy_balance"].value < 1e-11
    assert m["energy_dissipated"].value > 0
    assert m["work_check"].value < 1e-9


@pytest.mark.parametrize(
    "frequencies, cycles",
    [((96.0, 102.0), 16), ((100.0, 90.0, 110.0), 10), ((0.3, 0.2), 3), ((1e-9, 2e-9), 1)],
)
def test_exact_a_beat_is_the_shortest_time_after_which_all_tones_repeat(frequencies, cycles):
    assert count_beat_cycles(frequencies) == cycles


@pytest.mark.parametrize(
    "given, said",
    [
        ({"kind": "force"}, "can only shake the base"),
        ({"accelerations": ["1 g"]}, "accelerations"),
        ({"phases": ["0 deg"] * 3}, "3 values for 2 frequencies"),
        ({"frequencies": None}, "waveform 'tones' needs this key"),
        ({"accelerations": ["0 g", "0 g"]}, "nothing moves"),
        ({"cycles": None}, r"drive\.cycles"),
        ({"frequencies": [96.0, "1 um"]}, "frequency"),
    ],
)
def test_refuses_tones_that_none_can_be(given, said):
    drive = {name: one for name, one in (RIG["drive"] | given).items() if one is not None}
    with pytest.raises(pf.PatchfemError, match=said):
        pf.run(RIG | {"drive": drive})
    with pytest.raises(pf.PatchfemError, match="under a sine"):
        pf.run(RIG, **{"accuracy.method": "harmonic"})
