"""Arrays as compiled functions of this room hand them on: what keeps them alive, where the numbers are, and how many.

An array of numba's own also tells how long an item is, how far apart neighbours are along each axis, and which object
of Python it is: a contact and its memory are 81 numbers of every call, and any index may count from the end. All of
that is compiled again wherever an array is named. Here arrays are contiguous and indices count from 0, so that a
contact and its memory are 35 numbers.

An entry takes numpy's arrays in by `lean` and returns them by `given_back`; what others are, that is such as are not
contiguous or must not be written to, stay numba's. In between code is written as for numpy's, with less: an item is
``array[i, j]``, with an index for each axis; fewer indices, or ``array[a:b]`` and ``array[i, a:b]`` with 0 ≤ a ≤ b,
are views; there are ``.size``, ``.shape``, ``len`` and ``is``, and `empty` and `duplicate` for new ones. What is not
here, such as a sum or the smallest item, is a loop.
"""

import operator
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import lower_builtin, lower_getattr, models, register_model
from numba.np.arrayobj import populate_array

Array = TypeVar("Array", bound=npt.NDArray[Any])
Anything = TypeVar("Anything")

ALIGNED = 32
"""Bytes to whose multiples new arrays are aligned, for loops over several numbers at once."""


class Lean(types.Type):
    """Type of lean arrays of a kind of number with so many axes, to which references are counted or not."""

    def __init__(self, dtype: Any, ndim: int, counts: bool) -> None:
        self.dtype, self.ndim, self.counts = dtype, ndim, counts
        super().__init__(f"lean({dtype}, {ndim}, {counts})")


DATA, SHAPE, OWNER = range(3)
"""Fields of a lean array; the last, which is null for what is somebody else's, only where references are counted."""


OWNED = types.MemInfoPointer(types.voidptr)


@register_model(Lean)
class _Model(models.StructModel):
    def __init__(self, manager: Any, kind: Lean) -> None:
        fields = [("data", types.CPointer(kind.dtype)), ("shape", types.UniTuple(types.intp, kind.ndim))]
        owner = [("owner", OWNED)] if kind.counts else []
        super().__init__(manager, kind, fields + owner)

    def traverse(self, _builder: Any) -> list[Any]:
        """Return the fields that may have references counted, which is for a whole array: none."""
        return []

    def has_nrt_meminfo(self) -> bool:
        return self._fe_type.counts

    def get_nrt_meminfo(self, builder: Any, value: Any) -> Any:
        return builder.extract_value(value, OWNER)


def lean(argument: Anything) -> Anything:
    """Return an argument of an entry as a lean array, or a tuple with its arrays as such.

    References are not counted to them: who calls the entry keeps its arguments alive.
    """
    return argument


def given_back(result: Any, _given: Anything) -> Anything:
    """Return an array as numpy's, or a tuple with its arrays as such: those that were given where it has the very same.

    Others have to have been made by `empty` or `duplicate`.
    """
    return result


def counted(arrays: Anything) -> Anything:
    """Return a lean array, or a tuple with its arrays, as of the kind that `empty` makes, which may take its place."""
    return arrays


def uncounted(arrays: Anything) -> Anything:
    """Return a lean array, or a tuple with its arrays, without references to it being counted.

    Something else has to keep it alive (see `keep`). Each reference that is counted is an atomic operation, which for
    small groups costs more than the physics.
    """
    return arrays


def keep(_array: Any) -> None:
    """Have an array live until here: numba lets go of one after its last use, and a view of it may not count as one."""


def empty(shape: Any, dtype: Any) -> npt.NDArray[Any]:
    """Return a new array of a shape, with whatever stands there."""
    return np.empty(shape, dtype=dtype)


def duplicate(array: Array) -> Array:
    """Return a copy."""
    return array.copy()


def fetch(_array: Any, *_index: Any) -> None:
    """Have the processor bring an item near that is asked for soon, where it could not guess that by itself."""


