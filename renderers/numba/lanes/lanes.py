"""Lanes: a Numba type of COUNT numbers side by side, which the kernel computes with as with one number.

It is LLVM's vector type, for which a processor has registers. A number combined with lanes applies to each of them. A
comparison gives a mask, which `&`, `|`, `~`, `select`, `any_of` and `count_of` take. Nothing is fused or reordered
but by `fma` (NUM-3).
"""

import math
import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.extending import intrinsic, lower_builtin, lower_cast, register_model
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from ..needs import SINGLE

BYTES = 64  # of real lanes: a register of AVX-512; for a processor with smaller ones LLVM takes several
COUNT = BYTES // (4 if SINGLE else 8)


class Lanes(types.Type):
    """COUNT numbers or truth values of a type."""

    def __init__(self, dtype):
        self.dtype = dtype
        super().__init__(name=f"lanes({dtype})")


@register_model(Lanes)
class LanesModel(models.PrimitiveModel):
    def __init__(self, manager, lanes):
        element = ir.IntType(1) if lanes == MASK else manager.lookup(lanes.dtype).get_value_type()
        super().__init__(manager, lanes, ir.VectorType(element, COUNT))


REAL = Lanes(types.float32 if SINGLE else types.float64)
INTEGER = Lanes(types.int32)  # places in arrays
BITS = Lanes(types.int32 if SINGLE else types.int64)  # of a REAL
WORDS = Lanes(types.int64)  # words of 32 bits, with room for their products
MASK = Lanes(types.boolean)


def in_all(builder, number, kind):
    """An LLVM number in every lane of the LLVM vector type `kind`."""
    anything, index = ir.Constant(kind, ir.Undefined), ir.VectorType(ir.IntType(32), COUNT)
    first = builder.insert_element(anything, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, anything, ir.Constant(index, [0] * COUNT))


def call(builder, name, result, *values, overloads=()):
    """LLVM's intrinsic `name`, which ends in the types that it is there for: of the first of the values, or others."""
    for kind in overloads or [values[0].type]:
        element = kind.element
        short = "p0" if element.is_pointer else {"float": "f32", "double": "f64"}.get(str(element), str(element))
        name += f".v{COUNT}{short}"
    kind = ir.FunctionType(result, [value.type for value in values])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm." + name), values)


@lower_cast(types.Number, Lanes)
def number_to_lanes(context, builder, number, lanes, value):
    return in_all(builder, context.cast(builder, value, number, lanes.dtype), context.get_value_type(lanes))


def lanes_of(number):
    """What a number of this type is spread to; lanes are what they are."""
    if isinstance(number, Lanes):
        return number
    return INTEGER if isinstance(number, types.Integer) else REAL


def operation(function, write, answers=None):
    """Teach Numba an operator of lanes of one type, and numbers: write(builder, *values) is its code.

    answers: type of the result; None for that of the lanes.
    """

    @infer_global(function)
    class Template(AbstractTemplate):
        def generic(self, arguments, _):
            lanes = {argument for argument in arguments if isinstance(argument, Lanes)}
            if len(lanes) == 1 and all(isinstance(argument, Lanes | types.Number) for argument in arguments):
                (lanes,) = lanes
                return signature(answers or lanes, *[lanes] * len(arguments))

    def lower(context, builder, told, values):
        return write(builder, *values)

    for count in (1, 2):
        lower_builtin(function, *[Lanes] * count)(lower)


def of_reals(value):
    return isinstance(value.type.element, ir.FloatType | ir.DoubleType)


def arithmetic(function, real, integer):
    """An operator by the names of its two instructions."""
    operation(function, lambda builder, a, b: getattr(builder, real if of_reals(a) else integer)(a, b))


def comparison(function, sign):
    """With a NaN only `!=` is true."""

    def write(builder, a, b):
        if not of_reals(a):
            return builder.icmp_signed(sign, a, b)
        return (builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered)(sign, a, b)

    operation(function, write, MASK)


