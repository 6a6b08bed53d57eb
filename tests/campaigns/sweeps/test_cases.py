"""The cases of a sweep: their number, order and names."""

from itertools import product as combinations
from pathlib import Path

import pytest
from scene_texts import BENCH, PATCH, SMALL_PATCH

from patchfem import SceneError
from patchfem.campaigns import CaseRequest, Cases, SweepScene, read_cases
from patchfem.scene import read_assignments

THREE = ["normal.load=1 N,2 N", "friction.static=0.1,0.2,0.3", "slide.speed=1 mm/s,2 mm/s"]


def make_cases(*texts) -> Cases:
    """Return the cases of axes given as texts."""
    axes, wrong = read_assignments(texts)
    assert wrong == []
    return Cases(tuple(axes))


def test_exact_cases_are_all_combinations():
    """The cases are all combinations of the values, and the last key varies fastest."""
    cases = make_cases(*THREE)
    want = list(combinations(("1 N", "2 N"), ("0.1", "0.2", "0.3"), ("1 mm/s", "2 mm/s")))
    assert [cases.texts(number) for number in range(len(cases))] == want and cases.shape == (
        2,
        3,
        2,
    )
    assert cases.assignments(11) == ("normal.load=2 N", "friction.static=0.3", "slide.speed=2 mm/s")


def test_exact_case_name_depends_on_values_only():
    """The name of a case depends on its values, not on their order, their units or the other cases."""
    scene = SweepScene(Path("a.toml"), BENCH)
    names = (
        make_cases("normal.load=1 N,2 N", "friction.static=0.1,0.2").compute_hashes(scene).tolist()
    )
    assert len(set(names)) == 4
    reordered = make_cases(
        "friction.static=0.1,0.2", "normal.load=1000e-3 N,0.002 kN"
    ).compute_hashes(scene)
    assert reordered.tolist() == [names[0], names[2], names[1], names[3]]
    assert set(
        make_cases("normal.load=1 N,3 N", "friction.static=0.1,0.2").compute_hashes(scene)
    ) & set(names) == set(names[:2])
    swept = BENCH + '[sweep]\n"normal.load" = "1 N"\n'
    assert (
        make_cases("normal.load=1 N,2 N", "friction.static=0.1,0.2")
        .compute_hashes(SweepScene(Path("a.toml"), swept))
        .tolist()
        == names
    )


def test_exact_cases_with_shared_mesh_are_named_by_sweep():
    """If all cases share an automatically chosen mesh, their names depend on the other cases of the sweep."""
    pinned = SweepScene(Path("a.toml"), SMALL_PATCH)
    chosen = SweepScene(Path("a.toml"), PATCH)
    one = make_cases("contact.load=1 N,2 N")
    two = make_cases("contact.load=1 N,3 N")
    assert one.compute_hashes(pinned)[0] == two.compute_hashes(pinned)[0]
    assert one.compute_hashes(chosen)[0] != two.compute_hashes(chosen)[0]
    assert (
        one.compute_hashes(chosen).tolist()
        == make_cases("contact.load=2 N,1e-3 kN").compute_hashes(chosen)[::-1].tolist()
    )
    sets = SweepScene(Path("a.toml"), PATCH, ("contact.element_size=1 mm",))
    assert one.compute_hashes(sets)[0] == two.compute_hashes(sets)[0]
    sizes = [
        make_cases(f"contact.element_size=1 mm,{other} mm").compute_hashes(chosen)[0]
        for other in (2, 3)
    ]
    assert sizes[0] == sizes[1]  # each case sets its own element size


def test_exact_case_name_depends_on_file_content(tmp_path):
    """The name of a case changes with the content of a file that it uses."""
    path = tmp_path / "path.csv"
    path.write_text("time [s],displacement [m]\n0,0\n1,1e-6\n")
    text = BENCH[: BENCH.index("[slide]")] + '[slide]\nkind = "file"\nfile = "path.csv"\n'
    scene = SweepScene(tmp_path / "a.toml", text)
    cases = make_cases("normal.load=1 N")
    asked_beside = SweepScene(tmp_path / "a.toml", BENCH)
    beside = make_cases("slide.file=path.csv")
    before = cases.compute_hashes(scene), beside.compute_hashes(asked_beside)
    path.write_text("time [s],displacement [m]\n0,0\n1,2e-6\n")
    assert (
        cases.compute_hashes(scene)[0] != before[0][0]
        and beside.compute_hashes(asked_beside)[0] != before[1][0]
    )


def test_exact_common_mistake_is_reported_once():
    """A mistake that all random cases share is reported once."""
    text = BENCH.replace("static = 0.3", "static = 0.3\nkinetic = 0.3")
    with pytest.raises(SceneError) as refused:
        read_cases(
            SweepScene(Path("a.toml"), text), CaseRequest(("friction.static=0.2..0.25",), None, 100)
        )
    assert str(refused.value).count("is larger than static") == 1 and "more" not in str(
        refused.value
    )
