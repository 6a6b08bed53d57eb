"""Rigs of masses with one and two interfaces through the command line: files, events, exact engine
and march."""

import json

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli

from patchfem.response import EVENT_KIND_NAMES
from patchfem.runs.run import run
from patchfem.scene import loads

FIG16 = f"""\
[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 2]
stiffness = "1 N/m"
[[structure.interface]]
between = [2, 0]
law = "coulomb"
static = 0.3
load = "10 N"
[drive]
kind = "force"
mass = 1
force = "1 N"
frequency = "{1.14 / (2 * np.pi)!r} Hz"
duration = "400 s"
"""
INTERFACE = """\
[[structure.interface]]
between = [{0}, {1}]
law = "coulomb"
static = 0.3
load = "{2} N"
"""
CHAIN = (
    """\
[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "4 N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "0.3 N s/m"
"""
    + INTERFACE.format(1, 0, 0.5)
    + INTERFACE.format(2, 1, 1.2)
    + """\
[drive]
kind = "base"
acceleration = "1 m/s^2"
frequency = "0.1 Hz"
cycles = 60
"""
)


@pytest.fixture(scope="module")
def run_scene(tmp_path_factory):
    """Return a function (scene text, *words) -> (summary, dataset) that runs each scene once
    through the command line."""
    base = tmp_path_factory.mktemp("interfaces")
    results = {}

    def run_once(text, *arguments):
        if (text, arguments) not in results:
            path = base / f"scene{len(results)}.toml"
            path.write_text(text, "utf-8")
            answer = run_cli("run", path, "-o", base / path.stem, "--json", *arguments)
            assert answer.code == 0, answer.err
            with xr.open_dataset(base / path.stem / "result.nc") as data:
                results[text, arguments] = json.loads(answer.out), data.load()
        return results[text, arguments]

    return run_once


def test_exact_figure_16_of_the_report(run_scene):
    """Mass 2 stays at rest until t = 8.0797, and the friction force never exceeds 3 N (reference: a
    computation with 40 digits)."""
    summary, data = run_scene(FIG16, "--set", "accuracy.method=exact")
    slide = data.slide
    after_release = data.time > 8.079711463905416 + 1e-9
    assert np.abs(slide.values[~after_release.values]).max() < 1e-14
    assert np.abs(slide.values[after_release.values]).max() > 0.5
    assert np.abs(data.friction_force).max() <= 3 * (1 + 1e-12)
    stops = data.event_kind.values == EVENT_KIND_NAMES.index("stop")
    assert data.event_time.values[0] == pytest.approx(8.079711463905416, abs=1e-10)
    assert data.event_time.values[stops][:3] == pytest.approx(
        [10.00410372419476, 12.96534318337974, 15.73725378200728], abs=1e-10
    )
    assert data.event_slide.values[stops][:3] == pytest.approx(
        [0.8994115234033145, -0.5914209838254593, 0.8835834423211487], abs=1e-10
    )
    assert float(slide[-1]) == pytest.approx(-0.37952939486, abs=1e-9) and float(
        data.time[-1]
    ) == pytest.approx(400)
    assert data.relative_displacement.dims == ("time",) and summary["outcome"] in (
        "steady",
        "transient",
    )


def test_exact_slip_of_second_interface_alone_is_not_stuck():
    """With a hundred times the normal load the first interface sticks and only the second slips;
    the outcome is not `stuck`, in both engines."""
    text = CHAIN.replace('"0.5 N"', '"50 N"')
    for settings in ((), ("accuracy.method=march",)):
        result = run(loads(text, sets=["drive.cycles=20", *settings]), estimate=False)
        assert result.outcome != "stuck" and result.measures["slip_amplitude"].value < 1e-12
        assert result.measures["slip_amplitude_2"].value > 0.01
        assert result.measures["stick_fraction"].value == pytest.approx(1)
