"""Sentences about runs: each is compared with a closed form, or with the numbers of the run."""

import re
from math import pi

import numpy as np
import pytest
from page_data import parse_quantity
from scene_texts import BENCH, DRIVE, MODE, POINT

import patchfem as pf
from patchfem.export import runs
from patchfem.scene import read_template


def get_verdict(scene, **sets) -> tuple:
    """Return the verdict of a scene and its result."""
    result = pf.run(scene, **sets)
    return runs.make_run_answer(result).verdict, result


def test_release_agrees_with_closed_form():
    """Position and time of rest of a Coulomb oscillator agree with the closed form within 0.5 %.

    Each half swing reduces the amplitude by 2 mu N/k, and the block stops where the spring force is
    below mu N.
    """
    text = re.sub(
        r"\[drive\].*?(?=\n\[)",
        '[drive]\nkind = "free"\nduration = "0.3 s"\n[structure.start]\ndisplacement = ["0.5 mm"]\n',
        read_template("rig"),
        flags=re.S,
    )
    text = re.sub(r"damping = \S+", "damping = 0", text)
    verdict, _ = get_verdict(text)
    match = re.fullmatch(
        r"Released at 500 um, the output rests at (\S+) um after (\S+) ms\.", verdict[0]
    )
    assert match, verdict[0]
    load, mass, static = (
        float(re.search(pattern, text)[1])
        for pattern in (r'load = "(\S+) N"', r'moving_mass = "(\S+) kg"', r"static = (\S+)")
    )
    stiffness = mass * (2 * pi * 143) ** 2
    stick_limit = static * load / stiffness
    reversals = [5e-4]
    while reversals[-1] > stick_limit:
        reversals.append(reversals[-1] - 2 * stick_limit)
    assert abs(abs(float(match[1])) * 1e-6 - abs(reversals[-1])) < 5e-3 * 5e-4
    assert float(match[2]) == pytest.approx(1e3 * (len(reversals) - 1) / (2 * 143), rel=5e-3)


def test_loss_factor_agrees_with_parallelogram():
    """The loss factor of an elastic-plastic bench agrees with the closed form of its loop within its error.

    For a parallelogram of force mu N, stiffness k and slide A, the work is W = 4 mu N (A - mu N/k); the first harmonic of
    the force in phase with the slide is k A (a - sin(a) cos(a))/pi with cos(a) = 1 - 2 mu N/(k A).
    """
    law = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nstiffness = "10 N/um"\n'
    slide = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\ncycles = 2\n'
    verdict, result = get_verdict(POINT + law + slide)
    amplitude, k = 1e-5, 1e7
    limit = 0.3 * result.measures["normal_load"].value
    a = np.arccos(1 - 2 * limit / (k * amplitude))
    work = 4 * limit * (amplitude - limit / k)
    stiffness = k * (a - np.sin(a) * np.cos(a)) / pi
    truth = work / (pi * stiffness * amplitude**2)
    found = runs.make_details(result)["loop"]
    assert abs(found["loss_factor"] - truth) <= found["error"] + 1e-9 * truth
    assert found["error"] < 1e-2 * truth
    sentence = next(one for one in verdict if "loss factor" in one)
    value = re.fullmatch(r"At a slide amplitude of 10 um the loss factor is (.*)\.", sentence)[1]
    assert parse_quantity(value)[0] == pytest.approx(truth, rel=1e-3)
    # a rigid bench has no stiffness to which a loss factor could refer
    assert "loop" not in runs.make_details(pf.run(BENCH))


