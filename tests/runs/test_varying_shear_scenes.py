"""Scenes of coated pieces that give way in shear while pitch and heave change their load."""

import numpy as np
import pytest
from scene_texts import RIG

from patchfem import plan
from patchfem.runs.run import run
from patchfem.scene import loads

MOVING = RIG.replace("slide = 0.8", 'slide = 0.8\nnormal = 0.02\npitch = "5 rad/m"')
MOVING = MOVING.replace("cycles = 200", "cycles = 12")
MOVING = MOVING.replace("slide = 0.1", 'slide = 0.1\nnormal = 0.3\npitch = "40 rad/m"')
SETS = ["contact.element_size=200 um", "accuracy.steps_per_cycle=200", "contact.shear={}"]
PLASTIC = "friction.law=elastic-plastic"
SKIN = 'contact.asperities={law="linear", normal_stiffness="2e14 Pa/m", tangential_ratio=0.8}'


def result_of(*sets, estimate=False):
    return run(loads(MOVING, "a.toml", sets), estimate=estimate)


def amplitude(found) -> float:
    return found.measures["relative_displacement_amplitude"].value


@pytest.mark.share(0)
@pytest.mark.parametrize("law", ["friction.law=nonlocal", PLASTIC])
def test_order_the_amplitude_settles_with_the_number_of_modes(law):
    """Against all 65 modes: 8 modes within 3e-4, 32 within 1e-5, and a piece rigid in shear is far off."""
    found = {k: result_of(*SETS, law, f"accuracy.shear_modes={k}") for k in (8, 32, 65)}
    near = [abs(amplitude(found[k]) / amplitude(found[65]) - 1) for k in (8, 32)]
    assert near[0] <= 3e-4 and near[1] <= 1e-5 and near[1] < near[0]
    assert abs(amplitude(result_of(*SETS[:2], law)) / amplitude(found[65]) - 1) > 3e-3
    for one in found.values():
        assert one.measures["energy_balance"].value <= 1e-10
        assert one.measures["energy_created"].value == 0
        assert np.ptp(one.response.extra["normal_load"]) > 0.5 * one.patch.pressure.load


def test_exact_fields_of_a_patch_with_shear():
    """The holder's slide is slip, what the pieces take of the compliance itself and the stretch of the springs, which
    is at most that of springs of stiffness mu sigma/eps_0; friction keeps below mu of the pressure there."""
    found = result_of(*SETS, PLASTIC, "accuracy.shear_modes=65")
    fields = found.fields
    weight = found.patch.pieces.interface.weight
    seen = 0
    for tau, sigma, slip, slide in zip(
        *(fields[key][1:] for key in ("shear_stress", "normal_stress", "slip", "holder_slide"))
    ):
        on = sigma > 0
        assert (np.abs(tau) <= 0.3 * sigma * (1 + 1e-12)).all()
        stretch = (slide - slip - found.patch.giving @ (tau * weight))[on] / (
            1e-6 * tau[on] / (0.3 * sigma[on])
        )
        assert (stretch > 0).all() and stretch.max() <= 1 + 1e-6
        seen += on.sum()
    assert seen > 100


def test_exact_a_run_names_its_tangential_modes_and_bounds_their_error():
    """A sentence names how many modes stand for what gives way; half as many, coarser steps and a coarser mesh give the
    error of every measure."""
    found = result_of(*SETS, SKIN, estimate=True)
    said = [line for line in found.warnings if "tangential modes" in line]
    assert len(said) == 1 and said[0].startswith(
        "[contact.shear]: the normal load changes with the"
    )
    main = found.measures["relative_displacement_amplitude"]
    assert 0 < main.error < 0.1 * main.value
    planned = plan(loads(MOVING, "a.toml", [*SETS, SKIN, PLASTIC]))
    assert [line for line in planned.verdict if "tangential modes" in line] and planned.unknowns[
        "shear_modes"
    ] == 4
    assert not [
        line for line in plan(loads(RIG, "a.toml", SETS)).verdict if "tangential modes" in line
    ]
    assert not [
        line
        for line in run(loads(RIG, "a.toml", [*SETS, "drive.cycles=4"]), estimate=False).warnings
        if "tangential modes" in line
    ]


def test_exact_the_spring_of_the_holder_is_one_mode():
    """A tangential spring before a rigid piece: one mode whatever is asked, and the answer of a stiff one is that
    without it."""
    stiff, none = (
        result_of(*SETS[:2], *more)
        for more in (["contact.holder.tangential_stiffness=1e14 N/m"], [])
    )
    assert amplitude(stiff) == pytest.approx(amplitude(none), rel=1e-5)
    one, many = (
        result_of(
            *SETS[:2], "contact.holder.tangential_stiffness=2e7 N/m", f"accuracy.shear_modes={k}"
        )
        for k in (1, 16)
    )
    assert amplitude(one) == amplitude(many) and abs(amplitude(one) / amplitude(none) - 1) > 0.01
