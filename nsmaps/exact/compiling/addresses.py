"""Named tuples of many arrays that compiled functions hand on by their address.

Numba hands a tuple on item by item, and an array as its data, sizes and strides: a table of 70 arrays is 500 arguments of each
function, which every caller takes apart and every function puts together again. Tuples of a class with the decorator `by_address`
are written once, when Python calls, into words of 8 bytes: numbers as they are, of an array the addresses of its data and its
shape. Compiled functions are given the address of the words.
"""

from collections.abc import Iterator
from functools import partial
from hashlib import sha256
from itertools import accumulate
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, models, register_model, typeof_impl, unbox
from numba.np.numpy_support import as_dtype

from nsmaps.exact.compiling import internals

SIZE = 8  #: bytes of a word
DIGITS = 16  #: of the digest in the name of a type, which stands in the names of all functions that take it
WORD, BYTE = ir.IntType(64), ir.IntType(8)
HEAD = object.__basicsize__ // SIZE  #: words of a Python object before what its type adds
DATA, SHAPE = HEAD, HEAD + 2  #: words of an array at which its data and its shape have their addresses, in NumPy's public layout


class Address(types.Type):  # type: ignore[misc]
    """The address of the words of a named tuple."""

    def __init__(self, instance_class: Any, fields: tuple[types.Type, ...]) -> None:
        """Of a class with fields of these types."""
        self.instance_class, self.types = instance_class, fields
        text = f"{instance_class.__module__}({', '.join(map(str, fields))})"
        super().__init__(f"{instance_class.__name__}_{sha256(text.encode()).hexdigest()[:DIGITS]}")

    def __iter__(self) -> Iterator[types.Type]:
        """The types of the fields, as of a tuple."""
        return iter(self.types)

    def place(self, name: str) -> tuple[types.Type, int]:
        """The type of a field, and the words before it."""
        k = self.instance_class._fields.index(name)
        return self.types[k], sum(map(words, self.types[:k]))


def words(kind: types.Type) -> int:
    """How many words a value takes. TypeError for types that are not kept in words."""
    match kind:
        case Address() | types.BaseTuple():
            return sum(map(words, kind))
        case types.Array(layout="C"):
            return 1 + kind.ndim
        case types.Integer(bitwidth=64) | types.Float(bitwidth=64) | types.Boolean():
            return 1
    raise TypeError(f"a field is {kind}; expected: an array whose rows follow one another, a number, or a tuple of these")


def places(kinds: Any) -> Iterator[tuple[types.Type, int]]:
    """The types of the items of a tuple, each with the words before it."""
    return zip(kinds, accumulate(map(words, kinds), initial=0), strict=False)


def by_address(instance_class: Any) -> Any:
    """The decorator of a class of named tuples that compiled functions hand on by their address."""
    if not internals.absent:

        @typeof_impl.register(instance_class)  # type: ignore[untyped-decorator]
        def typeof_address(value: Any, context: Any) -> Address:
            return Address(instance_class, tuple(typeof_impl(each, context) for each in value))

    return instance_class


@register_model(Address)
class AddressModel(models.OpaqueModel):  # type: ignore[misc]
    """A pointer."""


@infer_getattr
class AddressFields(internals.AttributeTemplate):  # type: ignore[misc]
    """The types of the fields."""

    key = Address

    def generic_resolve(self, typ: Address, attr: str) -> types.Type | None:
        """That of one field; None for another name."""
        kind, _ = typ.place(attr) if attr in typ.instance_class._fields else (None, 0)
        return kind


def _at(builder: Any, address: Any, word: int, kind: Any) -> Any:
    """A pointer to a value of an LLVM type that is some words behind an address."""
    return builder.bitcast(builder.gep(address, [WORD(SIZE * word)]), kind.as_pointer())


def _load(builder: Any, address: Any, word: int, kind: Any) -> Any:
    """A value that no compiled function changes, of an LLVM type."""
    value = builder.load(_at(builder, address, word, kind))
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@lower_getattr_generic(Address)  # type: ignore[untyped-decorator]
def field(context: Any, builder: Any, typ: Address, address: Any, attr: str) -> Any:
    """The value of a field."""
    return _value(context, builder, *typ.place(attr), address)


def _value(context: Any, builder: Any, kind: types.Type, word: int, address: Any) -> Any:
    """The value of a type that is some words behind an address."""
    match kind:
        case Address():
            return _at(builder, address, word, BYTE)
        case types.Array():
            return _array(context, builder, kind, address, word)
        case types.BaseTuple():
            items = [_value(context, builder, each, word + begin, address) for each, begin in places(kind)]
            return context.make_tuple(builder, kind, items)
    model = context.data_model_manager[kind]
    return model.from_data(builder, _load(builder, address, word, model.get_data_type()))


def _array(context: Any, builder: Any, kind: types.Array, address: Any, word: int) -> Any:
    """An array, whose rows follow one another: its strides follow from its shape."""
    array = context.make_array(kind)(context, builder)
    shape = [_load(builder, address, word + 1 + axis, WORD) for axis in range(kind.ndim)]
    array.itemsize = size = context.get_constant(types.intp, as_dtype(kind.dtype).itemsize)
    times = partial(builder.mul, flags=["nsw"])
    *strides, _ = accumulate(reversed(shape), times, initial=size)
    *_, array.nitems = accumulate(shape, times)
    array.shape, array.strides = (cgutils.pack_array(builder, each, WORD) for each in (shape, strides[::-1]))
    array.data = _load(builder, address, word, array.data.type)
    array.meminfo, array.parent = (cgutils.get_null_value(each.type) for each in (array.meminfo, array.parent))
    return array._getvalue()


@unbox(Address)  # type: ignore[untyped-decorator]
def unbox_address(typ: Address, value: Any, c: Any) -> NativeValue:
    """The address of the words of a named tuple, written on the stack of the call."""
    address = c.builder.bitcast(cgutils.alloca_once(c.builder, WORD, size=words(typ)), BYTE.as_pointer())
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    _write(typ, value, address, failed, c)
    same = ir.FunctionType(address.type, [address.type])
    address = c.builder.asm(same, "", "=r,0,~{memory}", [address], side_effect=True)  # loads do not move ahead of what is written
    return NativeValue(address, is_error=c.builder.load(failed))


def _write(kind: types.Type, value: Any, address: Any, failed: Any, c: Any) -> None:
    """Write the words of a Python object of a type behind an address."""
    match kind:
        case Address() | types.BaseTuple():
            for k, (each, begin) in enumerate(places(kind)):
                _write(each, c.pyapi.tuple_getitem(value, k), _at(c.builder, address, begin, BYTE), failed, c)
        case types.Array():
            head = c.builder.bitcast(value, BYTE.as_pointer())
            shape = c.builder.load(_at(c.builder, head, SHAPE, BYTE.as_pointer()))
            c.builder.store(c.builder.load(_at(c.builder, head, DATA, WORD)), _at(c.builder, address, 0, WORD))
            for axis in range(kind.ndim):
                c.builder.store(c.builder.load(_at(c.builder, shape, axis, WORD)), _at(c.builder, address, 1 + axis, WORD))
        case _:
            native = c.unbox(kind, value)
            with c.builder.if_then(native.is_error, likely=False):
                c.builder.store(cgutils.true_bit, failed)
            c.context.pack_value(c.builder, kind, native.value, _at(c.builder, address, 0, c.context.get_data_type(kind)))
