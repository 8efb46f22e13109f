"""The GPU, or Numba's simulator of one."""

import sys
import threading

from numba import cuda as numba_cuda

from ..needs import SIMULATED

if SIMULATED:
    import numpy as np
    from numba.cuda.simulator.kernel import BlockThread, _get_kernel_context
    from numba.cuda.simulator.kernelapi import FakeCUDAShared
    from numba.np.numpy_support import as_dtype
    from numba.types import Type

    # The simulator asks again and again whether the threads of a block are done or wait, and so takes half of the time
    # from them. Now it waits a while for each that is still at work.
    sys.setswitchinterval(0.0005)

    def is_alive(thread):
        if not thread.syncthreads_blocked:
            thread.join(0.0002)
        return threading.Thread.is_alive(thread)

    BlockThread.is_alive = is_alive
    allocating = threading.Lock()

    def shared_array(shared, shape, dtype):
        """The array of this line, one for a block. Numba's own may give two threads that come first one each."""
        caller = sys._getframe(1)
        place = caller.f_code.co_filename, caller.f_lineno
        with allocating:
            if place not in shared._allocations:
                shared._allocations[place] = np.empty(shape, as_dtype(dtype) if isinstance(dtype, Type) else dtype)
            return shared._allocations[place]

    FakeCUDAShared.array = shared_array

    class Simulated:
        """`cuda` as a kernel sees it. Numba's own way to lend it, by changing globals, is not safe between threads."""

        def __getattr__(self, name):
            return getattr(_get_kernel_context(), name)

    cuda = Simulated()
else:
    cuda = numba_cuda

# Operations that a multiprocessor starts in each clock cycle, in float32 and float64, by compute capability: CUDA C++
# Programming Guide, table "Throughput of Native Arithmetic Instructions".
LANES = {
    (7, 0): (64, 32), (7, 5): (64, 2), (8, 0): (64, 32), (8, 6): (128, 2),
    (8, 9): (128, 2), (9, 0): (128, 64), (10, 0): (128, 64), (12, 0): (128, 2),
}  # fmt: skip


WAITS = {"auto": "AUTO", "spin": "SPIN", "yield": "YIELD", "block": "BLOCKING_SYNC"}  # CU_CTX_SCHED_.., by gpu_wait
held = {"wait": "auto"}  # the flag of this process's context


def begin(wait):
    """Makes the GPU's context, in which a thread of the processor waits for the GPU as `wait` says."""
    if SIMULATED:
        return
    if wait != held["wait"]:
        from cuda.bindings.driver import CUctx_flags
        from numba.cuda.cudadrv.driver import driver

        flag = getattr(CUctx_flags, "CU_CTX_SCHED_" + WAITS[wait])
        driver.cuDevicePrimaryCtxSetFlags(driver.cuDeviceGet(0), int(flag))  # Numba's GPU is the first
        held["wait"] = wait
    numba_cuda.current_context()


def describe():
    """The event `device` of the contract."""
    unknown = (
        *("compute_capability", "multiprocessors", "clock_mhz", "memory_bytes", "shared_bytes_per_block"),
        *("registers_per_multiprocessor", "driver", "peak_fp32_flops", "peak_fp64_flops"),
    )
    if SIMULATED:
        return {"name": "CUDA simulator of Numba (no GPU)", "simulated": True, **dict.fromkeys(unknown)}
    from numba.cuda.cudadrv import driver

    device = numba_cuda.get_current_device()
    name = device.name.decode() if isinstance(device.name, bytes) else device.name
    clock, units = device.CLOCK_RATE / 1e3, device.MULTIPROCESSOR_COUNT
    # A fused multiply-add is two operations, as the makers of GPUs count them.
    peaks = [2e6 * clock * units * lanes for lanes in LANES.get(tuple(device.compute_capability), ())] or [None, None]
    return {
        "name": name,
        "simulated": False,
        "compute_capability": list(device.compute_capability),
        "multiprocessors": units,
        "clock_mhz": clock,
        "memory_bytes": numba_cuda.current_context().get_memory_info().total,
        "shared_bytes_per_block": device.MAX_SHARED_MEMORY_PER_BLOCK,
        "registers_per_multiprocessor": device.MAX_REGISTERS_PER_MULTIPROCESSOR,
        "driver": ".".join(map(str, driver.get_version())),
        "peak_fp32_flops": peaks[0],
        "peak_fp64_flops": peaks[1],
    }
