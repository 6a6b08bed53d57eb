"""Tables inside tables: checked by themselves, with the same answers."""

import pytest
from pydantic import ValidationError

from patchfem.scene.keys.contact import Tilt
from patchfem.scene.keys.types import Table


@pytest.mark.parametrize(
    "wrong, place",
    [
        ({"tilt": {"angle": "1 kg"}}, ("tilt", "angle")),
        ({"tilt": {"angle": "1 mrad", "onto": 1}}, ("tilt", "onto")),
        ({"tilt": {}}, ("tilt", "angle")),
        ({"tilt": 5}, ("tilt",)),
        ({"tilt": {"angle": "1 mrad"}, "more": [{"angle": "1 kg"}]}, ("more", 0, "angle")),
    ],
    ids=["value", "unknown", "missing", "no table", "item"],
)
def test_refuses_a_wrong_table_inside_another_at_its_place(wrong, place):
    class Outer(Table):
        tilt: Tilt
        more: tuple[Tilt, ...] = ()

    with pytest.raises(ValidationError) as caught:
        Outer.model_validate(wrong)
    assert [error["loc"] for error in caught.value.errors()] == [place]
