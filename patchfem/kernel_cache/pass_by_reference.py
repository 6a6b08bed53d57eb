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

WORD_BYTES = 8  # number of bytes of a number in a tuple, and of each word that describes an array


class ReferencedTuple(types.Type):
    """Numba type of a named tuple passed by reference; `tuple_type` is its type passed by value."""

    def __init__(self, tuple_type):
        self.tuple_type = tuple_type
        super().__init__(f"ReferencedTuple[{tuple_type.name}]")


def get_argument_type(kind):
    """Return the type by which a function receives an argument of the numba type `kind`.

    It is a `ReferencedTuple` for a named tuple, and `kind` itself for others.
    """
    return ReferencedTuple(kind) if isinstance(kind, types.BaseNamedTuple) else kind


def count_words(kind) -> int:
    """Return the number of 8-byte words in memory of a value of the numba type `kind`."""
    if isinstance(kind, ReferencedTuple):
        return count_words(kind.tuple_type)
    if isinstance(kind, types.BaseTuple):
        return sum(map(count_words, kind.types))
    return 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


@register_model(ReferencedTuple)
class ReferencedTupleModel(models.PrimitiveModel):
    """Data model of `ReferencedTuple`: the address of the tuple."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


@infer_getattr
class FieldTyping(AttributeTemplate):
    """Typing of the attributes of `ReferencedTuple`."""

    key = ReferencedTuple

    def generic_resolve(self, kind, name):
        """Return the type of a field by its name, in a tuple of the type `kind`, or None if it has none."""
        fields = kind.tuple_type.fields
        if name not in fields:
            return None
        return get_argument_type(kind.tuple_type.types[fields.index(name)])


@lower_getattr_generic(ReferencedTuple)
def load_field(context, builder, kind, value, name):
    """Generate the LLVM code that loads a field of a tuple passed by reference.

    Parameters
    ----------
    context, builder
        Target context of numba, and the LLVM builder to which the code is added.
    kind : ReferencedTuple
        Type of the tuple.
    value
        Address of the tuple, an LLVM value.
    name : str
        Name of the field.

    Returns
    -------
    LLVM value
        Value of the field, or its address if it is a tuple itself.
    """
    # Fields lie one after the other in memory.
    field_types = kind.tuple_type.types
    index = kind.tuple_type.fields.index(name)
    offset = WORD_BYTES * sum(map(count_words, field_types[:index]))
    address = builder.gep(value, [ir.Constant(ir.IntType(64), offset)])
    field_type = get_argument_type(field_types[index])
    if isinstance(field_type, ReferencedTuple):
        return address
    pointer_type = context.get_value_type(field_type).as_pointer()
    loaded = builder.load(builder.bitcast(address, pointer_type), align=WORD_BYTES)

    # Metadata for LLVM's analysis of aliases by type (TBAA): the last number, 1, marks constant memory, so that no store to
    # an array makes LLVM load the field again.
    module = builder.module
    family = module.add_metadata(["patchfem"])
    leaf = module.add_metadata(["field", family, ir.Constant(ir.IntType(64), 0)])
    zero, one = (ir.Constant(ir.IntType(64), n) for n in (0, 1))
    loaded.set_metadata("tbaa", module.add_metadata([leaf, leaf, zero, one]))
    return loaded
