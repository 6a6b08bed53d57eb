"""The table of all studies: it says what the studies say."""

import json

from study_module import ROOT, load_study, make_study_fixture

page = make_study_fixture("report/table.py")


def test_always_the_page_is_what_the_studies_say(page):
    """Another answer, another study: `python studies/report/table.py` writes the page anew."""
    seconds = json.loads(page.SECONDS_FILE.read_text("utf-8"))
    assert (page.FOLDER / "README.md").read_text("utf-8") == page.table(page.studies(), seconds), (
        "run python studies/report/table.py"
    )
    assert set(seconds) <= {one.path for one in page.studies()}


def test_always_every_study_of_a_figure_has_a_word_on_it(page):
    """VERDICT is "yes", or says what is missing and why."""
    found = {one.path: one for one in page.studies()}
    assert len(found) == len(page.studies()) > 40 and all(
        one.question.endswith(("?", ".")) for one in found.values()
    )
    figures = [path for path in (ROOT / "report").glob("figure*.py")]
    for path in figures:
        said = found[f"report/{path.name}"].reproduced
        assert said == "yes" or said.startswith(("in part: ", "no: ")), path.name


def test_exact_the_words_of_a_module_without_running_it(page):
    module = load_study("report/figures_28_29.py")
    one = next(one for one in page.studies() if one.path == "report/figures_28_29.py")
    assert one[1:] == (
        " ".join(module.__doc__.split("\n\n")[0].split()),
        module.ANSWER,
        module.VERDICT,
    )
