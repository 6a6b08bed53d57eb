"""A scene with replaced keys equals the scene read from its text with the same settings."""

import pytest
from scene_texts import COULOMB, DRIVE, MODE, PATCH, POINT, SECOND

from patchfem.scene import BaseScene, loads, require_files
from patchfem.scene.scene import SceneError

RIG = POINT + COULOMB + MODE + SECOND + DRIVE
CHANGES = [  # scene, arguments of --set
    (RIG, ["normal.load=0 N", "normal.load=3 lbf"]),
    (RIG, ["structure.mode.1.damping=0.02"]),
    (
        RIG,
        ["structure.mode.axial.frequency=150 Hz", "drive.frequency=150 Hz", "friction.kinetic=0.2"],
    ),
    (RIG, ["friction.law=elastic-plastic", "friction.bond_length=1 um"]),
    (RIG, ["friction.kinetic=0.4"]),
    (RIG, ["normal.load=-1 N"]),
    (RIG, ["structure.mode.third.damping=0.1"]),
    (RIG, ["structure.mode.7.damping=0.1"]),
    (RIG, ["normal.load"]),
    (RIG, ["drive.waveform=levels"]),
    (RIG, ["title=another", "normal.load=5 kg"]),
    (RIG, ["structure.mode=[]"]),
    (RIG, ["friction.spread=1 um", "normal.width=1 mm"]),
    (PATCH, ["contact.tilt.angle=1 mrad"]),
    (PATCH, ['contact.substrate={young = "100 GPa", poisson = 0.3, density = "4000 kg/m^3"}']),
    (PATCH, ["contact.mesh=nowhere.msh"]),
    (PATCH, ["contact.coating=none"]),
]


def describe_scene(make) -> tuple:
    """Return all properties of a scene, or its mistakes."""
    try:
        found = make()
    except SceneError as error:
        return ("refused", *error.mistakes)
    return (
        found.resolved(),
        found.kind,
        found.remarks,
        found.sets,
        found.effect_names(),
        found.tables(),
    )


@pytest.mark.parametrize(("text", "sets"), CHANGES)
def test_exact_changed_scene_equals_scene_read_with_settings(text, sets):
    """A changed scene equals the scene read from its text with the same settings, also when tables are reused."""
    expected = describe_scene(lambda: require_files(loads(text, "scene.toml", sets)))
    base = BaseScene(loads(text, "scene.toml"))
    assert describe_scene(lambda: base.override(sets)) == expected
    assert (
        describe_scene(lambda: base.override(sets)) == expected
    )  # reuses the tables of the first call
