"""Models of cases that differ in plain numbers, made from the first of them, beside those built from their text."""

from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, MODE, POINT, SECOND

from patchfem.campaigns.sweeps.asked import Asked
from patchfem.core import PatchfemError
from patchfem.scene.changed import PLAIN

PLASTIC = '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"\n'
UNITS = {"load": "N", "bond_length": "m", "acceleration": "m/s^2", "frequency": "Hz", "moving_mass": "kg"}
KEYS = [key.replace("mode.", f"mode.{mode}.") for key in PLAIN for mode in ("axial", "1")]
RIG = MODE + SECOND + DRIVE
SCENES = {"coulomb": POINT + COULOMB + RIG, "elastic-plastic": POINT + PLASTIC + RIG,
          "weakening": POINT + COULOMB + "kinetic = 0.2\n" + RIG,
          "two loads": POINT + 'amplitude = "3 N"\nfrequency = "70 Hz"\n' + COULOMB + RIG,
          "duration": POINT + COULOMB + RIG.replace("cycles = 30", 'duration = "0.3 s"'),
          "bonded": POINT + COULOMB + RIG + '[structure.bonded]\nstiffness = "1e5 N/m"\n',
          "start": POINT + COULOMB + RIG + '[structure.start]\nvelocity = ["0.1 m/s", "0 m/s"]\n'}


def same(a, b) -> bool:
    """Whether two parts of models are equal in all they hold, to the bit."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if is_dataclass(a):
        return all(same(getattr(a, one.name), getattr(b, one.name)) for one in fields(a) if one.name != "write") and \
            (not hasattr(a, "resolved") or a.resolved == b.resolved)
    return a == b and repr(a) == repr(b)


def told(asked: Asked, sets: tuple, values: tuple):
    """The model of a case, or the sentence why there is none."""
    try:
        return asked.model(sets, values)
    except PatchfemError as error:
        return str(error)


def cases_of(seed: int, count: int):
    """(sets, values) of random cases over random keys, some with values that no scene takes or that a rule sees."""
    r = np.random.default_rng(seed)
    while count > 0:
        keys = list(r.choice(KEYS, r.integers(1, 5), replace=False))
        keys = [key for k, key in enumerate(keys) if not any(other.replace(".1.", ".axial.") == key.replace(
            ".1.", ".axial.") for other in keys[:k])]
        for _ in range(min(count, 5)):
            values = tuple(float(r.choice([10.0 ** r.uniform(-3, 2), 0.0, -1.0, 0.7], p=[0.8, 0.07, 0.06, 0.07]))
                           for _ in keys)
            units = [UNITS.get(key.rpartition(".")[2], "") for key in keys]
            yield tuple(f"{key}={value!r} {unit}".strip() for key, value, unit in zip(keys, values, units)), values
            count -= 1


@pytest.mark.parametrize("name", SCENES)
def test_exact_models_made_from_the_first_are_those_built_from_text(name):
    asked, alike = Asked(Path("a.toml"), SCENES[name], ("normal.load=20 N",)), 0
    for sets, values in cases_of(len(name), 60):
        found, built = told(asked, sets, values), told(asked, sets, ())
        assert same(found, built), sets
        alike += asked._like(sets, values) is not None if not isinstance(built, str) else 0
    assert alike == 0 if name == "duration" else alike > 5


def test_exact_a_rule_sees_what_it_tells_apart():
    asked = Asked(Path("a.toml"), SCENES["weakening"])
    for key, value, said in (("friction.static", 0.1, "kinetic"), ("structure.mode.axial.damping", 0.6, "")):
        first = asked.model((f"{key}=0.3",), (0.3,))
        found = told(asked, (f"{key}={value}",), (value,))
        assert said in found if said else len(found.source.remarks) > len(first.source.remarks)
