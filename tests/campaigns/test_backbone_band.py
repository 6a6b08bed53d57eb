"""Recommended curve of a backbone, its band and the advice, for scenes of a joint."""

import json
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import patchfem as pf
from patchfem.__main__ import main
from patchfem.campaigns import compute_backbone

LAW = '[normal]\nload = "100 N"\n[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "60 um"\n'
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "1 Hz"\n'
MODES = "100 Hz:0.005:0.5, 160 Hz:0.01:0.4"
STRUCTURE = """[structure]
moving_mass = "1 kg"
measured = "stuck"
[[structure.mode]]
name = "first"
frequency = "100 Hz"
damping = 0.005
slide = 0.5
output = 1.0
[[structure.mode]]
name = "second"
frequency = "160 Hz"
damping = 0.01
slide = 0.4
output = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "1 g"
cycles = 20
"""
DUFFING = """[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "first"
frequency = "100 Hz"
damping = 0.02
slide = 1.0
output = 1.0
base = 0.0
[drive]
kind = "force"
frequency = "100 Hz"
force = "1 N"
cycles = 10
"""
AMPLITUDES = np.geomspace(1e-5, 2e-3, 19)


@pytest.fixture(scope="module")
def three_curves():
    """Curves of two modes by all three methods, with the modes given beside the scene of a bench."""
    return pf.backbone(LAW + SLIDE, modes=MODES, amplitudes=AMPLITUDES, method="all")


def test_exact_modes_as_argument_and_in_scene_give_same_curves(three_curves):
    """Modes given as an argument and modes in the scene of a rig give the same curve within 1e-9.

    Notes state which tables of the scene are ignored and that a modal mass is assumed.
    """
    backbone = pf.backbone(LAW + STRUCTURE, amplitudes=AMPLITUDES[::6])
    assert backbone.balance_frequency.values == pytest.approx(
        three_curves.balance_frequency.values[::6], rel=1e-9
    )
    assert backbone.attrs["stuck_frequency"] == pytest.approx(100)
    for curves, sentence in (
        (three_curves, "[slide] is ignored"),
        (three_curves, "modal mass is assumed"),
        (backbone, "[drive] is ignored"),
    ):
        assert any(sentence in note for note in curves.attrs["notes"])
    assert not any(name.startswith("decay") for name in backbone)


def test_band_contains_curves_of_all_methods(three_curves):
    """The band contains the curves of all three methods, and the advice states their largest difference.

    The damping by decay is up to 30 % larger than that by balance.
    """
    backbone = three_curves
    assert backbone.attrs["method"] == "balance"
    advice = backbone.attrs["advice"]
    # The computed decay replaces the predicted ring-down, with the figures of the note.
    stated = re.search(r"The ring-down .*? reads (\S+ %) more damping at (\S+ um)", advice)
    sentence = f"of damping by decay and by balance differ most at the amplitude {stated[2]}, by {stated[1]}"
    assert any(sentence in note for note in backbone.attrs["notes"])
    assert "predicted" not in advice and "Up to 105 um friction dissipates nothing" in advice
    assert "the sticking contact, friction would reach its limit at 120 um" in advice
    for method in ("balance", "quasi_static", "decay"):
        amplitude = backbone[f"{method}_amplitude"].values
        here = np.isin(backbone.band_amplitude, amplitude)
        assert here.sum() >= 8
        for name in ("frequency", "damping"):
            value = backbone[f"{method}_{name}"].values[np.isin(amplitude, backbone.band_amplitude)]
            assert (backbone[f"band_{name}_low"].values[here] <= value).all()
            assert (backbone[f"band_{name}_high"].values[here] >= value).all()


