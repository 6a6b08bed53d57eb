"""Histories that a run stores, and its outcome, for every engine and drive."""

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, MODE, NONLOCAL, PLASTIC, POINT

from patchfem.core import G_N, Outcome
from patchfem.runs.run import run
from patchfem.scene import loads

SECOND = """\
[[structure.mode]]
name = "second"
frequency = "990 Hz"
damping = 0.01
slide = 0.4
base = 0.0
output = 0.3
"""
COULOMB_POINT = POINT + COULOMB
SOFT_POINT = POINT + PLASTIC.replace("1 um", "3 um")
BOND_POINT = POINT + NONLOCAL.replace("1 um", "3 um")
TANH_POINT = POINT + '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"\n'
SINE = DRIVE.replace("5 g", "6 g")
LEVELS = '[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\nlevels = ["3 g", "6 g"]\ncycles = 15\n'
RELEASE = '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\nduration = "0.1 s"\n'
SHORT_RELEASE = '[drive]\nkind = "free"\ndisplacement = "0.3 mm"\nduration = "1 ms"\n'
STEP = '[drive]\nkind = "force"\nwaveform = "step"\nforce = "100 N"\nduration = "0.1 s"\n'
SWEEP = (
    '[drive]\nkind = "base"\nwaveform = "sweep"\nfrom = "135 Hz"\nto = "150 Hz"\nrate = "60 Hz/s"\n'
    'acceleration = "6 g"\n'
)
FILE_DRIVE = '[drive]\nkind = "base"\nwaveform = "file"\nfile = "signal.csv"\n'
ENGINES = {
    "exact": COULOMB_POINT + MODE,
    "exact two modes": COULOMB_POINT + MODE + SECOND,
    "march coulomb": COULOMB_POINT + MODE,
    "march plastic": SOFT_POINT + MODE,
    "march bonds": BOND_POINT + MODE + SECOND,
    "march tanh": TANH_POINT + MODE,
}
DRIVES = {
    "sine": SINE,
    "levels": LEVELS,
    "release": RELEASE,
    "short release": SHORT_RELEASE,
    "step": STEP,
    "sweep": SWEEP,
    "file": FILE_DRIVE,
}


@pytest.fixture(scope="module")
def run_case(tmp_path_factory):
    """Return a function (engine, drive) -> (scene, Result) that runs each case once."""
    folder = tmp_path_factory.mktemp("histories")
    results = {}
    time = np.linspace(0, 0.1, 800)
    value = 6 * G_N * np.sin(2 * np.pi * (130 * time + 100 * time**2))
    rows = "\n".join(f"{t:.9g},{a:.9g}" for t, a in zip(time, value))
    (folder / "signal.csv").write_text("time [s],acceleration [m/s^2]\n" + rows + "\n", "utf-8")

    def run_once(engine, drive):
        if (engine, drive) not in results:
            settings = []
            if engine.startswith("march"):
                settings = ["accuracy.method=march"]
            path = folder / "scene.toml"
            path.write_text(ENGINES[engine] + DRIVES[drive], "utf-8")
            from patchfem.scene import load

            scene = load(path, settings)
            results[engine, drive] = scene, run(scene, estimate=False)
        return results[engine, drive]

    return run_once


CASES = [(engine, drive) for engine in ENGINES for drive in DRIVES]


@pytest.mark.share(0, 4, 10, 17, 22, 26, 34, 41)
@pytest.mark.parametrize(("engine", "drive"), CASES)
def test_always_last_two_cycles_have_hundred_samples_each(run_case, engine, drive):
    """A history contains the start, the end, and at least 100 samples per cycle of the last two
    cycles."""
    _, result = run_case(engine, drive)
    r = result.response
    sine = result.plan.model.rig.drive.signal
    end = result.window.time[-1]
    assert np.all(np.diff(r.time) > 0) and r.time[0] == 0 and r.time[-1] == end
    assert r.time.size >= 100
    start = max(0.0, end - 2 * sine.period)
    last_times = r.time[r.time >= start * (1 - 1e-9)]
    assert last_times.size >= 100 * (end - start) / sine.period
    assert last_times[0] - start < 1e-6 * sine.period and np.diff(
        last_times
    ).max() <= sine.period / 100 * (1 + 1e-6)


@pytest.mark.parametrize("engine", ["exact two modes", "march bonds", "hybrid"])
def test_always_release_history_has_uniform_samples(run_case, engine):
    """The history of a release has at least 20 samples per cycle from its start; an earlier version
    stored only reversals before the last cycles."""
    if engine == "hybrid":
        result = run(loads(TANH_POINT + MODE + RELEASE), estimate=False)
        assert result.extra["engine"] == "hybrid"
    else:
        _, result = run_case(engine, "release")
    r = result.response
    period = result.plan.model.rig.drive.signal.period
    assert r.time[0] == 0 and r.time[-1] == result.window.time[-1] and (np.diff(r.time) > 0).all()
    assert np.diff(r.time).max() <= period / 20 * (1 + 1e-6)
    # The cubic Hermite interpolant between two samples stays close to a straight line.
    middle = (r.output[1:] + r.output[:-1]) / 2 + np.diff(r.time) * (
        r.output_rate[:-1] - r.output_rate[1:]
    ) / 8
    linear = np.interp((r.time[1:] + r.time[:-1]) / 2, r.time, r.output)
    assert np.abs(middle - linear).max() < 2e-2 * np.abs(r.output).max()


def test_exact_outcomes_of_drives():
    """The outcome depends on the drive: for example, a release with friction sticks, a sweep is
    never steady and never grows, and a drive below the friction limit leaves the block stuck."""
    outcomes = {
        (COULOMB_POINT + MODE + RELEASE): "stuck",
        (MODE + RELEASE): "transient",
        (MODE.replace("0.003", "0.3") + RELEASE): "steady",
        (COULOMB_POINT + MODE + STEP.replace("0.1 s", "0.5 s")): "stuck",
        (MODE.replace("0.003", "0.3") + STEP): "steady",
        (COULOMB_POINT + MODE + SWEEP): "transient",
        (MODE + SWEEP.replace("135 Hz", "100 Hz").replace('"150 Hz"', '"143 Hz"')): "transient",
        (COULOMB_POINT + MODE + SWEEP.replace("6 g", "3 g")): "stuck",
        (COULOMB_POINT + MODE + LEVELS): "transient",
        (
            COULOMB_POINT
            + MODE
            + LEVELS.replace('"3 g", "6 g"', '"6 g", "3 g"').replace("15", "80")
        ): "stuck",
        (SOFT_POINT + MODE + RELEASE): "stuck",
        (TANH_POINT + MODE + RELEASE.replace("0.1 s", "1 s")): "steady",
    }
    for text, outcome in outcomes.items():
        result = run(loads(text), estimate=False)
        assert result.outcome == outcome, (text, result.outcome)
        if result.outcome is Outcome.TRANSIENT and "sweep" in text:
            assert any("changes until the end" in line for line in result.warnings)
            assert "relative_displacement_amplitude_steady" not in result.measures
