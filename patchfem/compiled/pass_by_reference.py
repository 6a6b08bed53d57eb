"""Named tuples of arrays and numbers as compiled code takes them: by their address, not field by field.

Numba hands a tuple from function to function as its parts, eight words an array: four hundred words at every call of a
loop over events, each of them a line or two of what LLVM reads. Here the tuple lies in memory and a field is loaded
where it is used. Nothing changes a tuple while compiled code runs, so its fields are marked as constant memory and a
loop loads each of them once.
"""

from llvmlite import ir
from numba.core import types
from numba.core.datamodel import models
from numba.core.extending import register_model
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr

WORD = 8  # bytes of what a tuple consists of: numbers, and the words of arrays


class Held(types.Type):
    """A named tuple in memory; whole: numba's type of it."""

    def __init__(self, whole):
        self.whole = whole
        super().__init__(f"Held[{whole.name}]")


def held(kind):
    """The type by which a function takes an argument of this type."""
    return Held(kind) if isinstance(kind, types.BaseNamedTuple) else kind


def words(kind) -> int:
    """Words of a value in memory."""
    if isinstance(kind, Held):
        return words(kind.whole)
    if isinstance(kind, types.BaseTuple):
        return sum(map(words, kind.types))
    return 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


@register_model(Held)
class Address(models.PrimitiveModel):
    """Its model: where it lies."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


@infer_getattr
class Fields(AttributeTemplate):
    """Types of its fields."""

    key = Held

    def generic_resolve(self, kind, name):
        """That of the field of this name, None where it has none."""
        return (
            held(kind.whole.types[kind.whole.fields.index(name)])
            if name in kind.whole.fields
            else None
        )


@lower_getattr_generic(Held)
def field(context, builder, kind, value, name):
    """Code that loads a field."""
    at = kind.whole.fields.index(name)
    place = builder.gep(
        value, [ir.Constant(ir.IntType(64), WORD * sum(map(words, kind.whole.types[:at])))]
    )
    found = held(kind.whole.types[at])
    if isinstance(found, Held):
        return place
    out = builder.load(
        builder.bitcast(place, context.get_value_type(found).as_pointer()), align=WORD
    )
    module = builder.module
    family = module.add_metadata(["patchfem"])
    leaf = module.add_metadata(["field", family, ir.Constant(ir.IntType(64), 0)])
    zero, one = (ir.Constant(ir.IntType(64), n) for n in (0, 1))
    out.set_metadata("tbaa", module.add_metadata([leaf, leaf, zero, one]))
    return out
