"""The page of what the report prints and what comes out: its parts, its numbers, and the verdicts of figures."""

import pytest
from study_module import make_study_fixture

study = make_study_fixture("report/reproduce.py")


def find_stale_rows(study, part: str) -> list[str]:
    """Return the rows of a part, computed now, that the page does not have; errors may differ."""
    page = (study.FOLDER / "reproduced.md").read_text("utf-8")
    kept = {tuple(line.split(" | ")[:4]) for line in page.splitlines()}
    rows = study.main(only=part, path=None)[part]
    lines = study.format_rows([row._replace(error="") for row in rows])[2:]
    assert lines and f"## {part}\n" in page
    return [line for line in lines if tuple(line.split(" | ")[:4]) not in kept]


LONG_PARTS = ("table-1", "onset", "conclusions")


@pytest.mark.parametrize(
    "part",
    ["block", "figure-13", *(pytest.param(part, marks=pytest.mark.slow) for part in LONG_PARTS)],
)
def test_exact_page_has_the_computed_numbers(study, part):
    """Printed and computed values of the block, a figure, Table 1, onsets and conclusions are those of the page."""
    assert find_stale_rows(study, part) == []


def test_always_every_figure_has_a_verdict_and_a_picture(study):
    """The page has every part; the verdict of a figure is "yes", or "in part" or "no" with a reason."""
    page = (study.FOLDER / "reproduced.md").read_text("utf-8")
    assert [line[3:] for line in page.splitlines() if line[:3] == "## "] == list(
        study.list_parts(None)
    )
    for name, figures in study.FIGURES.values():
        verdict = study.import_module(name).VERDICT
        assert verdict == "yes" or verdict.startswith(("in part: ", "no: ")), name
        assert f"![{figures}, computed](" in page


def test_refuses_unknown_part(study):
    """An unknown part is refused with the names of all parts."""
    with pytest.raises(study.PatchfemError, match="table-1, onset, block"):
        study.main(only="table-2", path=None)


def test_exact_page_of_one_part_replaces_no_other_page(study, tmp_path, monkeypatch):
    """The command with `--only table-1` writes a page of this name, and leaves the page of all parts as it is."""
    monkeypatch.setattr(study, "list_parts", lambda folder: {"table-1": lambda: iter(())})
    page = tmp_path / "reproduced.md"
    page.write_text("all parts", "utf-8")
    study.main(only="table-1", path=page)
    assert page.read_text("utf-8") == "all parts"
    assert {path.name for path in tmp_path.iterdir()} == {"reproduced.md", "table-1.md"}
    study.main(path=page)
    assert "## table-1" in page.read_text("utf-8")