def test_band_by_balance_contains_curve_of_decay(three_curves):
    """The band computed by the balance alone contains more than 90 % of the curve of the decay.

    The advice predicts the damping that a ring-down would show.
    """
    backbone = pf.backbone(LAW + SLIDE, modes=MODES, amplitudes=AMPLITUDES, method="balance")
    assert set(backbone.data_vars) & {"decay_damping", "quasi_static_damping"} == set()
    assert "is predicted to read" in backbone.attrs["advice"]
    assert "For the curve of a ring-down, run --method decay." in backbone.attrs["advice"]
    amplitude = three_curves.decay_amplitude.values
    high = np.interp(amplitude, backbone.band_amplitude, backbone.band_damping_high)
    low = np.interp(amplitude, backbone.band_amplitude, backbone.band_damping_low)
    error = three_curves.decay_damping_error.values
    inside = (low - error <= three_curves.decay_damping) & (
        three_curves.decay_damping <= high + error
    )
    assert inside.mean() > 0.9
    curve = backbone.balance_damping.values
    width = (backbone.band_damping_high.values - backbone.band_damping_low.values) / curve
    assert width[-1] < 0.1
    excess = three_curves.decay_damping.values / np.interp(
        amplitude, backbone.band_amplitude, backbone.balance_damping
    )
    assert excess.max() > 1.05


def test_band_of_single_mode_is_narrow_except_at_onset_of_slip():
    """The band of the damping of a single mode is below 3 % wide at the largest amplitude.

    Its median width is below 10 %; only at the onset of slip it is wider.
    """
    backbone = pf.backbone(
        LAW + SLIDE, modes="100 Hz:0.005:0.5", amplitudes=AMPLITUDES, method="balance"
    )
    assert "changes its shape" not in backbone.attrs["advice"]
    width = (
        backbone.band_damping_high - backbone.band_damping_low
    ).values / backbone.balance_damping.values
    assert width[0] < 1e-3 and width[-1] < 0.03 and np.median(width) < 0.1
    assert (backbone.band_damping_low.values > 0.0049).all()


@pytest.mark.share(0)
@pytest.mark.parametrize(("cubic", "start"), [(4e10, 6.5e-3), (-2e10, 2.75e-3)])
def test_exact_predicted_ring_down_agrees_with_duffing_oscillator(cubic, start):
    """The predicted damping of a ring-down with a cubic spring agrees with an integration within 5e-3."""
    omega = 2 * np.pi * 100

    def rates(t, y):
        return [y[1], -(omega**2) * y[0] - cubic * y[0] ** 3 - 2 * 0.02 * omega * y[1]]

    run = solve_ivp(rates, (0, 0.2), [start, 0], events=lambda t, y: y[1], rtol=1e-10, atol=1e-14)
    peaks = np.abs(run.y_events[0][1:, 0])
    middles = (peaks[1:] + peaks[:-1]) / 2
    decrement = np.log(middles[:-2] / middles[2:]) / (2 * np.pi)
    damping = decrement / np.sqrt(1 + decrement**2)
    amplitudes = middles[1:-1][:12:4]
    scene = DUFFING + f'[structure.stiffening]\ncubic = "{cubic} N/m^3"\n'
    curves = compute_backbone(pf.build(scene), "", amplitudes, ("balance",))
    backbone = curves.answer.band.ring_down.damping
    assert backbone[::-1] == pytest.approx(damping[:12:4], rel=5e-3)


def march_decay(start: float) -> tuple:
    """Return mean amplitudes [m] and damping ratios of the cycles of a released elastic-plastic oscillator.

    1 kg at 100 Hz with a damping ratio of 0.01, on a slider of 4e4 N/m that slips at 30 N. The damping ratio
    follows from the logarithmic decrement of each cycle, from a peak to the next one of the same sign.
    """
    omega = 2 * np.pi * 100
    dt = 0.01 / 2000
    position = start
    velocity = 0.0
    force = 30.0
    peaks = []
    for _ in range(60000):
        acceleration = -(omega**2) * position - 0.02 * omega * velocity - force
        faster = velocity + dt * acceleration
        if faster * velocity < 0:
            peaks.append(abs(position))
        velocity = faster
        position += dt * velocity
        force = min(max(force + 4e4 * dt * velocity, -30.0), 30.0)
    peaks = np.array(peaks)
    decrement = np.log(peaks[:-2] / peaks[2:]) / (2 * np.pi)
    return np.sqrt(peaks[:-2] * peaks[2:]), decrement / np.hypot(1, decrement)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.01, 1.06, 1.2])
