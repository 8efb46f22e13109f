"""Keeps NVVM from joining a product and a sum into one rounding, as it does unless it is told not to (NUM-3).

Numba has no option for it, but passes options on to its function `compile_ir`.
"""

from numba.cuda.cudadrv import nvvm


def forbid_contraction():
    compile_ir = nvvm.compile_ir
    nvvm.compile_ir = lambda ir, **options: compile_ir(ir, **{**options, "fma": False})