def test_exact_measured_row_is_compared_with_reading_of_sensor(tmp_path):
    """The ratio to a measured row contains the factor of the sensor and its kind of amplitude (rms is peak/sqrt(2))."""
    (tmp_path / "rows.csv").write_text(
        "frequency [Hz],input [g],acceleration [g],displacement [mil]\n143,1,10,5\n", "utf-8"
    )
    scene = tmp_path / "scene.toml"
    # after 400 cycles the transient has decayed
    linear = MODE.replace("0.003", "0.05") + DRIVE.replace("5 g", "1 g").replace(
        "cycles = 30", "cycles = 400"
    )
    measured = '[measured]\nfile = "rows.csv"\nacceleration_gain = 1.5\ndisplacement_gain = 0.8\n'
    scene.write_text(linear.replace("143 Hz", "140 Hz", 1) + measured, "utf-8")
    readings = {}
    for kind in ("peak", "rms"):
        verdict, result = get_verdict(scene, **{"measured.reading": kind})
        rows = {row["reading"]: row for row in runs.make_details(result)["measured"]}
        readings[kind] = rows["acceleration"]["computed"].value
        peak = result.measures["absolute_acceleration_peak"].value
        amplitude = result.measures["relative_displacement_amplitude"].value
        assert rows["displacement"]["computed"].value == pytest.approx(0.8 * amplitude)
        assert rows["displacement"]["ratio"] == pytest.approx(0.8 * amplitude / (5 * 25.4e-6))
        ratio = f"{0.8 * amplitude / (5 * 25.4e-6):.3g}"
        assert any(f"the displacement is {ratio} times the measured one" in one for one in verdict)
    assert readings["peak"] == pytest.approx(1.5 * peak)
    assert readings["rms"] == pytest.approx(1.5 * peak / np.sqrt(2), rel=1e-4)


def test_spectra_agree_with_transfer_function():
    """Under white noise of density G the displacement spectrum is G |H|^2 within 5 %, H = 1/(w0^2 - w^2 + 2 i zeta w0 w).

    Each of 126 lines scatters by 18 %, and their median by less. The window of the segments widens the peak, which is
    left out.
    """
    drive = (
        '[drive]\nkind = "base"\nwaveform = "random"\nspectrum = "0.01 g^2/Hz"\nfrom = "20 Hz"\nto = "400 Hz"\n'
        'duration = "6 s"\n'
    )
    mode = MODE.replace("143 Hz", "100 Hz").replace("0.003", "0.02")
    verdict, result = get_verdict(mode + drive)
    data = result.to_xarray()
    frequency = data.frequency.values
    keep = (frequency >= 20) & (frequency <= 400) & (np.abs(frequency - 100) > 15)
    f = frequency[keep]
    gain = 1 / np.abs((2 * pi) ** 2 * (100**2 - f**2 + 4j * f))
    assert data.gain.values[keep] == pytest.approx(gain, rel=0.06)
    density = 0.01 * 9.80665**2
    base = data.base_acceleration_spectrum.values[keep]
    assert np.median(base) == pytest.approx(density, rel=0.05)
    ratio = data.relative_displacement_spectrum.values[keep] / (density * gain**2)
    assert np.median(ratio) == pytest.approx(1, rel=0.05)
    assert "rms, H1 peaks at " in verdict[0]
    assert float(data.gain_peak) == pytest.approx(100, rel=5e-3)


@pytest.mark.parametrize(
    "levels, sentence",
    [
        (
            ["5 g", "7 g"],
            r"The acceleration's distortion exceeds 3 % at (\S+) ",
        ),
        (["1 g", "2 g"], r"No level of the increasing sequence has an acceleration"),
    ],
)
def test_always_first_sentence_of_levels_states_the_onset(levels, sentence):
    """The headline of a drive in levels has the onset and its criterion, or says that no level reaches it."""
    drive = DRIVE.replace('acceleration = "5 g"', f'waveform = "levels"\nlevels = {levels}')
    law = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
    verdict, result = get_verdict(POINT + law + MODE + drive)
    match = re.match(sentence, verdict[0])
    assert match, verdict[0]
    if match.groups():
        onset = result.measures["onset_level"]
        assert float(match[1]) == pytest.approx(onset.value / 9.80665, abs=1e-3)