def _several(kind: Any) -> bool:
    return isinstance(kind, types.BaseTuple)


# -- types -----------------------------------------------------------------------------------------


def _leaned(kind: Any, counts: bool | None = None) -> Any:
    """Return the type of a value whose arrays are lean; of lean ones it says whether references shall be counted."""
    if isinstance(kind, types.Array) and kind.layout == "C" and kind.mutable and kind.ndim > 0 and counts is None:
        return Lean(kind.dtype, kind.ndim, False)
    if isinstance(kind, Lean) and counts is not None:
        return Lean(kind.dtype, kind.ndim, counts)
    if _several(kind):
        named = getattr(kind, "instance_class", None)
        return types.BaseTuple.from_types([_leaned(each, counts) for each in kind], named)
    return kind


def is_lean(kind: Any) -> bool:
    """Return whether a type is one of lean arrays, or has such in it."""
    return isinstance(kind, Lean) or (_several(kind) and any(is_lean(each) for each in kind))


def _restored(result: Any, given: Any) -> Any:
    if isinstance(result, Lean):
        if isinstance(given, types.Array):
            return given
        return result if isinstance(given, Lean) else types.Array(result.dtype, result.ndim, "C")
    if _several(result):
        named = getattr(result, "instance_class", None)
        return types.BaseTuple.from_types([_restored(*pair) for pair in zip(result, given, strict=True)], named)
    return result


