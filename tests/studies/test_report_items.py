"""The items of the report: every path is there, every verdict is one, and the page is what the list says."""

from study_module import ROOT, make_study_fixture

items = make_study_fixture("report/items.py")


def test_always_the_page_is_the_list(items):
    assert (items.FOLDER / "items.md").read_text("utf-8") == items.table(), (
        "run python studies/report/items.py"
    )


def test_always_every_path_is_there_and_every_item_that_works_is_tested(items):
    assert len(items.ITEMS) == 79
    for one in items.ITEMS:
        verdict, _, lack = one.verdict.partition(": ")
        assert verdict in items.VERDICTS and bool(lack) == (verdict in ("in part", "missing")), one
        assert all((ROOT.parent / path).is_file() for path in one[2:5] if path), one
        assert one.test or verdict in ("missing", "nothing"), one
        assert one.scene or one.study or verdict == "nothing", one


def test_always_the_docstring_counts_what_the_list_holds(items):
    counts = [
        sum(one.verdict.split(":")[0] == verdict for one in items.ITEMS)
        for verdict in items.VERDICTS
    ]
    assert counts == [71, 6, 0, 2]
    assert "79 items 71 work, 6 in part, none is missing, and of two" in items.__doc__
