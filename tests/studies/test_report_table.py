"""The table of all studies agrees with the docstrings of the studies."""

from command_line import read_json
from study_module import ROOT, make_study_fixture

page = make_study_fixture("report/table.py")


def test_always_table_of_studies_is_up_to_date(page):
    """README.md of the studies is the table that `python studies/report/table.py` writes."""
    seconds = read_json(page.SECONDS_FILE)
    assert (page.FOLDER / "README.md").read_text("utf-8") == page.table(page.studies(), seconds), (
        "run python studies/report/table.py"
    )
    assert set(seconds) <= {study.path for study in page.studies()}


def test_always_figure_studies_have_a_verdict(page):
    """The VERDICT of a study of a figure is "yes", or begins with "in part: " or "no: "."""
    studies = {study.path: study for study in page.studies()}
    assert len(studies) == len(page.studies()) > 40 and all(
        study.question.endswith(("?", ".")) for study in studies.values()
    )
    figures = [path for path in (ROOT / "report").glob("figure*.py")]
    for path in figures:
        verdict = studies[f"report/{path.name}"].reproduced
        assert verdict == "yes" or verdict.startswith(("in part: ", "no: ")), path.name
