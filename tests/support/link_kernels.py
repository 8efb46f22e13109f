"""Compiles and links the kernels of a job as a launch does, for a GPU that is not here: `link_kernels.py FLAGS`.

Only what asks the driver is replaced. Prints a line for each kernel: options, size and start of the program, its PTX.
"""

import json
import sys
from types import SimpleNamespace

from renderers import worker
from renderers.numba.main import prepare

prepare(job := worker.Job(sys.argv[1:]))

from numba.cuda import dispatcher  # noqa: E402
from numba.cuda.cudadrv import devices  # noqa: E402
from numba.cuda.typing.typeof import typeof  # noqa: E402

from renderers.numba.gpu import compiler, inspect, run  # noqa: E402

CAPABILITY = (9, 0)
here = SimpleNamespace(compute_capability=CAPABILITY)
dispatcher.get_current_device = lambda: here
devices.get_context = lambda *_: SimpleNamespace(device=here)
compiler.forbid_contraction()
for function, arguments in inspect.kernels_of(job):
    options = run.Launch(job, function, (64, 64), True, *arguments).kernel.targetoptions
    kept = {name: options[name] for name in ("launch_bounds", "max_registers", "lto", "opt") if options.get(name)}
    kernel = dispatcher._Kernel(function, tuple(map(typeof, arguments)), **kept)
    program = bytes(kernel.library.get_cubin((*CAPABILITY, "a")).code)
    said = {"options": kept, "bytes": len(program), "start": program[:4].hex()}
    print(json.dumps({**said, "ptx": kernel.library.get_asm_str((*CAPABILITY, "a"))}))
