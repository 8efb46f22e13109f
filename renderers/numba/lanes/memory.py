"""Loads and stores lanes from and to rows of arrays (n, m) in C order, without bounds checks."""

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.extending import intrinsic

from .lanes import COUNT, INTEGER, MASK, REAL, call

LANES = {REAL.dtype: REAL, INTEGER.dtype: INTEGER}  # of an array's numbers


def address(context, builder, array, values):
    """Of one number. values: the array, row and column."""
    inside = context.make_array(array)(context, builder, values[0])
    return cgutils.get_item_pointer(context, builder, array, inside, values[1:3], wraparound=False)


def addresses(context, builder, array, values):
    """Of a number for each lane. values: the array, row and columns."""
    start = address(context, builder, array, [*values[:2], ir.Constant(values[1].type, 0)])
    pointers = builder.gep(start, [values[2]], source_etype=context.get_data_type(array.dtype))
    pointers.type = ir.VectorType(start.type, COUNT)  # llvmlite takes it for one
    return pointers


def align(context, array):
    """Bytes: that of a number, as lanes may begin with any."""
    return context.get_abi_sizeof(context.get_data_type(array.dtype))


@intrinsic
def load(_, array, row, column):
    """The numbers of a row from a column on."""
    lanes = LANES[array.dtype]

    def write(context, builder, told, values):
        kind = context.get_value_type(lanes)
        start = builder.bitcast(address(context, builder, array, values), kind.as_pointer())
        return builder.load(start, align=align(context, array))

    return lanes(array, types.intp, types.intp), write


@intrinsic
def store(_, array, row, column, lanes):
    """Write lanes to a row from a column on."""

    def write(context, builder, told, values):
        start = builder.bitcast(address(context, builder, array, values), values[3].type.as_pointer())
        builder.store(values[3], start, align=align(context, array))
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, LANES[array.dtype]), write


@intrinsic
def store_some(_, array, row, column, lanes, mask):
    """Write the lanes of the mask, side by side, to a row from a column on.

    LLVM's `vector.compress` and a store of all would do too, but what it makes of lanes that take several registers
    breaks (22.1).
    """

    def write(context, builder, told, values):
        lanes, start = values[3], address(context, builder, array, values)
        call(builder, "masked.compressstore", ir.VoidType(), lanes, start, values[4])
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, LANES[array.dtype], MASK), write


@intrinsic
def gather(_, array, row, columns, mask):
    """Of each lane of the mask the number in its column; 0 in the others."""
    lanes = LANES[array.dtype]

    def write(context, builder, told, values):
        kind = context.get_value_type(lanes)
        pointers, zeros = addresses(context, builder, array, values), ir.Constant(kind, [0] * COUNT)
        return call(builder, "masked.gather", kind, pointers, values[3], zeros, overloads=[kind, pointers.type])

    return lanes(array, types.intp, INTEGER, MASK), write


@intrinsic
def scatter(_, array, row, columns, mask, lanes):
    """Write the lanes of the mask, each to its column; no two share one."""

    def write(context, builder, told, values):
        pointers, numbers = addresses(context, builder, array, values), values[4]
        overloads = [numbers.type, pointers.type]
        call(builder, "masked.scatter", ir.VoidType(), numbers, pointers, values[3], overloads=overloads)
        return context.get_dummy_value()

    return types.none(array, types.intp, INTEGER, MASK, LANES[array.dtype]), write
