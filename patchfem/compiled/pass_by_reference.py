"""Named tuples of arrays and numbers that compiled functions receive by reference.

Numba passes a tuple by value as its flattened fields, eight words per array: 400 words at every call of the event loop,
each of which is a line or two of LLVM code to compile. Here the tuple lies in memory, and a field is loaded where it is
used. Compiled code never changes a tuple, so its fields are marked as constant memory, and LLVM loads each of them once
per loop.
"""

from llvmlite import ir
from numba.core import types
from numba.core.datamodel import models
from numba.core.extending import register_model
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr

WORD = 8  # bytes of a number in a tuple, and of each word that describes an array


class Held(types.Type):
    """Numba type of a named tuple passed by reference; `whole` is its type passed by value."""

    def __init__(self, whole):
        self.whole = whole
        super().__init__(f"Held[{whole.name}]")


def held(kind):
    """Return the type by which a function receives an argument: `Held` for a named tuple."""
    return Held(kind) if isinstance(kind, types.BaseNamedTuple) else kind


def words(kind) -> int:
    """Return the number of 8-byte words of a value of this type in memory."""
    if isinstance(kind, Held):
        return words(kind.whole)
    if isinstance(kind, types.BaseTuple):
        return sum(map(words, kind.types))
    return 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


@register_model(Held)
class Address(models.PrimitiveModel):
    """Data model of `Held`: the address of the tuple."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


@infer_getattr
class Fields(AttributeTemplate):
    """Typing of the attributes of `Held`."""

    key = Held

    def generic_resolve(self, kind, name):
        """Return the type of the field of this name; None if the tuple has no such field."""
        return (
            held(kind.whole.types[kind.whole.fields.index(name)])
            if name in kind.whole.fields
            else None
        )


@lower_getattr_generic(Held)
def field(context, builder, kind, value, name):
    """Generate the LLVM code that loads a field of a tuple passed by reference."""
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
