"""Rigs with a mode of negative damping: decay to rest, growth, and the amplitude between both."""

import numpy as np
import pytest

import patchfem as pf

SCENE = """
[normal]
load = "30 N"
[friction]
law = "{law}"
static = 0.3
{more}
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "120 Hz"
damping = {damping}
slide = 1.0
[structure.start]
displacement = ["{start} mm"]
[drive]
kind = "free"
cycles = {cycles}
"""
# Flutter amplitude [mm]: a half cycle loses 2 F/k and grows by exp(pi zeta/sqrt(1 - zeta^2)).
FLUTTER_AMPLITUDE = (
    1e3 * 9 / (0.5 * (240 * np.pi) ** 2) / np.tanh(np.pi * 0.02 / np.sqrt(1 - 0.02**2) / 2)
)


def format_scene(**keys):
    """Return the scene with some values replaced."""
    values = {
        "law": "coulomb",
        "more": "",
        "damping": -0.02,
        "start": FLUTTER_AMPLITUDE,
        "cycles": 60,
    }
    return SCENE.format(**values | keys)


@pytest.mark.parametrize("ratio, outcome", [(0.9, "stuck"), (0.999, "transient"), (1.001, "grows")])
def test_exact_flutter_amplitude_separates_decay_and_growth(ratio, outcome):
    """A release below the flutter amplitude decays, one above it grows; the amplitude agrees with
    the closed form within its error of 1e-8."""
    result = pf.run(pf.load(format_scene(start=ratio * FLUTTER_AMPLITUDE)))
    assert result.outcome == outcome
    flutter_amplitude = result.measures["flutter_amplitude"]
    assert (
        abs(flutter_amplitude.value - 1e-3 * FLUTTER_AMPLITUDE) <= flutter_amplitude.error
        and flutter_amplitude.error <= 1e-8 * flutter_amplitude.value
    )
    if outcome != "stuck":
        swing = result.measures["relative_displacement_amplitude"].value
        assert (swing < flutter_amplitude.value) == (ratio < 1)
    assert "10.08" not in "".join(result.notes) and "decays to rest" in result.notes[-1]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("law", ["coulomb", 'tanh"\nreference_speed = "1 mm/s'])
def test_always_unbounded_growth_ends_run_early(law):
    """A motion that would grow beyond the largest floating-point number ends when it exceeds 1000
    m."""
    result = pf.run(pf.load(format_scene(law=law, start=1.1 * FLUTTER_AMPLITUDE, cycles=10000)))
    assert (
        result.outcome == "grows"
        and result.measures["flutter_amplitude"].value < 1.1e-3 * FLUTTER_AMPLITUDE
    )
    assert result.response.time[-1] < 2 and "when the motion exceeded 1000 m" in result.notes[-1]
    assert all(
        measure.error is None
        for name, measure in result.measures.items()
        if name != "flutter_amplitude"
    )


WEAKENING_SCENE = {
    "normal": {"load": 100.0},
    "friction": {
        "law": "lugre",
        "static": 0.3,
        "kinetic": 0.2,
        "stiffness": 2e5,
        "stribeck_speed": 0.05,
    },
    "structure": {
        "moving_mass": 1.0,
        "mode": [{"name": "a", "frequency": 50.0, "damping": -0.01, "slide": 1.0}],
    },
    "drive": {"kind": "free", "cycles": 40.0},
}


@pytest.mark.share(1)
@pytest.mark.parametrize("ratio, grows", [(0.995, False), (1.005, True)])
def test_flutter_amplitude_of_weakening_law(ratio, grows):
    """Under a velocity-weakening law, releases 0.5 % below the flutter amplitude decay, and those 0.5 % above it grow.

    Smaller motions end in a limit cycle of micro-slip. Den Hartog's balance with the kinetic coefficient alone gives
    12.90 mm for rigid stick.
    """
    result = pf.run(WEAKENING_SCENE, **{"drive.displacement": ratio * 12.797e-3})
    final_amplitude = result.measures["relative_displacement_amplitude"].value
    flutter_amplitude = result.measures["flutter_amplitude"]
    assert (
        flutter_amplitude.value == pytest.approx(12.797e-3, rel=1e-3)
        and flutter_amplitude.error < 1e-3 * flutter_amplitude.value
    )
    assert "ends in the limit cycle of 6.07 um, which is stable" in result.notes[-1]
    assert (
        final_amplitude > 1.03 * flutter_amplitude.value
        if grows
        else final_amplitude < 0.97 * flutter_amplitude.value
    )


SECOND = '[[structure.mode]]\nname = "second"\nfrequency = "{} Hz"\ndamping = 0.02\nslide = 0.3\n[structure.start]\n'


@pytest.mark.parametrize(
    "frequency, law, reason",
    [
        (400, "coulomb", None),
        (0, "coulomb", "a mode of 0 Hz"),
        (None, "nonlocal", "limit cycles can be computed only for"),
    ],
)
def test_exact_flutter_amplitude_of_two_modes_or_its_reason(frequency, law, reason):
    """A second mode hardly changes the flutter amplitude, but the note predicts no rest; a rigid mode, or a law without
    stiffness, gives a reason."""
    more = 'bond_length = "20 um"\nreading = "report"' if law == "nonlocal" else ""
    text = format_scene(
        start=0.9 * FLUTTER_AMPLITUDE, law=law, more=more, cycles=60 if law == "coulomb" else 3
    )
    if frequency is not None:
        text = text.replace("[structure.start]\n", SECOND.format(frequency)).replace(
            ' mm"]', ' mm", "0 mm"]'
        )
    result = pf.run(text)
    amplitude = result.measures["flutter_amplitude"]
    if reason is None:
        assert amplitude.value == pytest.approx(1e-3 * FLUTTER_AMPLITUDE, rel=1e-4)
        assert 0 < amplitude.error < 1e-6 * amplitude.value
        assert "decays to rest" not in result.notes[-1]
    else:
        assert amplitude.value is None and reason in amplitude.reason
