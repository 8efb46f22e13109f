"""Has LLVM optimise a kernel once.

Numba optimises each function together with all that it calls, and then makes machine code of it, though all of it is
linked into the module of the caller (numba.core.codegen, CPUCodeLibrary.finalize). So what stands ten levels of calls
below the entry point is optimised ten times; here it waits for the entry point.
"""

from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen

RUNTIME = "nrt"  # Numba's library of functions for reference counts, which kernels call by their address


def optimise_only(names):
    """From here on, optimises and compiles functions of these names alone, with all that they call."""
    names = {RUNTIME, *names}
    optimise, finish = CPUCodeLibrary._optimize_final_module, CPUCodeLibrary._finalize_final_module
    set_env = JITCPUCodegen.set_env

    def optimise_some(library):
        if library.name in names:
            optimise(library)

    def finish_some(library):
        if library.name in names:
            finish(library)
        else:
            library._finalize_dynamic_globals()
            library._finalized = True

    def set_env_of_some(codegen, name, env):
        if codegen._engine.get_global_value_address(name):  # of a function without machine code there is none
            set_env(codegen, name, env)

    CPUCodeLibrary._optimize_final_module, CPUCodeLibrary._finalize_final_module = optimise_some, finish_some
    JITCPUCodegen.set_env = set_env_of_some