def test_band_beside_onset_of_slip_does_not_depend_on_other_amplitudes(ratio):
    """The band at an amplitude contains the decrement of a decay, whichever other amplitudes are given.

    The slider slips from 750 um. The motions from which the ring-down is predicted were once at amplitudes
    that depended on the given ones and blurred the onset of slip.
    """
    amplitude = ratio * 750e-6
    law = LAW.replace("60 um", "750 um")
    scene = law + DUFFING.replace("damping = 0.02", "damping = 0.01")
    others = ([], [0.3 * amplitude, 4 * amplitude], np.geomspace(284e-6, 2.84e-3, 60))
    limits = []
    for given in others:
        amplitudes = np.unique(np.append(amplitude, given))
        backbone = compute_backbone(pf.build(scene), "", amplitudes, ("balance",))
        band = backbone.answer.band
        k = np.searchsorted(amplitudes, amplitude)
        limits.append([band.damping_low[k], band.damping_high[k]])
    assert limits[1:] == pytest.approx(np.array([limits[0], limits[0]]), rel=2e-3)
    low, high = limits[0]
    amplitudes, damping = march_decay(1.4 * amplitude)
    decrement = np.interp(-amplitude, -amplitudes, damping)
    assert low <= decrement <= high < 1.15 * decrement


def test_new_joint_scene_has_a_backbone(tmp_path, monkeypatch, capsys):
    """The scene of `new joint` with two given modes has a backbone with a band and advice."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(pf.new("joint"), "utf-8")
    options = ("--modes", "120 Hz:0.01, 170 Hz:0.02", "--amplitudes", "9 um..1 mm:3")
    with pytest.raises(SystemExit) as ended:
        main(["backbone", "joint.toml", "--json", "--no-page", *options])
    assert not ended.value.code
    answer = json.loads(capsys.readouterr().out)
    assert set(answer["band"]) == {
        "amplitude", "frequency_low", "frequency_high", "damping_low", "damping_high"
    }  # fmt: skip
    assert answer["stuck_frequency"] == pytest.approx(120, rel=1e-4)
    assert set(answer["curves"]) == {"balance", "quasi-static"}
    assert answer["advice"].startswith("Use the curve of method balance")
    # A patch in partial slip dissipates energy at each amplitude.
    assert "dissipates nothing" not in answer["advice"]
    for text in ("[slide] is ignored", "`slide` is assumed such", "assumed `slide` is positive"):
        assert any(text in note for note in answer["notes"])


def test_exact_drive_of_scene_is_ignored():
    """A scene whose [drive] is incomplete, or absent, gives the curve of the same scene with a drive."""
    text, _, drive = (LAW + STRUCTURE).partition("[drive]")
    curves = [
        pf.backbone(text + tail, amplitudes=[2e-5], method="quasi-static")
        for tail in ("[drive]" + drive, '[drive]\nkind = "free"\n', "")
    ]
    for name in ("quasi_static_frequency", "quasi_static_damping"):
        assert len({curve[name].item() for curve in curves}) == 1
    for curve, is_noted in zip(curves, (True, True, False)):
        assert any("[drive] is ignored" in note for note in curve.attrs["notes"]) == is_noted


@pytest.mark.parametrize(
    "scene, modes, message",
    [
        (LAW + SLIDE, "120", "'120': .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, "120 mm:0.01", "120 mm.*frequency"),
        (LAW + SLIDE, "120 Hz:1 mm", "'1 mm' is neither a number nor a percentage such as '1 %'; write"),
        (LAW + SLIDE, [120, 0.01], "120: .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, 120, "120: .*FREQUENCY:DAMPING"),
        (LAW + SLIDE, "120 Hz:0.01:0", "no slide of 0"),
        (LAW + SLIDE, [("120 Hz", 0.01, 40.0)], r"structure\.mode\[1\]\.slide.*multiply `slide`"),
        ('[structure]\nmasses = ["1 kg"]\n' + LAW + SLIDE, "9 Hz:0.01", "structure of masses"),
        (pf.build(LAW + STRUCTURE), "9 Hz:0.01", "cannot be given with a Model"),
    ],
)  # fmt: skip
def test_refuses_invalid_modes(scene, modes, message):
    """Modes with invalid text, units, slide or beside a structure of masses are refused."""
    with pytest.raises(pf.PatchfemError, match=f"(?s){message}"):
        pf.backbone(scene, modes=modes)