@infer_global(lean)
class _TypeOfLean(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(_leaned(args[0]), *args)


@infer_global(counted)
class _TypeOfCounted(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(_leaned(args[0], True), *args)


@infer_global(uncounted)
class _TypeOfUncounted(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(_leaned(args[0], False), *args)


@infer_global(given_back)
class _TypeOfGivenBack(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(_restored(*args), *args)


@infer_global(duplicate)
class _TypeOfDuplicate(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(_leaned(args[0], True), *args)


@infer_global(keep)
class _TypeOfKeep(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(types.none, *args)


@infer_global(fetch)
class _TypeOfFetch(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(types.none, args[0], *[types.intp] * (len(args) - 1))


@infer_global(empty)
class _TypeOfEmpty(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        shape, number = args
        if isinstance(shape, types.Integer):
            return signature(Lean(number.dtype, 1, True), types.intp, number)
        return signature(Lean(number.dtype, len(shape), True), types.UniTuple(types.intp, len(shape)), number)


def _indexed(array: Any, index: Any) -> tuple[Any, Any]:
    """Return the types of what an index finds, and of the index as it is handed on; None where there is no such one."""
    several = _several(index)
    parts = list(index) if several else [index]
    if len(parts) > array.ndim or not parts:
        return None, None
    ranged = parts[-1] == types.slice2_type
    integers = parts[:-1] if ranged else parts
    if not all(isinstance(part, types.Integer) for part in integers):
        return None, None
    kinds = [types.intp] * len(integers) + [types.slice2_type] * ranged
    left = array.ndim - len(integers)
    found = Lean(array.dtype, left, array.counts) if left else array.dtype
    return found, types.BaseTuple.from_types(kinds) if several else kinds[0]


@infer_global(operator.getitem)
class _TypeOfGetItem(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        if not isinstance(args[0], Lean):
            return None
        found, index = _indexed(*args)
        return None if found is None else signature(found, args[0], index)


@infer_global(operator.setitem)
class _TypeOfSetItem(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        if not isinstance(args[0], Lean):
            return None
        found, index = _indexed(args[0], args[1])
        return signature(types.none, args[0], index, found) if found == args[0].dtype else None


@infer_global(len)
class _TypeOfLen(AbstractTemplate):
    def generic(self, args: Any, _named: Any) -> Any:
        return signature(types.intp, *args) if isinstance(args[0], Lean) else None


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Lean

    def resolve_size(self, _array: Any) -> Any:
        return types.intp

    def resolve_shape(self, array: Any) -> Any:
        return types.UniTuple(types.intp, array.ndim)


# -- machine code ----------------------------------------------------------------------------------


def _made(context: Any, builder: Any, kind: Any, data: Any, shape: Sequence[Any], owner: Any = None) -> Any:
    value = cgutils.get_null_value(context.get_value_type(kind))
    value = builder.insert_value(value, data, DATA)
    for axis, length in enumerate(shape):
        value = builder.insert_value(value, length, [SHAPE, axis])
    return value if owner is None or not kind.counts else builder.insert_value(value, owner, OWNER)


def _owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return builder.extract_value(value, OWNER) if kind.counts else cgutils.get_null_value(context.get_value_type(OWNED))


def _shape(builder: Any, kind: Any, value: Any) -> list[Any]:
    return [builder.extract_value(value, [SHAPE, axis]) for axis in range(kind.ndim)]


def _product(builder: Any, factors: Sequence[Any]) -> Any:
    product = factors[0]
    for factor in factors[1:]:
        product = builder.mul(product, factor, flags=["nsw"])
    return product


def _counted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    context.nrt.incref(builder, kind, value)
    return value


def _place(builder: Any, array: Any, shape: Sequence[Any], indices: Sequence[Any]) -> Any:
    """Return the pointer to where indices lead, of which there may be fewer than axes."""
    offset = indices[0]
    for axis, index in enumerate(indices[1:], 1):
        offset = builder.add(builder.mul(offset, shape[axis], flags=["nsw"]), index, flags=["nsw"])
    if len(indices) < len(shape):
        offset = _product(builder, [offset, *shape[len(indices) :]])
    return builder.gep(builder.extract_value(array, DATA), [offset], inbounds=True)


def _parts(builder: Any, kind: Any, value: Any) -> list[Any]:
    return list(cgutils.unpack_tuple(builder, value)) if _several(kind) else [value]


@lower_builtin(operator.getitem, Lean, types.Any)
def _get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, index_kind = sig.args
    array, shape, indices = args[0], _shape(builder, kind, args[0]), _parts(builder, index_kind, args[1])
    kinds = list(index_kind) if _several(index_kind) else [index_kind]
    left = shape[len(indices) :]
    if kinds[-1] == types.slice2_type:
        limits = context.make_helper(builder, types.slice2_type, value=indices[-1])
        indices[-1] = limits.start
        left = [builder.sub(limits.stop, limits.start, flags=["nsw"]), *left]
    pointer = _place(builder, array, shape, indices)
    if not left:
        return context.unpack_value(builder, kind.dtype, pointer)
    owner = _owner(context, builder, kind, array)
    view = _made(context, builder, sig.return_type, pointer, left, owner)
    return _counted(context, builder, sig.return_type, view)


@lower_builtin(operator.setitem, Lean, types.Any, types.Any)
def _set(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, index_kind, _ = sig.args
    array, index, value = args
    pointer = _place(builder, array, _shape(builder, kind, array), _parts(builder, index_kind, index))
    context.pack_value(builder, kind.dtype, value, pointer)
    return context.get_dummy_value()


@lower_builtin(len, Lean)
def _len(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
    return builder.extract_value(args[0], [SHAPE, 0])


@lower_getattr(Lean, "size")
def _size(_context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return _product(builder, _shape(builder, kind, value))


@lower_getattr(Lean, "shape")
def _get_shape(_context: Any, builder: Any, _kind: Any, value: Any) -> Any:
    return builder.extract_value(value, SHAPE)


@lower_builtin(operator.is_, Lean, Lean)
def _is(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
    return builder.icmp_unsigned("==", *(builder.extract_value(array, DATA) for array in args))


def _allocated(context: Any, builder: Any, kind: Any, shape: Sequence[Any]) -> tuple[Any, Any]:
    """Return a new array, and its size in bytes."""
    pointer = context.get_value_type(types.CPointer(kind.dtype))
    item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    size = _product(builder, [*shape, item])
    owner = context.nrt.meminfo_alloc_aligned(builder, size, ALIGNED)
    data = builder.bitcast(context.nrt.meminfo_data(builder, owner), pointer)
    return _made(context, builder, kind, data, shape, owner), size


@lower_builtin(empty, types.Any, types.Any)
def _empty(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _allocated(context, builder, sig.return_type, _parts(builder, sig.args[0], args[0]))[0]


@lower_builtin(keep, types.Any)
def _keep(context: Any, _builder: Any, _sig: Any, _args: Any) -> Any:
    return context.get_dummy_value()


@lower_builtin(fetch, Lean, types.VarArg(types.intp))
def _fetch(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    pointer = _place(builder, args[0], _shape(builder, sig.args[0], args[0]), args[1:])
    byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
    hint = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
    # to be read, all the way, data
    builder.call(hint, [builder.bitcast(pointer, byte), number(0), number(3), number(1)])
    return context.get_dummy_value()


@lower_builtin(duplicate, Lean)
def _duplicate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    (array,) = args
    copy, size = _allocated(context, builder, sig.return_type, _shape(builder, sig.return_type, array))
    cgutils.raw_memcpy(builder, builder.extract_value(copy, DATA), builder.extract_value(array, DATA), size, 1)
    return copy


def _converted(context: Any, builder: Any, kind: Any, goal: Any, value: Any) -> Any:
    """Return a value of one type, or what it holds, as of a type with lean arrays."""
    if goal == kind:
        return value
    if _several(kind):
        pairs = enumerate(zip(kind, goal, strict=True))
        parts = [_converted(context, builder, one, new, builder.extract_value(value, i)) for i, (one, new) in pairs]
        return context.make_tuple(builder, goal, parts)
    if isinstance(kind, Lean):
        data, shape = builder.extract_value(value, DATA), _shape(builder, kind, value)
        return _made(context, builder, goal, data, shape, _owner(context, builder, kind, value))
    array = context.make_helper(builder, kind, value=value)
    return _made(context, builder, goal, array.data, cgutils.unpack_tuple(builder, array.shape))


@lower_builtin(lean, types.Any)
@lower_builtin(counted, types.Any)
@lower_builtin(uncounted, types.Any)
def _lean(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    made = _converted(context, builder, sig.args[0], sig.return_type, args[0])
    return _counted(context, builder, sig.return_type, made)


def _as_numpy(context: Any, builder: Any, result: Any, value: Any, given: Any, original: Any) -> Any:
    """Return a value as one of numpy's arrays, or tuples with such."""
    goal = _restored(result, given)
    if goal == result:
        return value
    if _several(result):
        parts = []
        for i, pair in enumerate(zip(result, given, strict=True)):
            part, known = builder.extract_value(value, i), builder.extract_value(original, i)
            parts.append(_as_numpy(context, builder, pair[0], part, pair[1], known))
        return context.make_tuple(builder, goal, parts)
    shape, size = _shape(builder, result, value), context.get_abi_sizeof(context.get_data_type(result.dtype))
    item = context.get_constant(types.intp, size)
    make = context.make_array(goal)
    array, known = make(context, builder), make(context, builder, value=original)
    data, strides = builder.extract_value(value, DATA), [item]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    same = builder.icmp_unsigned("==", data, known.data)
    owner = builder.select(same, known.meminfo, _owner(context, builder, result, value))
    parent = builder.select(same, known.parent, cgutils.get_null_value(known.parent.type))
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=item, meminfo=owner, parent=parent)
    return array._getvalue()  # noqa: SLF001 - numba's own way to take the value out


@lower_builtin(given_back, types.Any, types.Any)
def _given_back(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    made = _as_numpy(context, builder, sig.args[0], args[0], sig.args[1], args[1])
    return _counted(context, builder, sig.return_type, made)
