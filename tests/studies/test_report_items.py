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
    for item in items.ITEMS:
        verdict, _, missing = item.verdict.partition(": ")
        assert verdict in items.VERDICTS and bool(missing) == (verdict in ("in part", "missing")), (
            item
        )
        assert all((ROOT.parent / path).is_file() for path in item[2:5] if path), item
        assert item.test or verdict in ("missing", "nothing"), item
        assert item.scene or item.study or verdict == "nothing", item


def test_always_docstring_states_the_counts_of_items(items):
    """The docstring states how many items work, work in part or are missing."""
    counts = [
        sum(item.verdict.split(":")[0] == verdict for item in items.ITEMS)
        for verdict in items.VERDICTS
    ]
    assert counts == [68, 8, 1, 2]
    assert "79 items 68 work, 8 in part, one cannot be computed, and of two" in items.__doc__
