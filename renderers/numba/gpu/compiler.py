"""NVIDIA's compiler behind Numba: makes it strict, and names the remedy if it is missing."""

from numba.cuda.cudadrv import nvvm

from renderers import worker

INSTALL = "pip install 'rayrace[cuda]'"


def forbid_contraction():
    """Stops NVVM from joining a product and a sum into one rounding (NUM-3).

    Numba has no option for it, but passes options on to its function `compile_ir`.
    """
    compile_ir = nvvm.compile_ir
    nvvm.compile_ir = lambda ir, **options: compile_ir(ir, **{**options, "fma": False})


def refuse_if_missing(error):
    """Refuse the job if `error` is that a library of the compiler was not found; else return."""
    if "No such file: lib" in str(error) or isinstance(error, ImportError | OSError):
        worker.refuse(f"NVIDIA's compiler is not installed ({INSTALL})")
