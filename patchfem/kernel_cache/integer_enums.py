"""Members of an `IntEnum` as integers in kernels.

Kernels index arrays with the members of `IntEnum` classes. Numba before 0.68 types a member as an enum, which it
rejects as an index, and every version refuses to compare a member with a float. Here a member in a kernel is an integer
constant, as in Python.
"""

from numba.core import types
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr


class IntegerMember(AttributeTemplate):
    """Typing of the members of a subclass of `IntEnum`, as attributes of the class."""

    key = types.IntEnumClass

    def generic_resolve(self, enum_class, name: str):
        """Return the integer type if the class `enum_class` has a member of this name, otherwise None."""
        return types.intp if name in enum_class.instance_class.__members__ else None


def _lower_member(context, builder, enum_class, value, name: str):
    """Return the member `name` of an IntEnum class as a constant of LLVM.

    numba calls this function for `enum_class.name`, with the target `context`. The LLVM `builder` and the `value` of the
    class itself are not needed.
    """
    return context.get_constant(types.intp, int(enum_class.instance_class[name]))


def register_integer_enums() -> None:
    """Register the typing and the lowering with numba."""
    infer_getattr(IntegerMember)
    lower_getattr_generic(types.IntEnumClass)(_lower_member)
