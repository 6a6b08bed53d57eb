"""Materials by name: spellings, values with their sources, and the advice for an unknown name."""

import tomllib

import pytest
from jsonschema import Draft202012Validator

import patchfem as pf
from patchfem.scene import MATERIALS, loads, make_schema, read_template
from patchfem.scene.keys.materials import find_material_name, normalise_material_name

PATCH = read_template("patch")
# spelling in a scene -> name in the table
SPELLINGS = {
    "ti64": "Ti-6Al-4V",
    "Ti6Al4V": "Ti-6Al-4V",
    "ti-6al-4v": "Ti-6Al-4V",
    "Ti 6Al 4V": "Ti-6Al-4V",
    "in718": "Inconel 718",
    "INCONEL_718": "Inconel 718",
    "718": "Inconel 718",
    "aisi 316L": "316L",
    "316-l": "316L",
    "1.4404": "316L",
    "17-4 PH": "17-4PH",
    "4140": "42CrMo4",
    "52100": "100Cr6",
    "7075": "Al 7075-T6",
    "EN AW-6082": "Al 6082-T6",
    "brass": "CuZn39Pb3",
    "c17200": "CuBe",
    "Al2O3": "alumina",
    "Si3N4": "silicon nitride",
    "teflon": "PTFE",
    "peek": "PEEK",
    "dlc": "DLC",
    "hard chrome": "Cr",
    "Ti N": "TiN",
    "aluminum": "aluminium",
    " Steel ": "steel",
}
# unknown name -> materials that the error proposes
NEAREST = {
    "Ti-6Al-4": "'Ti-6Al-4V'",
    "Ti-8Al": "'Ti-8Al-1Mo-1V'",
    "inconell718": "'Inconel 718'",
    "316": "'316L'",
    "stainles": "'stainless steel'",
    "tin": "'bronze' or 'TiN'",  # the metal tin is not the nitride
}
# Young's modulus [Pa], Poisson's ratio, density [kg m-3] and yield strength [Pa], as compared with
# data sheets and standards; scenes of release 0.4 rely on those down to PTFE
VALUES = {
    "Ti-8Al-1Mo-1V": (121e9, 0.32, 4370.0, 930e6),
    "WC-Co": (250e9, 0.24, 14500.0, None),
    "WC-Co sintered": (600e9, 0.22, 14900.0, None),
    "steel": (210e9, 0.30, 7850.0, 235e6),
    "stainless steel": (193e9, 0.29, 8000.0, 205e6),
    "cast iron": (110e9, 0.26, 7200.0, None),
    "aluminium": (69e9, 0.33, 2700.0, 240e6),
    "bronze": (110e9, 0.34, 8800.0, None),
    "alumina": (370e9, 0.22, 3900.0, None),
    "PTFE": (0.5e9, 0.46, 2200.0, None),
    "Ti-6Al-4V": (114e9, 0.31, 4430.0, 828e6),
    "Inconel 718": (200e9, 0.29, 8190.0, 1034e6),
    "316L": (200e9, 0.30, 8000.0, 170e6),
    "17-4PH": (196e9, 0.27, 7800.0, 725e6),
    "42CrMo4": (200e9, 0.32, 7830.0, 650e6),
    "100Cr6": (210e9, 0.30, 7810.0, 2030e6),
    "Al 7075-T6": (71e9, 0.33, 2800.0, 460e6),
    "Al 6082-T6": (70e9, 0.30, 2700.0, 240e6),
    "CuZn39Pb3": (97e9, 0.31, 8470.0, 220e6),
    "CuBe": (131e9, 0.30, 8360.0, 860e6),
    "silicon nitride": (310e9, 0.27, 3200.0, None),
    "PEEK": (4.0e9, 0.40, 1300.0, 98e6),
    "DLC": (259e9, 0.25, 2070.0, None),
    "Cr": (235e9, 0.21, 7150.0, None),
    "TiN": (450e9, 0.25, 5210.0, None),
}
# thermal conductivity [W m-1 K-1] and heat capacity [J kg-1 K-1]
HEAT_VALUES = {"Ti-8Al-1Mo-1V": (6.0, 502.0), "steel": (50.0, 490.0)}


def with_substrate(name: str) -> str:
    """Return the scene of a patch whose pieces are of a material."""
    lines = PATCH.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("substrate"))
    return "\n".join([*lines[:at], f'substrate = "{name}"', *lines[at + 1 :]])


@pytest.mark.parametrize("written, name", SPELLINGS.items())
def test_exact_material_spellings_are_accepted(written, name):
    """Different spellings of a material name give the same material, in a file and in --set."""
    by_set = loads(PATCH, sets=[f"contact.substrate={written}"]).contact.substrate
    in_file = loads(with_substrate(written)).contact.substrate
    assert by_set == in_file == loads(with_substrate(name)).contact.substrate
    assert in_file.name == name and in_file.young == MATERIALS[name].young


def test_always_schema_accepts_material_spellings():
    """The JSON schema accepts the same spellings of materials and refuses unknown ones."""
    check = Draft202012Validator(make_schema())
    for written in SPELLINGS:
        assert check.is_valid(tomllib.loads(with_substrate(written))), written
    for written in NEAREST:
        assert not check.is_valid(tomllib.loads(with_substrate(written))), written


@pytest.mark.parametrize("written, proposed", NEAREST.items())
def test_refuses_unknown_material(written, proposed):
    """An unknown material is refused with the nearest names and the list of all."""
    with pytest.raises(pf.SceneError, match=f"did you mean {proposed}") as caught:
        loads(with_substrate(written))
    assert f"use one of {', '.join(MATERIALS)}" in str(caught.value)


def test_always_material_records_are_plausible():
    """Every material has plausible values, a source and unique names."""
    names = [
        spelling for name, record in MATERIALS.items() for spelling in (name, *record.other_names)
    ]
    assert len({normalise_material_name(name) for name in names}) == len(names)
    assert all(find_material_name(name) == name for name in MATERIALS)
    for name, record in MATERIALS.items():
        for other in record.other_names:
            assert loads(PATCH, sets=[f"contact.substrate={other}"]).contact.substrate.name == name
        assert 1e8 < record.young < 1e12 and 0.2 < record.poisson < 0.5
        assert 900 < record.density < 2e4 and record.source.endswith(".")
        if record.strength is not None:
            assert 1e-4 < record.strength.strength / record.young < 3e-2
            assert record.strength.source.endswith(".")
    # brittle materials have no yield strength
    for name in ("WC-Co", "WC-Co sintered", "alumina", "silicon nitride", "DLC", "TiN", "Cr"):
        assert MATERIALS[name].strength is None


def test_exact_material_values_are_unchanged():
    """The values of all materials equal those that were compared with data sheets."""
    assert list(MATERIALS) == list(VALUES)
    for name, (*elastic, strength) in VALUES.items():
        record = MATERIALS[name]
        assert [record.young, record.poisson, record.density] == elastic
        assert (record.strength and record.strength.strength) == strength
    heat = {name: record.heat[:2] for name, record in MATERIALS.items() if record.heat is not None}
    assert heat == HEAT_VALUES
