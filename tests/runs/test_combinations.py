"""Combinations of friction laws and effects: scenes that `check` accepts run, and others are
refused with key and remedy.

Every law is combined with every effect of its kind of run and with every engine. A march counts as
run when its time loop would begin, so that nothing is compiled for it.
"""

from __future__ import annotations

import re
from itertools import product

import pytest
from scene_texts import COATED, DRIVE, MODE, SLIDE, get_only_mistake

from patchfem import SceneError
from patchfem.effects import LAWS
from patchfem.points import time_march
from patchfem.runs.run import run
from patchfem.scene import loads

VALUES = {
    "reference_speed": "1 mm/s",
    "bond_length": "1 um",
    "stiffness": "1e7 N/m",
    "chi": "-0.5",
    "beta": "0.5",
    "stribeck_speed": "1 mm/s",
    "kinetic": "0.2",
}
VARIANTS = {
    "nonlocal": [
        ["spread=1 um"],
        ["order=2"],
        ["order=0"],
        ["reading=report"],
        ["rest_growth=1 m/s^2", "slip_growth=1 um"],
    ],
    "coulomb": [["kinetic=0.2"]],
}
FEW_STEPS = "[accuracy]\nsteps_per_cycle = 32\n"
COULOMB_LAW = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
POINT = '[normal]\nload = "26 lbf"\n'
# The pressure of this patch is nearly uniform.
PATCH = COATED.replace('"0.5 mm"', '"1.5 mm"') + '[contact.crown]\nradius = "100 m"\n'
SHAKEN_MODE = MODE + DRIVE.replace("cycles = 30", "cycles = 2") + FEW_STEPS
SINE_SLIDE = SLIDE + "cycles = 1\n" + FEW_STEPS
FACE = '[[structure.interface]]\nbetween = [{}, 0]\nload = "100 N"\nlaw = "coulomb"\nstatic = 0.3\n'
MASSES = (
    '[structure]\nmasses = ["1 kg", "1 kg"]\n'
    + "".join(
        f'[[structure.spring]]\nbetween = [{pair}]\nstiffness = "1e6 N/m"\n'
        for pair in ("1, 0", "2, 1")
    )
    + FACE.format(1)
    + "{}"
    + DRIVE.replace("cycles = 30", "cycles = 2")
    + FEW_STEPS
)

BONDS = ["friction.law=nonlocal", "friction.bond_length=1 um"]
VARYING_LOAD = ["normal.amplitude=20 N", "normal.frequency=50 Hz"]
STIFFENING = ["structure.stiffening.cubic=1e10 N/m^3"]
INTERLOCK = ["structure.bonded.stiffness=1e5 N/m", "structure.bonded.wavelength=80 um"]
SHEAR, LOWER, STRIPS = ["contact.shear={}"], ["contact.crown.on=lower"], ["contact.strips.count=3"]
SKIN = ["contact.asperities.law=exponential", "contact.asperities.decay_length=1 um"]
YAW, PITCH = [*STRIPS, "structure.mode.axial.yaw=2 rad/m"], ["structure.mode.axial.pitch=1 rad/m"]
WAVEFORMS = [
    ["drive.waveform=step"],
    ["drive.kind=free", "drive.displacement=0.1 mm"],
    ["drive.waveform=levels", 'drive.levels=["3 g", "4 g"]'],
    ["drive.waveform=sweep", "drive.from=143 Hz", "drive.to=143.2 Hz", "drive.rate=10 Hz/s"],
]
METHODS = [[], *([f"accuracy.method={name}"] for name in ("exact", "march", "harmonic"))]
QUADRATURES = [[], *([f"accuracy.quadrature={name}"] for name in ("recursion", "direct", "merged"))]
# Kind of run: (text, table of the law, effects, engines).
RUNS = {
    "bench of a point": (
        POINT + COULOMB_LAW + SINE_SLIDE,
        "friction",
        [[], VARYING_LOAD],
        QUADRATURES,
    ),
    "bench of a patch": (
        PATCH + COULOMB_LAW + SINE_SLIDE,
        "friction",
        [[], SHEAR, LOWER, STRIPS, SKIN, SHEAR + LOWER],
        QUADRATURES,
    ),
    "rig of a point": (
        POINT + COULOMB_LAW + SHAKEN_MODE,
        "friction",
        [[], VARYING_LOAD, STIFFENING, INTERLOCK, *WAVEFORMS[:3]],
        METHODS,
    ),
    "rig of a patch": (
        PATCH + COULOMB_LAW + SHAKEN_MODE,
        "friction",
        [[], SHEAR, LOWER, STRIPS, YAW, PITCH, PITCH + SHEAR, STIFFENING + SHEAR],
        METHODS,
    ),
    "sums in a rig": (
        PATCH + COULOMB_LAW + SHAKEN_MODE,
        "friction",
        [[], LOWER, SHEAR],
        QUADRATURES[1:],
    ),
    "one interface": (MASSES.format(""), "structure.interface.0", [[], STIFFENING], METHODS),
    "interfaces": (
        MASSES.format(FACE.format(2)),
        "structure.interface.0",
        [[], STIFFENING],
        METHODS,
    ),
}


