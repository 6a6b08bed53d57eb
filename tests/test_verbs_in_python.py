"""The verbs of the command line from Python, and scenes that are dicts."""

import subprocess
import sys

import numpy as np
import pytest
from scene_texts import shaken

import patchfem as pf

BLOCK = {"title": "a block", "normal": {"load": "100 N"}, "friction": {"law": "coulomb", "static": 0.3},
         "structure": {"moving_mass": 0.5, "mode": [{"name": "axial", "frequency": 100.0, "damping": 0.002,
                                                     "slide": 1.0}]},
         "drive": {"kind": "base", "frequency": 100.0, "acceleration": "9 g", "cycles": 50}}
TEXT = 'title = "a block"\n' + shaken('law = "coulomb"', "9 g", 50)
PIECES = """[contact]
length = "10 mm"
width = "10 mm"
height = "5 mm"
load = "100 N"
element_size = "2.5 mm"
substrate = "Ti-8Al-1Mo-1V"
"""


def test_exact_a_scene_from_a_dict_is_that_of_its_text():
    assert pf.load(BLOCK).resolved() == pf.load(TEXT).resolved()
    one, other = pf.run(BLOCK, **{"normal.load": "90 N"}), pf.run(TEXT, **{"normal.load": "90 N"})
    assert {name: m.value for name, m in one.measures.items()} == {name: m.value for name, m in other.measures.items()}
    assert pf.sweep(BLOCK, {"normal.load": ["90 N", "100 N"]})["outcome"].size == 2


def test_refuses_a_dict_with_its_mistakes():
    with pytest.raises(pf.SceneError, match=r"normal\.lod: unknown key; did you mean 'load'"):
        pf.load({"normal": {"lod": 1.0}})
    with pytest.raises(pf.SceneError, match="no value of a scene"):
        pf.load({"normal": {"load": object()}})


def test_exact_the_table_of_a_result_has_its_measures():
    result = pf.run(BLOCK)
    found = result.table()
    rows = found if isinstance(found, list) else found.reset_index().to_dict("records")
    assert [one["measure"] for one in rows] == list(result.measures)
    assert rows[0]["value"] == result.measures[rows[0]["measure"]].value


def test_exact_a_fit_finds_the_friction_of_its_own_loop(tmp_path):
    bench = pf.new("bench")
    run = pf.run(bench)
    loop = np.column_stack([run.response.time, run.response.slide * 1e6, run.response.force])
    path = tmp_path / "loop.csv"
    path.write_text("time [s],displacement [um],force [N]\n" + "".join(
        ",".join(map(repr, row)) + "\n" for row in loop.tolist()), "utf-8")
    told = pf.load(bench).friction.static
    found = pf.fit(bench, to=path, free={"friction.static": (told / 2, 2 * told)}, out=tmp_path / "fit")
    assert found["values"]["friction.static"]["value"] == pytest.approx(told, rel=1e-6)
    assert (tmp_path / "fit" / "fit.json").is_file()
    with pytest.raises(pf.SceneError, match=r"friction\.statc"):
        pf.fit(bench, to=path, free={"friction.statc": (0.1, 0.2)})


def test_a_verb_and_a_folder_of_one_name_stand_beside_each_other(tmp_path):
    """`pf.mesh` and `pf.export` are verbs, before and after their folders have been imported."""
    for _ in range(2):
        assert pf.mesh(PIECES, tmp_path / "pieces.vtu").is_file()
        import patchfem.export.results
        import patchfem.mesh.files  # noqa: F401
    with pytest.raises(pf.PatchfemError, match="only a scene with"):
        pf.mesh(TEXT, tmp_path / "none.vtu")
    pf.run(BLOCK).save(tmp_path / "block")
    assert pf.export(tmp_path / "block", tmp_path / "histories.csv").read_text("utf-8").startswith("time")
    page = pf.report(tmp_path / "block", tmp_path / "block", out=tmp_path / "both.html")
    assert "side by side" in page.read_text("utf-8") or page.is_file()


def test_exact_profile_gives_the_roughness_of_a_sine(tmp_path):
    x = np.linspace(0, 4e-3, 4001)
    path = tmp_path / "trace.csv"
    path.write_text("x [um],z [um]\n" + "".join(f"{a * 1e6!r},{b!r}\n" for a, b in zip(
        x.tolist(), np.sin(2 * np.pi * x / 2e-4).tolist())), "utf-8")
    found = pf.profile(path)
    [one] = found["profiles"]
    assert one["measures"]["Pq"]["value"] == pytest.approx(1e-6 / np.sqrt(2), rel=1e-3)


def test_importing_the_package_loads_no_stage():
    text = "import sys, patchfem; print(any(name.startswith('patchfem.runs') for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", text], capture_output=True, text=True).stdout == "False\n"
