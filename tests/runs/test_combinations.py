"""What `check` lets through runs, and what it refuses it refuses at a key and with a remedy: laws beside effects.

Every law stands beside every effect of its kind of run and every engine. A march counts as run where its time loop
would begin, so that nothing is compiled for it.
"""

from __future__ import annotations

import re
from itertools import product

import pytest
from scene_texts import COATED, DRIVE, MODE, SLIDE, only

from patchfem import SceneError
from patchfem.dynamics.march import march
from patchfem.effects import LAWS
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
        ["breakaway=0.2"],
        ["rest_growth=1 m/s^2", "slip_growth=1 um"],
    ],
    "coulomb": [["kinetic=0.2"]],
}
FEW = "[accuracy]\nsteps_per_cycle = 32\n"
RUBS = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
POINT = '[normal]\nload = "26 lbf"\n'
# its pressure is even
PATCH = COATED.replace('"0.5 mm"', '"1.5 mm"') + '[contact.crown]\nradius = "100 m"\n'
SHAKEN = MODE + DRIVE.replace("cycles = 30", "cycles = 2") + FEW
SLID = SLIDE + "cycles = 1\n" + FEW
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
    + FEW
)

BONDS = ["friction.law=nonlocal", "friction.bond_length=1 um"]
SWING = ["normal.amplitude=20 N", "normal.frequency=50 Hz"]
STIFFENS = ["structure.stiffening.cubic=1e10 N/m^3"]
INTERLOCKS = ["structure.bonded.stiffness=1e5 N/m", "structure.bonded.wavelength=80 um"]
SHEAR, LOWER, STRIPS = ["contact.shear={}"], ["contact.crown.on=lower"], ["contact.strips.count=3"]
SKIN = ["contact.asperities.law=exponential", "contact.asperities.decay_length=1 um"]
YAW, PITCH = [*STRIPS, "structure.mode.axial.yaw=2 rad/m"], ["structure.mode.axial.pitch=1 rad/m"]
WAVES = [
    ["drive.waveform=step"],
    ["drive.kind=free", "drive.displacement=0.1 mm"],
    ["drive.waveform=levels", 'drive.levels=["3 g", "4 g"]'],
    ["drive.waveform=sweep", "drive.from=143 Hz", "drive.to=143.2 Hz", "drive.rate=10 Hz/s"],
]
METHODS = [[], *([f"accuracy.method={name}"] for name in ("exact", "march", "harmonic"))]
SUMS = [[], *([f"accuracy.quadrature={name}"] for name in ("recursion", "direct", "merged"))]
# kind of run -> (text, table of the law, effects, engines)
RUNS = {
    "bench of a point": (POINT + RUBS + SLID, "friction", [[], SWING], SUMS),
    "bench of a patch": (
        PATCH + RUBS + SLID,
        "friction",
        [[], SHEAR, LOWER, STRIPS, SKIN, SHEAR + LOWER],
        SUMS,
    ),
    "rig of a point": (
        POINT + RUBS + SHAKEN,
        "friction",
        [[], SWING, STIFFENS, INTERLOCKS, *WAVES[:3]],
        METHODS,
    ),
    "rig of a patch": (
        PATCH + RUBS + SHAKEN,
        "friction",
        [[], SHEAR, LOWER, STRIPS, YAW, PITCH, PITCH + SHEAR, STIFFENS + SHEAR],
        METHODS,
    ),
    "sums in a rig": (PATCH + RUBS + SHAKEN, "friction", [[], LOWER, SHEAR], SUMS[1:]),
    "one interface": (MASSES.format(""), "structure.interface.0", [[], STIFFENS], METHODS),
    "interfaces": (MASSES.format(FACE.format(2)), "structure.interface.0", [[], STIFFENS], METHODS),
}


class Reached(Exception):
    """A march has everything that its time loop needs."""


def reached(*_):
    raise Reached


def ran(scene) -> bool:
    """Whether a scene runs; a PatchfemError passes through."""
    try:
        run(scene, estimate=False)
    except Reached:
        return True
    return True


def walk(text: str, sets: list) -> str:
    """ "refused" or "ran"; a refusal must name a key and what to do."""
    try:
        scene = loads(text, "a.toml", sets)
    except SceneError as error:
        for message in error.mistakes:
            assert re.search(r": [a-z]+(\.[\w[\]-]+)+: ", message), message
            assert re.search(
                r"\b(use|leave|put|set|name|give|needed|choose|built|belongs)\b", message
            ), message
        return "refused"
    assert ran(scene)
    return "ran"


def walked(name: str, law: str, every: int) -> None:
    """What check lets through of the effects and engines beside a law runs; every: the share of them that is tried."""
    text, at, effects, engines = RUNS[name]
    needed = [
        f"law={law}",
        *(f"{key}={VALUES[key]}" for key in LAWS[law].keys[0].replace("|stiffness", "").split()),
    ]
    cases = [
        (variant, effect, engine)
        for variant in ([], *VARIANTS.get(law, ()))
        for effect, engine in product(effects, engines)
    ]
    first = (
        list(RUNS).index(name) + list(LAWS).index(law)
    ) % every  # another share for each law and kind
    found = [
        walk(text, [*(f"{at}.{one}" for one in (*needed, *variant)), *effect, *engine])
        for variant, effect, engine in cases[:1] + cases[1 + first :: every]
    ]
    assert "ran" in found or (name == "interfaces" and "joints" not in LAWS[law].supports.split())


@pytest.fixture
def stopped_at_the_time_loop(monkeypatch):
    """A march ends where its time loop would begin."""
    monkeypatch.setattr(march, "warm_up", reached)


@pytest.mark.usefixtures("stopped_at_the_time_loop")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", RUNS)
def test_always_a_share_of_what_check_lets_through_runs(name, law):
    walked(name, law, 9)


@pytest.mark.usefixtures("stopped_at_the_time_loop")
@pytest.mark.share(0, 1)
@pytest.mark.parametrize("effect", [[], STIFFENS, INTERLOCKS])
def test_always_what_check_lets_through_runs_without_friction(effect):
    found = [walk(SHAKEN, [*effect, *wave, *method]) for wave in ([], *WAVES) for method in METHODS]
    assert {"ran", "refused"} == set(found)


@pytest.mark.parametrize(
    "text, sets, key, says",
    [
        (
            SHAKEN,
            [*STIFFENS, "accuracy.method=exact"],
            "accuracy.method",
            "exists with [structure.stiffening]; use 'mar",
        ),
        (
            POINT + RUBS + SHAKEN,
            [*BONDS, "friction.breakaway=0.2", "accuracy.quadrature=direct"],
            "accuracy.quadrature",
            "'direct' with friction.breakaway in a rig is not supported yet; use 'recursion' or 'auto'",
        ),
        (
            PATCH + RUBS + SHAKEN,
            [*BONDS, *LOWER, "accuracy.quadrature=merged"],
            "accuracy.quadrature",
            "'merged' with a shape on the lower piece in a rig is not supported yet",
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
def test_refuses_at_check_what_only_a_run_knew(text, sets, key, says):
    message = only(text, *sets)
    assert message.startswith(f"--set: {key}: ") and says in message
