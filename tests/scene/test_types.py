"""Tables inside tables: checked by themselves, with the same answers."""

import pytest
from pydantic import ValidationError

from patchfem.scene.keys.contact import Contact, Tilt
from patchfem.scene.keys.tables import Tables
from patchfem.scene.keys.types import Table, whole_tables


def models_in(schema) -> int:
    """Tables whose checks are part of these checks, themselves among them."""
    parts = schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list | tuple) else ()
    own = isinstance(schema, dict) and schema.get("type") == "model"
    return own + sum(map(models_in, parts))


def test_exact_the_checks_of_a_table_hold_no_others():
    """Else every table is made once for each that it is inside of, 48 for the 12 of the shipped rig."""
    for model in (Tables, Contact):
        model.model_rebuild(force=True)
        assert models_in(model.__pydantic_core_schema__) == 1
    with whole_tables():
        class Outer(Table):
            tilt: Tilt

        Outer.model_rebuild(force=True)
    assert models_in(Outer.__pydantic_core_schema__) == 2


def test_exact_a_table_inside_another_is_taken_as_it_is_or_read():
    class Outer(Table):
        tilt: Tilt
        more: tuple[Tilt, ...] = ()

    tilt = Tilt.model_validate({"angle": "1 mrad"})
    assert Outer(tilt=tilt).tilt is tilt
    found = Outer.model_validate({"tilt": {"angle": "1 mrad"}, "more": [tilt, {"angle": "2 mrad"}]})
    assert found.tilt == tilt and [one.angle for one in found.more] == [1e-3, 2e-3]


@pytest.mark.parametrize("wrong, place", [
    ({"tilt": {"angle": "1 kg"}}, ("tilt", "angle")), ({"tilt": {"angle": "1 mrad", "onto": 1}}, ("tilt", "onto")),
    ({"tilt": {}}, ("tilt", "angle")), ({"tilt": 5}, ("tilt",)),
    ({"tilt": {"angle": "1 mrad"}, "more": [{"angle": "1 kg"}]}, ("more", 0, "angle"))],
    ids=["value", "unknown", "missing", "no table", "item"])
def test_refuses_a_wrong_table_inside_another_at_its_place(wrong, place):
    class Outer(Table):
        tilt: Tilt
        more: tuple[Tilt, ...] = ()

    with pytest.raises(ValidationError) as caught:
        Outer.model_validate(wrong)
    assert [error["loc"] for error in caught.value.errors()] == [place]
