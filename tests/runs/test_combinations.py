"""Combinations of friction laws and effects: scenes that `check` accepts run, and others are refused with key and remedy.

Every law is combined with effects of its kind of run and with every engine. A march counts as run when its time loop
would begin, so that nothing is compiled for it.
"""

from itertools import product

import pytest
from scene_runs import assert_names_key_and_remedy, load_scene, run_scene
from scene_texts import COATED, COULOMB, DRIVE, MODE, POINT, SLIDE

from patchfem import SceneError
from patchfem.effects import LAWS
from patchfem.time_steps import time_march

KEYS = {
    "reference_speed": "1 mm/s",
    "bond_length": "1 um",
    "stiffness": "1e7 N/m",
    "chi": "-0.5",
    "beta": "0.5",
    "stribeck_speed": "1 mm/s",
    "kinetic": "0.2",
}
VARIANTS = {
    "nonlocal": (
        "spread=1 um",
        "order=2",
        "reading=report",
        "rest_growth=1 m/s^2; {}.slip_growth=1 um",
    ),
    "coulomb": ("kinetic=0.2",),
}
# The pressure of this patch is nearly uniform.
PATCH = COATED.replace('"0.5 mm"', '"1.5 mm"') + '[contact.crown]\nradius = "100 m"\n'
RIG = COULOMB + MODE + DRIVE.replace("30", "2") + "[accuracy]\nsteps_per_cycle = 32\n"
BENCH = COULOMB + SLIDE + "cycles = 1\n[accuracy]\nsteps_per_cycle = 32\n"
FACE = '[[structure.interface]]\nbetween = [{}, 0]\nload = "100 N"\nlaw = "coulomb"\nstatic = 0.3\n'
MASSES = (
    '[structure]\nmasses = ["1 kg", "1 kg"]\n[[structure.spring]]\nbetween = [1, 0]\nstiffness = "1e6 N/m"\n'
    '[[structure.spring]]\nbetween = [2, 1]\nstiffness = "1e6 N/m"\n' + FACE.format(1)
)
TAIL = RIG[RIG.index("[drive]") :]
LOAD = "normal.amplitude=20 N; normal.frequency=50 Hz"
CUBIC = "structure.stiffening.cubic=1e10 N/m^3"
INTERLOCK = "structure.bonded.stiffness=1e5 N/m; structure.bonded.wavelength=80 um"
SHEAR, LOWER, AREA = "contact.shear={}", "contact.crown.on=lower", "contact.area.cells=32"
SKIN = "contact.asperities.law=exponential; contact.asperities.decay_length=1 um"
WAVEFORMS = (
    "drive.waveform=step",
    "drive.kind=free; drive.displacement=0.1 mm",
    'drive.waveform=levels; drive.levels=["3 g", "4 g"]',
)
METHODS = ["", *(f"accuracy.method={name}" for name in ("exact", "march", "harmonic"))]
SUMS = ["", *(f"accuracy.quadrature={name}" for name in ("recursion", "direct", "merged"))]
PITCH, YAW = "structure.mode.axial.pitch=1 rad/m", "structure.mode.axial.yaw=2 rad/m; " + AREA
RUNS = {  # Kind of run: text, table of the law, effects and engines.
    "bench of a point": (POINT + BENCH, "friction", ("", LOAD), SUMS),
    "bench of a patch": (PATCH + BENCH, "friction", ("", SHEAR, LOWER, AREA, SKIN), SUMS),
    "rig of a point": (
        POINT + RIG,
        "friction",
        ("", LOAD, CUBIC, INTERLOCK, *WAVEFORMS),
        METHODS + SUMS,
    ),
    "rig of a patch": (
        PATCH + RIG,
        "friction",
        ("", SHEAR, LOWER, YAW, PITCH, f"{PITCH}; {SHEAR}", f"{CUBIC}; {SHEAR}"),
        METHODS + SUMS,
    ),
    "one interface": (MASSES + TAIL, "structure.interface.0", ("", CUBIC), METHODS),
    "interfaces": (
        MASSES + FACE.format(2) + TAIL,
        "structure.interface.0",
        ("", CUBIC),
        METHODS,
    ),
}
METHODS_OF_ENGINES = {"exact": "event_driven", "march": "march", "harmonic": "harmonic"}


class TimeLoopReached(Exception):
    """Exception of a march that is ready to start its time loop."""


def list_combinations(name: str, law: str) -> list[str]:
    """Return the changes that combine each variant of a law with each effect and engine of a kind of run."""
    _, table, effects, engines = RUNS[name]
    keys = LAWS[law].keys[0].replace("|stiffness", "").split()
    law_changes = "; ".join(
        f"{table}.{key}" for key in (f"law={law}", *(f"{key}={KEYS[key]}" for key in keys))
    )
    variants = ["", *(f"; {table}.{one.format(table)}" for one in VARIANTS.get(law, ()))]
    return [
        f"{law_changes}{variant}; {effect}; {engine}"
        for variant, effect, engine in product(variants, effects, engines)
    ]


def is_accepted(text: str, changes: str) -> bool:
    """Return whether a scene can be loaded; a refusal must name a key and a remedy."""
    try:
        load_scene(text, changes)
    except SceneError as error:
        for message in error.mistakes:
            assert_names_key_and_remedy(message)
        return False
    return True


def run_to_time_loop(text: str, changes: str) -> None:
    """Run a scene, or begin its march, with the engine that it asks for."""
    method = changes.partition("accuracy.method=")[2]
    try:
        result = run_scene(text, changes, estimate=False)
    except TimeLoopReached:
        assert method in ("", "march"), changes
    else:
        assert result.measures, changes
        assert not method or result.settings.engine == METHODS_OF_ENGINES[method], changes


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", RUNS)
def test_always_accepted_combinations_run(name, law, monkeypatch):
    """A part of the combinations of each law with effects and engines runs if `check` accepts it."""

    def stop(*arguments, **options):
        raise TimeLoopReached

    monkeypatch.setattr(time_march, "march", stop)
    text = RUNS[name][0]
    # Each law and kind of run tests other combinations.
    offset = (list(RUNS).index(name) + list(LAWS).index(law)) % 36
    cases = list_combinations(name, law)
    accepted = [case for case in cases[:1] + cases[1 + offset :: 36] if is_accepted(text, case)]
    assert accepted or law == "convolution"
    for case in accepted:
        run_to_time_loop(text, case)
