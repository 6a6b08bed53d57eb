"""The expected cost of the exact engine, and the choice of the engine."""

from importlib.resources import files

import numpy as np
import pytest
from scene_runs import run_scene
from scene_texts import COULOMB, DRIVE, MODE, POINT

import patchfem as pf

LIMIT = 0.3 * 26 * 4.4482216152605
SLOW = POINT + COULOMB + MODE + DRIVE.replace("5 g", "18 g").replace("= 30", "= 12")


@pytest.mark.parametrize("changes", ["", "; friction.kinetic=0.2"])
def test_exact_spring_block_under_slow_drive(changes):
    """The amplitude and the loop area of a spring and block under a slow drive agree with the
    closed form, and the energy balance closes."""
    measures = run_scene(SLOW, "drive.frequency=0.01 Hz" + changes).measures
    expected = (18 * 9.80665 - LIMIT / 0.884) / (2 * np.pi * 143) ** 2
    if not changes:
        assert measures["relative_displacement_amplitude"].value == pytest.approx(
            expected, rel=1e-5
        )
        assert measures["loop_area"].value == pytest.approx(4 * LIMIT * expected, rel=1e-5)
    assert measures["energy_balance"].value < 1e-7


def test_exact_averaged_law_with_extreme_damping_is_marched():
    """With a damping ratio of 2e9, the averaged law is too stiff for exact events. The march is
    chosen, and the friction force reaches mu_s N."""
    changes = (
        "friction.law=convolution; friction.bond_length=1 nm; structure.mode.axial.damping=2e9"
    )
    result = run_scene(SLOW, f"{changes}; drive.frequency=56.75 Hz")
    assert result.settings.engine == "march"
    force = result.measures["friction_force_peak"]
    assert abs(force.value - LIMIT) <= force.error <= 1e-8 * force.value


def test_exact_block_on_a_heavy_frame_is_solved_from_event_to_event():
    """The force on a heavy frame does not act on the light block that it rubs, so that the bristles of the block do not
    make the motion expensive. The motion from event to event and the march agree within the error of the march."""
    scene = (files(pf) / "scene/templates/joint_laws/lugre.toml").read_text("utf-8")
    runs = {
        method: pf.run(scene, **{"accuracy.method": method})
        for method in ("auto", "exact", "march")
    }
    engines = [result.settings.engine for result in runs.values()]
    assert engines == ["event_driven", "event_driven", "march"]
    for name in ("relative_displacement_amplitude", "loop_area", "stick_fraction"):
        auto, exact, march = (result.measures[name] for result in runs.values())
        assert abs(auto.value - exact.value) <= auto.error + exact.error
        assert abs(march.value - exact.value) <= march.error
        assert auto.error < march.error / 100
