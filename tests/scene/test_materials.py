"""Materials by name: spellings, plausible values with their sources, and the advice for an unknown name."""

import pytest

import patchfem as pf
from patchfem.scene import MATERIALS, loads, read_template
from patchfem.scene.keys.materials import find_material_name, normalise_material_name

PATCH = read_template("patch")
# spelling in a scene -> name in the table
SPELLINGS = {
    "ti64": "Ti-6Al-4V",
    "Ti 6Al 4V": "Ti-6Al-4V",
    "718": "Inconel 718",
    "aisi 316L": "316L",
    "17-4 PH": "17-4PH",
    "brass": "CuZn39Pb3",
    "hard chrome": "Cr",
    "Ti N": "TiN",
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
