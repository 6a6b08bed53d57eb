"""Loading of scenes: values in SI units, the resolved text, and no exception other than SceneError."""

from __future__ import annotations

import pickle

import pytest
from scene_texts import BENCH, FULL, LINEAR, PATCH, RIG

from patchfem.scene import load, loads
from patchfem.scene.keys.lines import find_key_lines
from patchfem.scene.scene import SceneError


def test_exact_rig_scene_has_si_values():
    """The keys of a rig scene are stored in SI units."""
    scene = loads(RIG, "folder/a.toml")
    assert (scene.kind, scene.title, scene.remarks) == ("rig", "143 Hz, 5 g", [])
    assert scene.contact.length == 0.0127 and scene.contact.load == 115.653761996773  # 26 lbf
    assert scene.contact.coating.thickness == 0.0001524
    assert scene.contact.coating.material.young == 250e9
    assert scene.contact.substrate.name == "Ti-8Al-1Mo-1V" and scene.contact.tilt.angle == 1e-4
    assert scene.drive.acceleration == 49.03325 and scene.drive.cycles == 200.0
    assert scene.normal is None and scene.slide is None and scene.contact.shear is None
    assert scene.resolve_path("before.csv").as_posix() == "folder/before.csv"


def test_exact_effect_names_of_scenes():
    """The names of the effects of a scene are listed in a fixed order."""
    extra = '[contact.shear]\n[accuracy]\nmethod = "march"\n[measured]\nfile = "t.csv"\n'
    assert loads(RIG + extra).effect_names() == [
        "contact", "contact.coating", "contact.tilt", "contact.shear", "friction.law=nonlocal",
        "friction.reading=stretch", "structure", "drive.kind=base", "drive.waveform=sine", "accuracy.method=march",
        "measured",
    ]  # fmt: skip
    assert loads(BENCH).effect_names() == ["normal", "friction.law=coulomb", "slide.kind=triangle"]


@pytest.mark.parametrize(
    "text, sets", [(RIG, []), (RIG, FULL), (BENCH, []), (LINEAR, []), (PATCH, [])]
)
def test_exact_resolved_text_is_the_same_scene(text, sets):
    """The resolved text of a scene is read as the same scene."""
    scene = loads(text, sets=sets)
    again = loads(scene.resolved())
    assert again.tables() == scene.tables()
    assert again.resolved() == scene.resolved()
    assert (again.kind, again.effect_names(), again.remarks) == (
        scene.kind,
        scene.effect_names(),
        [],
    )


def test_exact_resolved_text_has_no_unused_keys():
    """The resolved text omits keys that the law does not use, and a remark names them."""
    scene = loads(BENCH + "[accuracy]\ntolerance = 1e-2\n", sets=["friction.bond_length=1 um"])
    assert "bond_length" not in scene.resolved() and scene.friction.bond_length is None
    assert scene.remarks == [
        "friction.bond_length has no meaning for law 'coulomb' and is not used"
    ]


def test_exact_scene_survives_pickling():
    """A pickled scene is equal to the original."""
    scene = loads(RIG, sets=FULL)
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_exact_load_accepts_byte_order_mark(tmp_path):
    """A file with a byte order mark and Windows line ends is read."""
    path = tmp_path / "a.toml"
    path.write_bytes(b"\xef\xbb\xbf" + RIG.replace("\n", "\r\n").encode())
    assert load(path).tables() == loads(RIG).tables()


def test_exact_settings_apply_in_order():
    """Settings apply in their order, and modes can be given by name or number."""
    scene = loads(RIG, sets=["structure.mode.axial.frequency=150 Hz", "contact.load=1 N", "contact.load=2 N",
                             "title=2024", "contact.crown.radius=1 m", "structure.mode.1.damping=0.02"])  # fmt: skip
    assert scene.structure.mode[0].frequency == 150.0 and scene.structure.mode[1].damping == 0.02
    assert (scene.contact.load, scene.title, scene.contact.crown.radius) == (2.0, "2024", 1.0)


def test_exact_line_numbers_of_nested_toml():
    """The line numbers of keys are found in a text with nested tables, comments and multi-line strings."""
    text = '''a = """
[no]
x = 1"""
[t]  # [no]
'q.u' = 'x # y'
list = [ 1, # ] no
  [2, "]"],
]
in.line = {k = 1, m = {n = "}"}}
[[s.m]]
x = 1
[[s.m]]
y = [{z = 1},
     {z = 2}]
[s.m.sub]
w = \'\'\'it''s\'\'\'
v = 1979-05-27 07:32:00
'''
    lines = find_key_lines(text)
    expected = {"a": 1, "t": 4, "t.q.u": 5, "t.list": 6, "t.list.1": 7, "t.in": 9, "t.in.line.m.n": 9, "s": 10,
                "s.m": 10, "s.m.0": 10, "s.m.0.x": 11, "s.m.1": 12, "s.m.1.y.1.z": 14, "s.m.1.sub": 15,
                "s.m.1.sub.w": 16, "s.m.1.sub.v": 17}  # fmt: skip
    assert {key: lines.get(key) for key in expected} == expected
    assert "no" not in lines and not any("x = 1" in key for key in lines)


@pytest.mark.parametrize(
    "kind, levels, expected",
    [("base", "2 m/s^2..6 m/s^2:3", [2, 4, 6]), ("force", "1 N..100 N:3", [1, 50.5, 100])],
)
def test_exact_range_of_levels_stands_for_its_values(kind, levels, expected):
    """A range of levels stands for its values with equal steps; one without a number of values is refused."""
    drive = f'[drive]\nkind = "{kind}"\nwaveform = "levels"\nfrequency = "143 Hz"\ncycles = 9\n'
    text = RIG.partition("[drive]")[0] + drive
    assert loads(f'{text}levels = "{levels}"\n').drive.levels == pytest.approx(expected)
    with pytest.raises(SceneError, match="number of values after a colon"):
        loads(f'{text}levels = "{levels[:-2]}"\n')
