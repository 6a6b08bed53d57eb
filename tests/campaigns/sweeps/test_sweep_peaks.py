"""Peak of a response over frequency, compared with the closed form of a single mode."""

import numpy as np
import pytest
from command_line import run_successfully
from sweep_tables import make_table

from patchfem.campaigns.sweeps.changes import analyse
from patchfem.campaigns.sweeps.peaks import find_peaks, locate_peak
from patchfem.export.sweeps.words import make_verdict

NATURAL = 143.0  # [Hz]
BLOCK = """
[structure]
moving_mass = "0.3 kg"
mode = [{name = "block", frequency = "200 Hz", damping = 0.001, slide = 1.0}]
[friction]
law = "coulomb"
static = 0.35
[normal]
load = "1 N"
[drive]
kind = "force"
waveform = "sweep"
from = "195 Hz"
to = "205 Hz"
rate = "1 Hz/s"
force = "2 N"
[accuracy]
method = "harmonic"
tolerance = 1e-2
"""


def respond(frequency, damping):
    """Return the amplitude of an oscillator of unit static response."""
    ratio = (np.asarray(frequency) / NATURAL) ** 2
    return 1 / np.sqrt((1 - ratio) ** 2 + 4 * damping**2 * ratio)


def closed_form(damping):
    """Return frequency, height and half-power width of the peak of the oscillator."""
    square = 1 - 2 * damping**2
    height = 1 / (2 * damping * np.sqrt(1 - damping**2))
    # (1 - r)^2 + 4 D^2 r = 2/height^2 has the roots r of the half-power frequencies.
    roots = square + np.array([-1, 1]) * np.sqrt(square**2 - 1 + 2 / height**2)
    return NATURAL * np.sqrt(square), height, NATURAL * np.ptp(np.sqrt(roots))


@pytest.mark.parametrize("damping", [0.003, 0.02, 0.1])
def test_exact_peak_of_single_mode(damping):
    """Frequency, height and width of a single mode agree with the closed form to 1e-9, for cases at any distance."""
    expected = closed_form(damping)
    for spacing in (0.3, 0.61):
        width = expected[2]
        frequency = NATURAL + spacing * width * (np.arange(-6, 7) + 0.37)
        response = respond(frequency, damping)
        peak = locate_peak(frequency, response, np.zeros(13))
        assert (peak.frequency, peak.height, peak.width) == pytest.approx(expected, rel=1e-9)
        assert peak.frequency_error < 1e-8 * NATURAL


@pytest.mark.parametrize("seed", range(4))
def test_always_errors_of_distorted_peak_hold(seed):
    """The errors of frequency and height contain those of a peak that is not of a single mode."""
    rng = np.random.default_rng(seed)
    bend = rng.uniform(-0.15, 0.15)

    def respond_bent(frequency):
        """Return the response of a mode whose flank is bent."""
        return respond(frequency, 0.02) * (1 + bend * np.sin((frequency - NATURAL) / 3))

    fine = np.linspace(120, 170, 200_001)
    top = fine[np.argmax(respond_bent(fine))]
    frequency = np.linspace(125, 165, 33) + rng.uniform(0, 1.2)
    peak = locate_peak(frequency, respond_bent(frequency), np.zeros(33))
    assert abs(peak.frequency - top) <= peak.frequency_error
    assert abs(peak.height - respond_bent(top)) <= peak.height_error


def test_exact_peaks_of_two_loads_and_missing_peaks():
    """Each combination of the other keys has its peak; a curve that is largest at an end has none."""
    frequency = np.linspace(130, 155, 26)
    values = np.stack([respond(frequency, 0.01), respond(frequency, 0.02)])
    name = "relative_displacement_amplitude"
    keys = {"normal.load": [10.0, 20.0], "drive.frequency": frequency}
    table = make_table(keys, {name: values}, unit="Hz")
    peaks = find_peaks(table)
    assert [entry.peak.height for entry in peaks] == pytest.approx(
        [closed_form(damping)[1] for damping in (0.01, 0.02)], rel=1e-9
    )
    assert [table.keys[0].values[entry.case] for entry in peaks] == [10, 20]
    falling = make_table(
        {"drive.frequency": frequency + 20}, {name: values[0][::-1] * 0 + frequency}
    )
    assert find_peaks(falling) == []
    assert locate_peak(frequency[:4], values[0][:4], np.zeros(4)) is None


def test_always_verdict_on_curves_names_the_peak_amplitude():
    """Curves that miss the tolerance are named with their peak amplitude; a limit of the friction force is no answer."""
    peaks = np.array([2e-3, 2.1e-3, 2.05e-3, 1.98e-3])
    columns = {"relative_displacement_amplitude": peaks, "peak_frequency": np.full(4, 200.0)}
    columns["friction_force_peak"] = np.arange(1.0, 5.0)
    table = make_table({"normal.load": np.arange(1.0, 5.0)}, columns, errors=1e-7)
    for name in columns:
        table.measures[name].errors[1] = 0.1 * abs(columns[name][1])
    verdict = " ".join(make_verdict(table, analyse(table)))
    assert "1 over the tolerance in peak amplitude at 2 (2 other measures" in verdict
    assert "before friction force" not in verdict


@pytest.mark.long
def test_sweep_of_curves_shows_peaks_and_warns_at_ends(tmp_path):
    """The screen shows amplitude and frequency of each peak, and warns of those at an end of the range."""
    scene = tmp_path / "block.toml"
    scene.write_text(BLOCK)
    answer = run_successfully(
        "sweep", str(scene), "--over", "normal.load=1 N,5 N", "-o", tmp_path / "out"
    )
    rows = [line.split() for line in answer.out.splitlines() if line.startswith("  ")]
    assert rows[0] == "normal.load peak amplitude peak frequency".split()
    assert (rows[1][0], rows[2][-2:]) == ("1", ["195", "Hz"])
    assert (
        "drive.from = 195 Hz, the lower end of the swept frequencies, in 1 of 2 cases" in answer.err
    )
