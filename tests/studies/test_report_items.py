"""The list of the report's items: files, verdicts and the page made from it."""

from study_module import ROOT, make_study_fixture

items = make_study_fixture("report/items.py")


def test_always_items_page_agrees_with_the_list(items):
    """items.md is the table that items.py writes."""
    assert (items.FOLDER / "items.md").read_text("utf-8") == items.table(), (
        "run python studies/report/items.py"
    )


def test_always_items_have_files_verdicts_and_tests(items):
    """Every item has a known verdict and existing files; every item that works has a test."""
    assert len(items.ITEMS) == 79
    for one in items.ITEMS:
        verdict, _, lack = one.verdict.partition(": ")
        assert verdict in items.VERDICTS and bool(lack) == (verdict in ("in part", "missing")), one
        assert all((ROOT.parent / path).is_file() for path in one[2:5] if path), one
        assert one.test or verdict in ("missing", "nothing"), one
        assert one.scene or one.study or verdict == "nothing", one


def test_always_docstring_states_the_counts_of_items(items):
    """The docstring states how many items work, work in part or are missing."""
    counts = [
        sum(one.verdict.split(":")[0] == verdict for one in items.ITEMS)
        for verdict in items.VERDICTS
    ]
    assert counts == [71, 6, 0, 2]
    assert "79 items 71 work, 6 in part, none is missing, and of two" in items.__doc__
