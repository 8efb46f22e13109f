"""A device of OpenCL with its queue and the programs that were built for it."""

import warnings

import numpy as np
import pyopencl as cl

from renderers import worker

from . import device as devices

IN_FLIGHT = 2048  # threads that a compute unit of a GPU holds at once, at most: these alone need memory of their own
OF_PROCESSOR = 64, 2**28  # groups of a processor that have it, whatever its cores, and bytes that they should not pass
UPLOADED, MADE = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, cl.mem_flags.READ_WRITE
OPTIONS = {"contract": ("-cl-mad-enable",), "fast": ("-cl-fast-relaxed-math",)}


class Session:
    """A device of this process. wanted: as devices.find has it."""

    SIZED = ("shared",)  # memories whose kernels have the sizes of the scene in them

    def __init__(self, wanted):
        self.device = devices.find(wanted)
        self.context = cl.Context([self.device])
        self.queue = cl.CommandQueue(self.context, properties=cl.command_queue_properties.PROFILING_ENABLE)
        self.programs = {}  # by source and options

    def check(self, job):
        devices.check(self.device, job)

    def describe(self):
        return devices.describe(self.device)

    def room_of_memories(self):
        """Bytes that the scene may have in each memory that is small."""
        return {"constant": self.device.max_constant_buffer_size, "shared": self.device.local_mem_size}

    def program(self, source, job):
        options = list(OPTIONS.get(job.floating_point, ()))
        rounds = self.device.single_fp_config & cl.device_fp_config.CORRECTLY_ROUNDED_DIVIDE_SQRT
        if job.precision == "float32" and rounds:
            options.append("-cl-fp32-correctly-rounded-divide-sqrt")
        key = source, *options
        if key not in self.programs:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", cl.CompilerWarning)
                    self.programs[key] = cl.Program(self.context, source).build(options=options)
            except cl.RuntimeError as error:
                worker.refuse(f"the compiler of {devices.name_of(self.device)} failed: {first_error(str(error))}")
        return self.programs[key]

    def kernel(self, program, name):
        return getattr(program, name)

    def place(self, program, memory, given):
        """The arguments of the scene. given: the buffers that hold it."""
        return given

    def upload(self, array):
        return cl.Buffer(self.context, UPLOADED, hostbuf=array)

    def room(self, size):
        """A buffer of so many bytes, all 0; of a few more if there are none, which no device has."""
        buffer = cl.Buffer(self.context, MADE, max(16, int(size)))
        cl.enqueue_fill_buffer(self.queue, buffer, np.uint8(0), 0, buffer.size)
        return buffer

    def host(self, shape, dtype):
        """An array for what is downloaded again and again."""
        return np.zeros(shape, dtype)

    def download(self, buffer, array):
        """Fills the array and returns it."""
        if array.size:
            cl.enqueue_copy(self.queue, array, buffer)
        return array

    def threads_at_once(self, threads, memory):
        """How many threads may be in work, so that each has its memory. threads: of a group. memory: bytes of one."""
        if memory == 0:
            return 2**31
        fit = self.device.max_mem_alloc_size // memory
        if fit < threads:
            worker.refuse(
                f"the {threads} threads of a group need {threads * memory} bytes of memory, more than the"
                f" {self.device.max_mem_alloc_size} of a buffer of {devices.name_of(self.device)}: take smaller blocks"
            )
        if devices.is_processor(self.device):
            groups, size = OF_PROCESSOR
            return min(fit, max(threads, min(groups * threads, size // memory)))
        return min(fit, max(threads, self.device.max_compute_units * IN_FLIGHT))

    def take(self, kernel, arguments, shared):
        """Returns what must live as long as the kernel may be started, which does not keep its buffers."""
        local = [cl.LocalMemory(size) for size in shared]
        for index, argument in enumerate((*arguments, *local)):
            kernel.set_arg(index, argument.tobytes() if isinstance(argument, np.ndarray | np.generic) else argument)
        return arguments

    def start(self, kernel, arguments, grid, group):
        size = [groups * side for groups, side in zip(grid, group, strict=True)]
        return cl.enqueue_nd_range_kernel(self.queue, kernel, size, group)

    def seconds(self, events):
        """Waits for the events of kernels and returns how long these ran by the device's clock."""
        cl.wait_for_events(events)
        return sum(event.profile.end - event.profile.start for event in events) / 1e9

    def largest_group(self, kernel):
        return self._info(kernel, "WORK_GROUP_SIZE")

    def resources(self, kernel, threads):
        return {
            "local_bytes": self._info(kernel, "PRIVATE_MEM_SIZE"),
            "shared_bytes": self._info(kernel, "LOCAL_MEM_SIZE"),
            "largest_group": self._info(kernel, "WORK_GROUP_SIZE"),
            "group_multiple": self._info(kernel, "PREFERRED_WORK_GROUP_SIZE_MULTIPLE"),
            **dict.fromkeys(("registers", "occupancy")),
        }

    def methods(self, job):
        """What the device adds to `used.methods`."""
        return {"threads": job.threads} if devices.is_processor(self.device) else {}

    def versions(self):
        return {"pyopencl": cl.VERSION_TEXT, "opencl": self.device.version.strip()}

    def _info(self, kernel, name):
        return kernel.get_work_group_info(getattr(cl.kernel_work_group_info, name), self.device)


def first_error(log):
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    return next((line for line in lines if "error:" in line), lines[0] if lines else "it gave no reason")
