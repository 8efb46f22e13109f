"""What makes functions of the kernel of plain ones: Numba for the processor, Numba for a GPU, or its simulator.

kernel: inlined by LLVM. inlined: inlined before LLVM first sees the caller, which lets a miss go straight on to the
next shape. called: a function of its own, for what is large and stands in several places, or calls itself.

Floating point is what the job asks for, strict unless it does (NUM-3), and a division by zero gives inf or NaN. NVVM
contracts unless it is told not to: gpu/compiler.py.
"""

from .needs import FAST, FLOATING_POINT, SIMULATED, TARGET

# The rewriting of floating point that LLVM is allowed (NUM-3).
FASTMATH = {"strict": False, "contract": {"contract"}, "fast": True}[FLOATING_POINT]

if SIMULATED:

    def kernel(function):
        """Nothing: threads of the simulator are Python's."""
        return function

    called = inlined = kernel
elif TARGET == "cuda":
    from numba import cuda

    OPTIONS = {"device": True, "fastmath": FAST}
    kernel = cuda.jit(**OPTIONS, forceinline=True)
    called = cuda.jit(**OPTIONS)
    inlined = cuda.jit(**OPTIONS, inline="always")
else:
    from numba import njit

    # Arrays are not reference-counted, as counting the scene's at each call takes two thirds of the time; calls are
    # inlined, as a scene passed on is a hundred words; and Python never calls these functions.
    OPTIONS = {"error_model": "numpy", "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    OPTIONS["fastmath"] = FASTMATH
    kernel = njit(**OPTIONS, forceinline=True)
    called = njit(**OPTIONS)
    inlined = njit(error_model="numpy", fastmath=FASTMATH, inline="always")