class TimeLoopReached(Exception):
    """Exception of a march that is ready to start its time loop."""


def raise_time_loop_reached(*_, **__):
    """Raise TimeLoopReached in place of the preparation of a time loop."""
    raise TimeLoopReached


def run_to_time_loop(scene) -> bool:
    """Return True if a scene runs, at least up to its time loop; a PatchfemError passes through."""
    try:
        run(scene, estimate=False)
    except TimeLoopReached:
        return True
    return True


def check_and_run(text: str, sets: list) -> str:
    """Return "refused" or "ran" for a scene; a refusal must name a key and a remedy."""
    try:
        scene = loads(text, "a.toml", sets)
    except SceneError as error:
        for message in error.mistakes:
            assert re.search(r": [a-z]+(\.[\w[\]-]+)+: ", message), message
            assert re.search(
                r"\b(use|leave|put|set|name|give|needed|choose|built|belongs)\b", message
            ), message
        return "refused"
    assert run_to_time_loop(scene)
    return "ran"


def assert_combinations_run(name: str, law: str, every: int) -> None:
    """Assert that a part of the combinations of a law with effects and engines runs, or is refused with a key and a remedy.

    Of the combinations, one in `every` is tried.
    """
    text, law_table, effects, engines = RUNS[name]
    law_keys = [
        f"law={law}",
        *(f"{key}={VALUES[key]}" for key in LAWS[law].keys[0].replace("|stiffness", "").split()),
    ]
    cases = [
        (variant, effect, engine)
        for variant in ([], *VARIANTS.get(law, ()))
        for effect, engine in product(effects, engines)
    ]
    offset = (
        list(RUNS).index(name) + list(LAWS).index(law)
    ) % every  # Each law and kind of run tests other combinations.
    outcomes = [
        check_and_run(
            text,
            [
                *(f"{law_table}.{assignment}" for assignment in (*law_keys, *variant)),
                *effect,
                *engine,
            ],
        )
        for variant, effect, engine in cases[:1] + cases[1 + offset :: every]
    ]
    assert "ran" in outcomes or (
        name == "interfaces" and "joints" not in LAWS[law].supports.split()
    )


@pytest.fixture
def stop_at_time_loop(monkeypatch):
    """Stop a march where its time loop would begin."""
    monkeypatch.setattr(time_march, "march", raise_time_loop_reached)


@pytest.mark.usefixtures("stop_at_time_loop")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", RUNS)
def test_always_accepted_combinations_run(name, law):
    """A part of the combinations of each law with effects and engines runs if `check` accepts it."""
    assert_combinations_run(name, law, 36)


@pytest.mark.usefixtures("stop_at_time_loop")
@pytest.mark.share(0, 1)
@pytest.mark.parametrize("effect", [[], STIFFENING, INTERLOCK])
def test_always_accepted_combinations_without_friction_run(effect):
    """Rigs without friction run with every effect, waveform and method that `check` accepts."""
    outcomes = [
        check_and_run(SHAKEN_MODE, [*effect, *wave, *method])
        for wave in ([], *WAVEFORMS)
        for method in METHODS
    ]
    assert {"ran", "refused"} == set(outcomes)


@pytest.mark.parametrize(
    "text, sets, key, reason",
    [
        (
            PATCH + COULOMB_LAW + SHAKEN_MODE,
            [*BONDS, *LOWER, "accuracy.quadrature=merged"],
            "accuracy.quadrature",
            "'merged' with a shape on the lower piece is not supported yet",
        ),
        (
            MASSES.format(FACE.format(2)),
            ["structure.interface.1.law=convolution", "structure.interface.1.bond_length=1 um"],
            "structure.interface[2].law",
            "law 'convolution' with other interfaces is not supported",
        ),
        (
            MASSES.format(FACE.format(2)),
            [
                "structure.interface.1.law=tanh",
                "structure.interface.1.reference_speed=1 mm/s",
                "accuracy.method=harmonic",
            ],
            "accuracy.method",
            "'harmonic' with several inter",
        ),
    ],
)
def test_refuses_unsupported_combinations_at_check(text, sets, key, reason):
    """`check` refuses combinations that only a run could detect in earlier versions."""
    message = get_only_mistake(text, *sets)
    assert message.startswith(f"--set: {key}: ") and reason in message
