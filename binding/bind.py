"""Binding of arrays to the C core, which reads and writes them where they are.

A field that points to an array says in its header what array that is, e.g. ``const double *J SHAPE(6, n);``:
its type, its shape, and by ``const`` that C only reads it (csrc/shape.h). Whoever binds checks nothing else.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from _cffi_backend import FFI
from numpy.typing import NDArray

_FFI: Final = FFI()
_OWNER: Final = type(_FFI.new("int *"))
"""The type that ``ffi.new`` gives: as long as such an owner lives, so does the struct."""
_FLOATS: Final = ("double", "float")
_NO_SIZES: Final[Mapping[str, int]] = MappingProxyType({})

# structs are equal where their addresses are, which those of two owners that live never are
_kept: weakref.WeakKeyDictionary[Any, dict[tuple[int | None, str], list[Any]]] = weakref.WeakKeyDictionary()


class BindError(ValueError):
    """An array that C must not be given.

    Attributes:
        field: what it was to be bound to, e.g. "chain.J".
        problem: what is wrong with it; expected: what the field wants.
    """

    def __init__(self, field: str, problem: str, expected: str) -> None:
        super().__init__(field, problem, expected)  # what a copy in another process is made of
        self.field, self.problem, self.expected = field, problem, expected

    def __str__(self) -> str:
        return f"{self.field} {self.problem}; expected {self.expected}"


class Field(NamedTuple):
    """What a header says of a field that points to an array.

    Attributes:
        type: of the pointer; dtype: of what it points to.
        shape: sizes: numbers, names of the struct's own integers or of sizes given with it, "any".
        written: C writes there.
        optional: may be NULL.
        stride: integer of the struct, bytes from entry to entry; "" where they lie side by side.
    """

    type: Any
    dtype: np.dtype[Any]
    shape: tuple[int | str, ...]
    written: bool
    optional: bool
    stride: str


class Place(NamedTuple):
    """A field of one struct, and the shape that its array must have there."""

    name: str
    field: Field
    shape: tuple[int | None, ...]


def bind(
    lib: Any, struct: Any, sizes: Mapping[str, int] = _NO_SIZES, index: int | None = None, /, **arrays: Any
) -> None:
    """Let fields of a struct point to arrays, which live from then on as long as the struct.

    Numbers that shapes depend on, such as n, must be in the struct before. Either all arrays are bound, or,
    where one does not fit, none.

    Args:
        lib: of the extension module that declares the struct.
        struct: what ``ffi.new`` gave: a pointer to it, or an array of such structs.
        sizes: what the shapes depend on and the struct does not hold.
        index: of an array of structs, which of them.
        arrays: a numpy array a field, an array of ``ffi.new``, or None for an optional field.

    Raises:
        BindError: another dtype, shape or memory order, memory that C must not write, a field that is not
            declared as an array, a size that nobody gave, or a struct that somebody else owns.
    """
    put(struct, index, places(lib, struct, sizes, index, arrays), tuple(arrays.values()))


def places(
    lib: Any, struct: Any, sizes: Mapping[str, int], index: int | None, names: Iterable[str]
) -> tuple[Place, ...]:
    """Where arrays of these names go in a struct; for put, by whoever binds there again and again.

    Raises:
        BindError: a field that is not declared as an array, a size that nobody gave, or a struct that
            somebody else owns.
    """
    if type(struct) is not _OWNER or _FFI.typeof(struct).kind == "struct":
        raise BindError(str(_FFI.typeof(struct)), "does not own its memory", "what ffi.new gave")
    target = struct if index is None else struct[index]
    kind = _FFI.typeof(struct).item
    fields = _fields(lib, kind)
    found = []
    for name in names:
        field = fields.get(name)
        if field is None:
            known = ", ".join(fields) or "nothing: it has no arrays"
            raise BindError(_name(kind, name), "is not declared as an array", known)
        found.append(Place(name, field, _shape(field, kind, name, target, sizes)))
    return tuple(found)


def put(struct: Any, index: int | None, where: tuple[Place, ...], arrays: tuple[Any, ...]) -> None:
    """Bind one array a place, as bind does."""
    target = struct if index is None else struct[index]
    values = [_place(struct, target, at, array) for at, array in zip(where, arrays, strict=True)]
    keep = _kept.setdefault(struct, {})
    for (name, *_), value, array in zip(where, values, arrays, strict=True):
        setattr(target, name, value)
        keep[index, name] = hold(array) if isinstance(array, np.ndarray) else [array]


def _place(struct: Any, target: Any, at: Place, array: Any) -> Any:
    """The pointer to an array that fits its place."""
    name, field, shape = at
    if array is None:
        if not field.optional:
            wanted = _expected(field.dtype, shape, field.written)
            raise BindError(_name(_FFI.typeof(struct).item, name), "is None", wanted)
        return _FFI.NULL
    if isinstance(array, _FFI.CData):
        return _table(_name(_FFI.typeof(struct).item, name), array, shape)
    stride = int(getattr(target, field.stride)) if field.stride else None
    problem = _problem(array, field.dtype, shape, field.written, stride)
    if problem:
        expected = _expected(field.dtype, shape, field.written, stride)
        raise BindError(_name(_FFI.typeof(struct).item, name), problem, expected)
    return _FFI.cast(field.type, _FFI.from_buffer(array) if stride is None else array.ctypes.data)


def pointer(array: NDArray[Any], ctype: str, *shape: int | None, name: str = "the argument") -> Any:
    """An array as the argument of a C function; what is returned keeps it alive.

    Args:
        array: numpy array.
        ctype: of its entries, e.g. "double", or "const double" where the function only reads them.
        shape: that it must have; None for any size.
        name: of the argument, for the error.

    Raises:
        BindError: another dtype, shape or memory order, or read-only memory that the function writes.
    """
    item = ctype.removeprefix("const ")
    dtype, written = _dtype(_FFI.typeof(item)), item == ctype
    problem = _problem(array, dtype, shape, written)
    if problem:
        raise BindError(name, problem, _expected(dtype, shape, written))
    return _FFI.from_buffer(f"{item}[]", array)


def hold(array: NDArray[Any]) -> list[Any]:
    """What keeps the memory of an array in its place: numpy resizes none that is weakly referred to."""
    if array.base is None:
        return [array, weakref.ref(array)]
    owners: list[Any] = [array]
    while isinstance(owners[-1].base, np.ndarray):
        owners.append(owners[-1].base)
    return owners + [weakref.ref(owner) for owner in owners]


@cache
def _fields(lib: Any, kind: Any) -> dict[str, Field]:
    """What the headers of an extension module say of a struct; see csrc/build.py."""
    types = dict(kind.fields)
    found = {}
    for line in _FFI.string(lib.arrays()).decode().splitlines():
        struct, name, flags, stride, *sizes = line.split("|")
        if struct == kind.cname.removeprefix("struct "):
            shape = tuple(int(size) if size.isdigit() else size for size in sizes)
            pointing = types[name].type
            found[name] = Field(pointing, _dtype(pointing.item), shape, "w" in flags, "o" in flags, stride)
    return found


def _shape(
    field: Field, kind: Any, name: str, target: Any, sizes: Mapping[str, int]
) -> tuple[int | None, ...]:
    shape: list[int | None] = []
    for size in field.shape:
        if isinstance(size, int):
            shape.append(size)
        elif size in sizes:
            shape.append(sizes[size])
        elif size == "any":
            shape.append(None)
        else:
            try:
                shape.append(int(getattr(target, size)))
            except AttributeError:
                problem = f"depends on the size {size}"
                raise BindError(_name(kind, name), problem, "it among the sizes") from None
    return tuple(shape)


def _table(field: str, table: Any, shape: tuple[int | None, ...]) -> Any:
    """An array of structs; its type is for cffi to check."""
    if type(table) is not _OWNER or _FFI.typeof(table).kind != "array":
        raise BindError(field, f"is a {_FFI.typeof(table).cname}", "an array that ffi.new gave")
    if shape not in ((None,), (len(table),)):
        raise BindError(field, f"has {len(table)} entries", f"shape {_shown(shape)}")
    return table


def _problem(
    array: Any, wanted: np.dtype[Any], shape: tuple[int | None, ...], written: bool, stride: int | None = None
) -> str:
    """What is wrong with an array; "" if nothing is."""
    if type(array) is not np.ndarray and (
        not isinstance(array, np.ndarray) or isinstance(array, np.ma.MaskedArray)
    ):
        return f"is of type {type(array).__name__}"
    if array.dtype is not wanted and not _fits(array.dtype, wanted):
        return f"has dtype {array.dtype}"
    if array.shape != shape and not _alike(array.shape, shape):
        return f"has shape {array.shape}"
    flags = array.flags
    if stride is None and not flags.c_contiguous:
        return "is not C-contiguous"
    if stride is not None and array.strides != (stride,):
        return f"has strides {array.strides}"
    if not flags.aligned:
        return "is not aligned to its type in memory"
    return "is read-only" if written and not flags.writeable else ""


def _alike(have: tuple[int, ...], shape: tuple[int | None, ...]) -> bool:
    return len(have) == len(shape) and all(b in (None, a) for a, b in zip(have, shape, strict=True))


def _expected(
    dtype: np.dtype[Any], shape: tuple[int | None, ...], written: bool, stride: int | None = None
) -> str:
    order = "a C-contiguous array" if stride is None else f"an array with entries {stride} bytes apart"
    return f"{order} of {dtype}, shape {_shown(shape)}{', that C may write' * written}"


@cache
def _dtype(ctype: Any) -> np.dtype[Any]:
    """The dtype of a C type of numbers, or of a struct of them."""
    if ctype.kind == "struct":
        fields = ctype.fields
        return np.dtype(
            {
                "names": [name for name, _ in fields],
                "formats": [_dtype(field.type) for _, field in fields],
                "offsets": [field.offset for _, field in fields],
                "itemsize": _FFI.sizeof(ctype),
            }
        )
    if ctype.kind == "array":
        return np.dtype((_dtype(ctype.item), (ctype.length,)))
    if ctype.kind == "pointer":
        return np.dtype(f"V{_FFI.sizeof(ctype)}")  # numpy has no pointers
    if ctype.cname in _FLOATS:
        return np.dtype(f"f{_FFI.sizeof(ctype)}")
    return np.dtype(f"{'i' if int(_FFI.cast(ctype, -1)) < 0 else 'u'}{_FFI.sizeof(ctype)}")


def _fits(have: np.dtype[Any], wanted: np.dtype[Any]) -> bool:
    """Whether entries lie in memory as C wants them; a bool is a byte that is 0 or 1."""
    if wanted.fields is None or have.fields is None:
        return have == wanted or (have == np.bool_ and wanted == np.uint8)
    ours, theirs = (
        {at: dtype for dtype, at, *_ in fields.values()} for fields in (have.fields, wanted.fields)
    )
    return (
        have.itemsize == wanted.itemsize
        and ours.keys() == theirs.keys()
        and all(_fits(dtype, theirs[at]) for at, dtype in ours.items())
    )


def _name(kind: Any, field: str) -> str:
    return f"{kind.cname.removeprefix('struct ')}.{field}"


def _shown(shape: tuple[int | None, ...]) -> str:
    sizes = ["any" if size is None else str(size) for size in shape]
    return f"({', '.join(sizes)}{',' * (len(sizes) == 1)})"
