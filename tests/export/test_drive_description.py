"""Description of the drive of a run, and captions and links of its page."""

import tomllib

import numpy as np
import pytest
from page_data import read_charts

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


def test_exact_description_of_recorded_and_absent_drive():
    """The description of a recorded drive names its file; a patch without a drive has an empty description."""
    assert describe_drive({"contact": {}}) == ""
    assert describe_drive({"slide": {"kind": "file", "file": "in/a.csv"}}) == "the slide of a.csv"
    assert (
        describe_drive({"drive": {"kind": "base", "waveform": "file", "file": "b.csv"}})
        == "recorded base acceleration of b.csv"
    )


def test_exact_page_states_drive_command_and_links(
    tmp_path,
):
    """The page states the drive and the command that repeats the run, and links measures and existing files."""
    (tmp_path / "swing.toml").write_text(
        f'title = "t"\n{MODES}[drive]\nkind = "force"\nfrequency = "20 Hz"\n'
        'force = "30 N"\ncycles = 20',
        "utf-8",
    )
    pf.run(tmp_path / "swing.toml", **{"drive.force": "31 N"}).save(tmp_path / "out")
    text = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "force of 31 N at 20 Hz" in text
    assert "<pre>patchfem run swing.toml --set &#39;drive.force=31 N&#39;</pre>" in text
    assert "fields.vtkhdf" not in text.split("<script")[0]
    assert str(tmp_path) not in text


@pytest.mark.parametrize("column, factor", [("force [N]", 1.0), ("friction_ratio [1]", 0.1)])
def test_exact_page_shows_measured_force_of_recorded_slide(tmp_path, column, factor):
    """The page of a recorded slide shows the measured force beside the computed one."""
    time = np.linspace(0.0, 1.0, 201)
    slide = 10 * np.sin(4 * np.pi * time)
    force = 2.5 * np.cos(4 * np.pi * time)
    (tmp_path / "loop.csv").write_text(
        f"time [s],displacement [um],{column}\n"
        + "\n".join(
            f"{t},{a!r},{b * factor!r}" for t, a, b in zip(time, slide.tolist(), force.tolist())
        ),
        "utf-8",
    )
    (tmp_path / "a.toml").write_text(BENCH + '[slide]\nkind = "file"\nfile = "loop.csv"', "utf-8")
    pf.run(tmp_path / "a.toml").save(tmp_path / "out")
    text = (tmp_path / "out" / "report.html").read_text("utf-8")
    computed, measured = read_charts(text)["Friction loop"]["data"]
    assert (computed["name"], measured["name"]) == ("loop friction force", "measured force")
    np.testing.assert_allclose(measured["x"], slide, atol=1e-5)
    np.testing.assert_allclose(measured["y"], force, atol=1e-6)
