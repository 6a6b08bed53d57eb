"""What a sweep tells of its cases while they run."""

import pytest

import patchfem as pf

JOINT = """
[contact]
length = "40 mm"
width = "30 mm"
height = "10 mm"
load = "8 kN"
substrate = "steel"
[contact.crown]
radius = "100 m"
[contact.shear]
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "0.4 um"
frequency = "1 Hz"
cycles = 2
[accuracy]
tolerance = 2e-3
"""


@pytest.mark.long
def test_always_sweep_does_not_tell_of_passes_of_its_cases(capsys):
    """A run says that it is repeated on a finer mesh; a sweep does not say so of its cases, which it does not name."""
    pf.run(JOINT)
    assert "the run is repeated with" in capsys.readouterr().err
    pf.sweep(JOINT, {"slide.amplitude": ["0.4 um", "0.5 um"]})
    assert "repeated" not in capsys.readouterr().err
