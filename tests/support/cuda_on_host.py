"""CUDA's driver and compiler, on the processor: what is compiled is the CUDA C++ that NVRTC would get, what is launched
reads its arguments where the driver would. Slow, and only to see that host and kernel fit together.
"""

import ctypes
import re
import subprocess
from pathlib import Path
from types import SimpleNamespace

HEADER = Path(__file__).with_suffix(".h")
TRAMPOLINE = 'extern "C" void launch_{0}(const unsigned *shape, void **addresses) {{ launch({0}, shape, addresses); }}'
END = """
#if KIND_IMAGE
{render_pixels}
#if NEED_ADAPTIVE
{render_corners}
#endif
#else
{trace_rays}
#endif
{sizes}
#ifdef MEMORY_CONSTANT
extern "C" {{ std::size_t size_of_constant_numbers = sizeof constant_numbers; }}
extern "C" {{ std::size_t size_of_constant_integers = sizeof constant_integers; }}
#endif
"""
KERNELS = "render_pixels", "render_corners", "trace_rays", "sizes"
DEVICE = {
    **{"COMPUTE_CAPABILITY_MAJOR": 9, "COMPUTE_CAPABILITY_MINOR": 0, "MULTIPROCESSOR_COUNT": 2, "CLOCK_RATE": 1000000},
    **{"MAX_BLOCK_DIM_X": 1024, "MAX_BLOCK_DIM_Y": 1024, "MAX_THREADS_PER_BLOCK": 1024, "WARP_SIZE": 32},
    **{"TOTAL_CONSTANT_MEMORY": 65536, "MAX_SHARED_MEMORY_PER_BLOCK": 49152, "MAX_THREADS_PER_MULTIPROCESSOR": 64},
    "MAX_REGISTERS_PER_MULTIPROCESSOR": 65536,
}


def compile_source(folder, compiler):
    """A stand-in for compiler.compile_source that makes a library of the source, in `folder`."""

    def compile(source, target, floating_point):
        assert target == "sm_90" and floating_point == "strict"
        kernels = {name: TRAMPOLINE.format(name) for name in KERNELS}
        made = folder / f"kernel-{len(list(folder.iterdir()))}"
        text = f'#include "{HEADER}"\n{source}\n#line 1 "end"\n{END.format(**kernels)}'
        made.with_suffix(".cpp").write_text(text)
        command = [compiler, "-std=c++20", "-O0", "-ffp-contract=off", "-w", "-shared", "-fPIC", "-pthread"]
        command += [str(made.with_suffix(".cpp")), "-o", str(made.with_suffix(".so"))]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr[:3000]
        return SimpleNamespace(program=str(made.with_suffix(".so")))

    return compile


class Driver:
    """Stands for cuda.bindings.driver, the module `real`, against which names and numbers of arguments are checked."""

    def __init__(self, real, device=DEVICE):
        self.real, self.device, self.memory, self.pinned = real, device, {}, set()
        self.flags = 0  # of the context
        self.CUdevice_attribute, self.CUfunction_attribute = real.CUdevice_attribute, real.CUfunction_attribute

    def __getattr__(self, name):
        """The call `name`: status 0, and what the method below of that name, without `cu`, returns."""
        taken = getattr(self.real, name).__doc__.partition("\n")[0]
        taken = re.fullmatch(r"\w+\((.*)\)", taken)[1]
        count = len(taken.split(",")) if taken else 0

        def call(*arguments):
            assert len(arguments) == count, f"{name}({taken}) got {len(arguments)} arguments"
            found = getattr(Calls, name[2:], lambda *_: ())(self, *arguments)
            return 0, *(found if isinstance(found, tuple) else (found,))

        call.__name__ = name
        return call


class Calls:
    """What the calls do that do more than to return a status."""

    def DeviceGetCount(self):
        return 1

    def DeviceGet(self, number):
        return number

    def DeviceGetName(self, length, device):
        return b"Host\0\0"

    def DeviceGetAttribute(self, attribute, device):
        return self.device[attribute.name.removeprefix("CU_DEVICE_ATTRIBUTE_")]

    def DeviceTotalMem(self, device):
        return 2**30

    def DriverGetVersion(self):
        return 13000

    def DevicePrimaryCtxRetain(self, device):
        return self.real.CUcontext(1)

    def DevicePrimaryCtxSetFlags(self, device, flags):
        self.flags = flags
        return ()

    def StreamCreate(self, flags):
        return self.real.CUstream(2)

    def EventCreate(self, flags):
        return self.real.CUevent(3)

    def EventElapsedTime(self, begin, end):
        return 1.5

    def MemGetInfo(self):
        return 2**30, 2**30

    def MemAlloc(self, size):
        block = ctypes.create_string_buffer(b"\xee" * size, size)
        self.memory[ctypes.addressof(block)] = block
        return self.real.CUdeviceptr(ctypes.addressof(block))

    def MemFree(self, pointer):
        del self.memory[int(pointer)]
        return ()

    def MemHostRegister(self, address, size, flags):
        assert address not in self.pinned
        self.pinned.add(address)
        return ()

    def MemHostUnregister(self, address):
        self.pinned.remove(address)
        return ()

    def MemsetD8Async(self, pointer, value, size, stream):
        assert size <= len(self.memory[int(pointer)])
        ctypes.memset(int(pointer), value, size)
        return ()

    def MemcpyHtoD(self, to, source, size):
        assert size <= len(self.memory[int(to)])
        ctypes.memmove(int(to), source, size)
        return ()

    def MemcpyDtoH(self, to, source, size):
        assert size <= len(self.memory[int(source)])
        ctypes.memmove(to, int(source), size)
        return ()

    def MemcpyDtoD(self, to, source, size):
        assert size <= len(self.memory[int(source)])
        ctypes.memmove(int(to), int(source), size)
        return ()

    def ModuleLoadData(self, program):
        return ctypes.CDLL(program)

    def ModuleGetFunction(self, module, name):
        return getattr(module, f"launch_{name.decode()}")

    def ModuleGetGlobal(self, module, name):
        size = ctypes.c_size_t.in_dll(module, f"size_of_{name.decode()}").value
        place = ctypes.addressof(ctypes.c_char.in_dll(module, name.decode()))
        return self.real.CUdeviceptr(place), size

    def FuncGetAttribute(self, attribute, function):
        return 1024 if attribute.name.endswith("MAX_THREADS_PER_BLOCK") else 40

    def OccupancyMaxActiveBlocksPerMultiprocessor(self, function, threads, shared):
        return 1

    def LaunchKernel(self, function, across, down, deep, width, height, depth, shared, stream, addresses, extra):
        assert (deep, depth, shared, extra) == (1, 1, 0, 0)
        function((ctypes.c_uint * 4)(across, down, width, height), ctypes.c_void_p(addresses))
        return ()
