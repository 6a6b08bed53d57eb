"""Description of the drive of a run, and captions and links of its page."""

import tomllib

import pytest

import patchfem as pf
from patchfem.export.driven import describe_drive

MODES = (
    '[structure]\nmoving_mass = "2 kg"\n[[structure.mode]]\nname = "a"\nfrequency = "100 Hz"\ndamping = 0.01\n'
    "slide = 1.0\n"
)
BENCH = '[normal]\nload = "10 N"\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
DRIVES = {
    'kind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 3': "base acceleration of 5 g at 143 Hz",
    'kind = "base"\nfrequency = "20 Hz"\ndisplacement = "0.5 mm"\ncycles = 3': "base displacement of 500 um at 20 Hz",
    'kind = "force"\nfrequency = "20 Hz"\nforce = "30 N"\ncycles = 3': "force of 30 N at 20 Hz",
    'kind = "base"\nwaveform = "step"\nacceleration = "2 g"\ncycles = 3': "a step of 2 g in base acceleration",
    'kind = "base"\nwaveform = "sweep"\nfrom = "130 Hz"\nto = "150 Hz"\n'
    'rate = "10 Hz/s"\nacceleration = "1 g"': "base acceleration of 1 g swept from 130 Hz to 150 Hz",
    'kind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\n'
    'levels = ["3 g", "4 g", "5 g"]\ncycles = 9': "3 levels of base acceleration from 3 g to 5 g at 143 Hz",
    'kind = "force"\nwaveform = "levels"\nfrequency = "143 Hz"\n'
    'levels = ["3 N", "5 N"]\ncycles = 9': "2 levels of force from 3 N to 5 N at 143 Hz",
    'kind = "free"\ndisplacement = "1 mm"\ncycles = 3': "free motion released 1 mm from rest",
}
SLIDES = {
    'kind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"': "a sine slide of ±10 um at 143 Hz",
    'kind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"': "a triangle slide of ±10 um at 5 mm/s",
    'kind = "constant"\ndistance = "50 um"\nspeed = "1 mm/s"': "a slide of 50 um at 1 mm/s",
    'kind = "dwell"\ndistance = "50 um"\nspeed = "1 mm/s"\nhold = "0.2 s"': "a slide of 50 um at 1 mm/s, held for 200 ms",
}


METHODS = [("", "exact"), ("", "march"), ("", "harmonic"), (BENCH, "exact"), (BENCH, "harmonic")]


@pytest.mark.parametrize("friction, method", METHODS)
def test_exact_base_acceleration_is_zero_under_force_drive(friction, method):
    """Under a force the base acceleration is zero in the histories of every engine.

    Earlier five engines stored force over mass.
    """
    drive = '[drive]\nkind = "force"\nfrequency = "20 Hz"\nforce = "30 N"\ncycles = 2'
    r = pf.run(f"{friction}{MODES}{drive}", **{"accuracy.method": method}).response
    assert not r.base_acceleration.any() and r.acceleration.any()


@pytest.mark.parametrize(
    "text, description",
    [(f"{MODES}[drive]\n{keys}", description) for keys, description in DRIVES.items()]
    + [(f"{BENCH}[slide]\n{keys}", description) for keys, description in SLIDES.items()],
)
def test_exact_description_of_each_drive_and_slide(text, description):
    """The description of each drive and slide states its kind, amplitude and frequency."""
    assert describe_drive(tomllib.loads(pf.build(pf.load(text)).source.resolved)) == description
