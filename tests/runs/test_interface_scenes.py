"""Two masses with an interface, as in figure 16 of the report: events and motion to ten digits."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.measures import EVENT_KIND_NAMES

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


def test_exact_figure_16_of_the_report():
    """Mass 2 stays at rest until t = 8.0797, and the friction force never exceeds 3 N (reference: a
    computation with 40 digits)."""
    result = pf.run(FIG16, **{"accuracy.method": "exact"})
    data = result.to_xarray()
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
    assert float(slide[-1]) == pytest.approx(-0.37952939486, abs=1e-9)
