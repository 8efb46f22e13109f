"""A GPU with its context and the programs that were compiled for it."""

import weakref

import numpy as np
from cuda.bindings import driver

from renderers import worker

from . import compiler
from . import device as devices
from .calls import call

WAITS = {  # CUctx_flags, by gpu_wait
    "auto": driver.CUctx_flags.CU_CTX_SCHED_AUTO,
    "spin": driver.CUctx_flags.CU_CTX_SCHED_SPIN,
    "yield": driver.CUctx_flags.CU_CTX_SCHED_YIELD,
    "block": driver.CUctx_flags.CU_CTX_SCHED_BLOCKING_SYNC,
}
CONSTANTS = b"constant_numbers", b"constant_integers"  # of kernel/render.h


class Buffer:
    """Bytes of the GPU's memory, freed with it."""

    def __init__(self, size):
        self.size = max(16, int(size))
        self.pointer = call(driver.cuMemAlloc, self.size)
        weakref.finalize(self, driver.cuMemFree, self.pointer)


class Session:
    """A GPU of this process. wanted: as devices.find has it."""

    SIZED = ("constant", "shared")  # memories whose kernels have the sizes of the scene in them

    def __init__(self, wanted):
        self.device, self.wait = devices.find(wanted), "auto"
        call(driver.cuCtxSetCurrent, call(driver.cuDevicePrimaryCtxRetain, self.device))
        self.stream = call(driver.cuStreamCreate, 0)
        self.target = "sm_{}{}".format(*devices.capability(self.device))
        self.modules = {}  # by source and floating_point

    def check(self, job):
        devices.check(self.device, job)
        if job.gpu_wait != self.wait:
            call(driver.cuDevicePrimaryCtxSetFlags, self.device, int(WAITS[job.gpu_wait]))
            self.wait = job.gpu_wait

    def describe(self):
        return devices.describe(self.device)

    def room_of_memories(self):
        """Bytes that the scene may have in each memory that is small."""
        limits = {"constant": "TOTAL_CONSTANT_MEMORY", "shared": "MAX_SHARED_MEMORY_PER_BLOCK"}
        return {memory: devices.attribute(self.device, name) for memory, name in limits.items()}

    def program(self, source, job):
        key = source, job.floating_point
        if key not in self.modules:
            made = compiler.compile_source(source, self.target, job.floating_point)
            self.modules[key] = call(driver.cuModuleLoadData, made.program)
        return self.modules[key]

    def kernel(self, module, name):
        return call(driver.cuModuleGetFunction, module, name.encode())

    def place(self, module, memory, given):
        """The arguments of the scene: none if it is in constant memory, into which this copies it."""
        if memory != "constant":
            return given
        for name, buffer in zip(CONSTANTS, given, strict=True):
            pointer, size = call(driver.cuModuleGetGlobal, module, name)
            call(driver.cuMemcpyDtoD, pointer, buffer.pointer, size)
        return ()

    def upload(self, array):
        buffer = Buffer(array.nbytes)
        call(driver.cuMemcpyHtoD, buffer.pointer, array.ctypes.data, array.nbytes)
        return buffer

    def room(self, size):
        """A buffer of so many bytes, all 0; of a few more if there are none, which no device has."""
        buffer = Buffer(size)
        call(driver.cuMemsetD8Async, buffer.pointer, 0, buffer.size, self.stream)
        return buffer

    def host(self, shape, dtype):
        """An array for what is downloaded again and again: in pinned memory, to which the GPU copies by itself."""
        array = np.zeros(shape, dtype)
        if array.size:
            call(driver.cuMemHostRegister, array.ctypes.data, array.nbytes, 0)
            weakref.finalize(array, driver.cuMemHostUnregister, array.ctypes.data)
        return array

    def download(self, buffer, array):
        """Fills the array and returns it."""
        if array.size:
            call(driver.cuMemcpyDtoH, array.ctypes.data, buffer.pointer, array.nbytes)
        return array

    def threads_at_once(self, threads, memory):
        """How many threads may be in work, so that each has its memory. threads: of a group. memory: bytes of one."""
        if memory == 0:
            return 2**31
        free, _ = call(driver.cuMemGetInfo)
        fit = free // memory
        if fit < threads:
            worker.refuse(
                f"the {threads} threads of a block need {threads * memory} bytes of memory, more than the"
                f" {free} that are free: take smaller blocks"
            )
        units, of_unit = (
            devices.attribute(self.device, name) for name in ("MULTIPROCESSOR_COUNT", "MAX_THREADS_PER_MULTIPROCESSOR")
        )
        return min(fit, max(threads, units * of_unit))

    def take(self, kernel, arguments, shared):
        """Returns the arguments as they can be launched. shared: nothing here, as the kernel declares it."""
        values = [np.uint64(int(a.pointer)) if isinstance(a, Buffer) else a for a in arguments]
        return Arguments(values, arguments)

    def start(self, kernel, arguments, grid, group):
        begin, end = Event(), Event()
        begin.record(self.stream)
        call(driver.cuLaunchKernel, kernel, *grid, 1, *group, 1, 0, self.stream, arguments.addresses.ctypes.data, 0)
        end.record(self.stream)
        return begin, end

    def seconds(self, events):
        """Waits for the events of kernels and returns how long these ran by the GPU's clock."""
        call(driver.cuStreamSynchronize, self.stream)
        return sum(call(driver.cuEventElapsedTime, begin.handle, end.handle) for begin, end in events) / 1e3

    def largest_group(self, kernel):
        return _of_kernel(kernel, "MAX_THREADS_PER_BLOCK")

    def resources(self, kernel, threads):
        blocks = call(driver.cuOccupancyMaxActiveBlocksPerMultiprocessor, kernel, threads, 0)
        warp = devices.attribute(self.device, "WARP_SIZE")
        most = devices.attribute(self.device, "MAX_THREADS_PER_MULTIPROCESSOR")
        return {
            "registers": _of_kernel(kernel, "NUM_REGS"),
            "local_bytes": _of_kernel(kernel, "LOCAL_SIZE_BYTES"),
            "shared_bytes": _of_kernel(kernel, "SHARED_SIZE_BYTES"),
            "largest_group": self.largest_group(kernel),
            "group_multiple": warp,
            "occupancy": blocks * -(-threads // warp) * warp / most,
        }

    def methods(self, job):
        """What the device adds to `used.methods`."""
        return {"gpu_wait": job.gpu_wait, "max_registers": job.max_registers, "compile_cache": "off"}

    def versions(self):
        from cuda.bindings import __version__

        return {"cuda_bindings": __version__, "nvrtc": compiler.version()}


class Arguments:
    """Values of a kernel's arguments, and the addresses of them that the driver reads. kept: lives as long."""

    def __init__(self, values, kept):
        self.values, self.kept = [np.ascontiguousarray(value) for value in values], kept
        self.addresses = np.array([value.ctypes.data for value in self.values], np.uint64)


class Event:
    def __init__(self):
        self.handle = call(driver.cuEventCreate, 0)
        weakref.finalize(self, driver.cuEventDestroy, self.handle)

    def record(self, stream):
        call(driver.cuEventRecord, self.handle, stream)


def _of_kernel(kernel, name):
    return call(driver.cuFuncGetAttribute, getattr(driver.CUfunction_attribute, "CU_FUNC_ATTRIBUTE_" + name), kernel)
