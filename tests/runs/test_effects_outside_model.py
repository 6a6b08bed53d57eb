"""Notes and outcomes about effects outside the model: plane state, fixed faces, buckling, sliding
off the piece."""

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, MODE, PIECE

from patchfem import plan
from patchfem.runs.run import run
from patchfem.scene import loads

SINE = '[slide]\nkind = "sine"\nfrequency = "1 Hz"\ncycles = 1\namplitude = "{}"\n'
FIXED_FACE = (
    '[contact]\nlength = "12.8 mm"\nwidth = "12.7 mm"\nheight = "6.4 mm"\nload = "26 lbf"\n'
    'substrate = "Ti-8Al-1Mo-1V"\nmesh = "{}"\n'
)
PRESCRIBED_APPROACH = (
    PIECE
    + 'substrate = "Ti-8Al-1Mo-1V"\nelement_size = "0.2 mm"\n[contact.approach]\ndistance = "0.2 um"\n'
)
LOAD_LINE = '[contact.load_line]\noffset = "{} mm"\n'


def run_text(text, estimate=True):
    """Return the result of a scene."""
    return run(loads(text), estimate=estimate)


# ---- plane state


# ---- mesh files, tall pieces


def test_exact_note_states_fraction_of_buckling_load():
    """The note refers to Euler's load of a clamped-free column, pi^2 E' I/(4 H^2) with I = width
    length^3/12."""
    text = (
        '[contact]\nlength = "10 mm"\nwidth = "1 m"\nheight = "{} mm"\nload = "{} N"\nelement_size = "0.5 mm"\n'
        'substrate = {{young = "100 GPa", poisson = 0.3, density = "4000 kg/m^3"}}\n'
    )
    critical = np.pi**2 * 100e9 / 0.91 * (1e-2**3 / 12) / (4 * 0.1**2)
    notes = run_text(text.format(100, 0.05 * critical)).extra["notes"]
    buckling_notes = [line for line in notes if "buckle" in line]
    assert len(buckling_notes) == 2
    assert "10 times as tall as it is long and carries 0.05 of the load" in buckling_notes[0]
    for height, fraction in ((100, 0.015), (10, 0.05)):
        assert not any(
            "buckle" in line
            for line in run_text(text.format(height, fraction * critical)).extra["notes"]
        )


# ---- sliding away
@pytest.mark.parametrize(
    "fraction, has_warning, outcome",
    [
        (0.09, False, "done"),
        (0.99, True, "done"),
        (1.01, True, "leaves_contact"),
    ],
)
def test_exact_warning_states_slide_amplitude_over_contact_length(fraction, has_warning, outcome):
    """A slide of more than a tenth of the contact length gives a warning; a longer one than the contact ends the run."""
    result = run_text(COATED + COULOMB + SINE.format(f"{12.7 * fraction} mm"), False)
    line = f"the slide amplitude, {12.7 * fraction:.3g} mm, is {fraction:.2g} of the contact length 12.7 mm"
    assert any(text.startswith(line) for text in result.warnings) == has_warning
    assert any(text.startswith("the slide amplitude") for text in result.warnings) == has_warning
    assert result.outcome == outcome


def test_exact_warning_states_contact_length_of_tilted_patch():
    """The contact length in the warning about a large slide is that of the loaded part of a tilted patch."""
    tilt = '[contact.tilt]\nangle = "0.02 mrad"\n'
    result = run_text(COATED + tilt + COULOMB + SINE.format("3 mm"), False)
    (warning,) = [text for text in result.warnings if text.startswith("the slide amplitude")]
    length = float(warning.partition("contact length ")[2].split(" mm")[0])
    fraction = result.measures["contact_fraction"].value
    assert 0.2 < fraction < 0.9 and length == pytest.approx(12.7 * fraction, abs=0.5)


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    "law, accuracy, engine",
    [
        (COULOMB, "", "exact"),
        (COULOMB, '[accuracy]\nmethod = "march"\nsteps_per_cycle = 100\n', "march"),
        (COULOMB.replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"'), "", "hybrid"),
        (COULOMB, '[accuracy]\nmethod = "harmonic"\n', "harmonic"),
    ],
)
def test_exact_motion_beyond_piece_leaves_contact_in_every_engine(law, accuracy, engine):
    """A drive of 60 g moves the block by 48 mm on a piece of 12.7 mm; the outcome is
    `leaves_contact`, also if only the second of three levels is so large."""
    sine = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "60 g"\ncycles = 30\n'
    result = run_text(COATED + law + MODE + sine + accuracy, False)
    assert result.extra["engine"] == engine and result.outcome == "leaves_contact"
    if engine != "harmonic":
        steps = sine.replace(
            'acceleration = "60 g"', 'waveform = "levels"\nlevels = ["5 g", "60 g", "5 g"]'
        )
        assert run_text(COATED + law + MODE + steps + accuracy, False).outcome == "leaves_contact"


# ---- approaches that no load reaches


@pytest.mark.parametrize(
    "tilt, shape",
    [
        (10, ""),
        (1, ""),
        (1, '[contact.step]\nheight = "1 um"\nat = "0 mm"\n'),
    ],
)
def test_always_plan_predicts_full_contact_correctly(tilt, shape):
    """The plan predicts full contact only where the run finds it. At 10 urad, bars would touch
    everywhere, but elastic pieces touch on 94 % of the length."""
    text = (
        COATED.replace('element_size = "0.5 mm"\n', "")
        + f'[contact.tilt]\nangle = "{tilt} urad"\n{shape}'
    )
    scene = loads(text, "a.toml", ["accuracy.tolerance=1e-2"])
    is_full = any(text.endswith("the pieces touch everywhere") for text in plan(scene).verdict)
    assert is_full == (run(scene).measures["contact_fraction"].value == 1.0)
