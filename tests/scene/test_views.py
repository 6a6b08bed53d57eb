"""Rules read tables through views: a missing value compares as false, a name that no key has is an error."""

import pytest

from patchfem.scene.keys.tables import Normal
from patchfem.scene.keys.types import build_table
from patchfem.scene.rules.view import TableView

NORMAL = TableView(build_table(Normal, {"load": 10.0}))


def test_compares_missing_values_as_false():
    assert NORMAL.load > 5
    assert not NORMAL.amplitude > 5
    assert not NORMAL.amplitude <= 5
    assert not NORMAL.grooves.amplitude >= 0
    assert not TableView(None).load > 5


def test_refuses_a_name_that_no_key_has():
    with pytest.raises(AttributeError, match="ampltude"):
        NORMAL.ampltude > 5  # noqa: B015