arithmetic(operator.add, "fadd", "add")
arithmetic(operator.sub, "fsub", "sub")
arithmetic(operator.mul, "fmul", "mul")
arithmetic(operator.truediv, "fdiv", "")
arithmetic(operator.and_, "", "and_")
arithmetic(operator.or_, "", "or_")
arithmetic(operator.xor, "", "xor")
arithmetic(operator.lshift, "", "shl")
arithmetic(operator.rshift, "", "ashr")
comparison(operator.lt, "<")
comparison(operator.le, "<=")
comparison(operator.gt, ">")
comparison(operator.ge, ">=")
comparison(operator.eq, "==")
comparison(operator.ne, "!=")
operation(operator.invert, lambda builder, a: builder.not_(a))
operation(operator.neg, lambda builder, a: builder.fneg(a))
operation(abs, lambda builder, a: call(builder, "fabs", a.type, a))
operation(math.sqrt, lambda builder, a: call(builder, "sqrt", a.type, a))


@intrinsic
def fma(_, a, b, c):
    """a b + c, rounded once."""
    return REAL(REAL, REAL, REAL), lambda context, builder, told, values: call(builder, "fma", values[0].type, *values)


@intrinsic
def select(_, mask, a, b):
    """`a` in the lanes of the mask, `b` in the others."""
    lanes = lanes_of(a if isinstance(a, Lanes) else b)
    return lanes(MASK, lanes, lanes), lambda context, builder, told, values: builder.select(*values)


@intrinsic
def spread(_, number):
    """A number in every lane."""
    lanes = lanes_of(number)
    return lanes(lanes), lambda context, builder, told, values: values[0]


@intrinsic
def numbered(_):
    """0, 1, 2, .., as INTEGER."""
    kind = ir.VectorType(ir.IntType(32), COUNT)
    return INTEGER(), lambda context, builder, told, values: ir.Constant(kind, list(range(COUNT)))


@intrinsic
def lane(_, lanes, k):
    """Lane `k`."""
    return lanes.dtype(lanes, types.intp), lambda context, builder, told, values: builder.extract_element(*values)


@intrinsic
def put(_, lanes, k, number):
    """The lanes with a number in lane `k`."""

    def write(context, builder, told, values):
        return builder.insert_element(values[0], values[2], values[1])

    return lanes(lanes, types.intp, lanes.dtype), write


@intrinsic
def any_of(_, mask):
    """Whether a lane of the mask is true."""

    def write(context, builder, told, values):
        bits = builder.bitcast(values[0], ir.IntType(COUNT))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(MASK), write


@intrinsic
def count_of(_, mask):
    """How many lanes of the mask are true."""

    def write(context, builder, told, values):
        return builder.zext(builder.ctpop(builder.bitcast(values[0], ir.IntType(COUNT))), ir.IntType(64))

    return types.int64(MASK), write


def of_one(result, lanes, write):
    """An intrinsic of lanes. write(builder, values, kind): its code, `kind` being the LLVM type of the result."""

    @intrinsic
    def function(_, a):
        def code(context, builder, told, values):
            return write(builder, values[0], context.get_value_type(result))

        return (result(lanes), code) if a == lanes else None

    return function


largest_of = of_one(REAL.dtype, REAL, lambda builder, a, kind: call(builder, "vector.reduce.fmax", kind, a))
smallest_of = of_one(REAL.dtype, REAL, lambda builder, a, kind: call(builder, "vector.reduce.fmin", kind, a))
rounded = of_one(REAL, REAL, lambda builder, a, kind: call(builder, "rint", kind, a))  # to a whole number
to_reals = of_one(REAL, INTEGER, lambda builder, a, kind: builder.sitofp(a, kind))
to_bits = of_one(BITS, REAL, lambda builder, a, kind: builder.bitcast(a, kind))
from_bits = of_one(REAL, BITS, lambda builder, a, kind: builder.bitcast(a, kind))
whole = of_one(BITS, REAL, lambda builder, a, kind: builder.fptosi(a, kind))  # of whole numbers
from_whole = of_one(REAL, BITS, lambda builder, a, kind: builder.sitofp(a, kind))
to_words = of_one(WORDS, INTEGER, lambda builder, a, kind: builder.zext(a, kind))
from_words = of_one(INTEGER, WORDS, lambda builder, a, kind: builder.trunc(a, kind))  # the low 32 bits
