"""A device with its queue and the programs that were built for it, and the kernels of a job as they are launched."""

import warnings

import numpy as np
import pyopencl as cl

from renderers import worker

from .device import is_processor, name_of

IN_FLIGHT = 2048  # threads that a compute unit of a GPU holds at once, at most: these alone need memory of their own
OF_PROCESSOR = 64, 2**28  # groups of a processor that have it, whatever its cores, and bytes that they should not pass
UPLOADED, MADE = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, cl.mem_flags.READ_WRITE
OPTIONS = {"contract": ("-cl-mad-enable",), "fast": ("-cl-fast-relaxed-math",)}
COUNTS = 5  # numbers that a kernel of a picture counts, for each group


class Session:
    """A device of this process."""

    def __init__(self, device):
        self.device = device
        self.context = cl.Context([device])
        self.queue = cl.CommandQueue(self.context, properties=cl.command_queue_properties.PROFILING_ENABLE)
        self.programs = {}  # by source and options

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
                worker.refuse(f"the compiler of {name_of(self.device)} failed: {first_error(str(error))}")
        return self.programs[key]

    def upload(self, array):
        return cl.Buffer(self.context, UPLOADED, hostbuf=array)

    def room(self, size):
        """A buffer of so many bytes, all 0; of a few more if there are none, which no device has."""
        buffer = cl.Buffer(self.context, MADE, max(16, int(size)))
        cl.enqueue_fill_buffer(self.queue, buffer, np.uint8(0), 0, buffer.size)
        return buffer

    def download(self, buffer, shape, dtype):
        array = np.zeros(shape, dtype)
        if array.size:
            cl.enqueue_copy(self.queue, array, buffer)
        return array


def first_error(log):
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    return next((line for line in lines if "error:" in line), lines[0] if lines else "it gave no reason")


class Launch:
    """A kernel with its arguments, in a grid of groups.

    shape: (h, w) of what it makes. memory: bytes of a thread. shared: bytes of local memory for each of its arguments.
    A kernel does not keep the buffers that it is given, so this does.
    """

    def __init__(self, session, job, kernel, shape, memory, shared):
        self.session, self.kernel, self.shared = session, kernel, shared
        self.group = job.block_width, job.block_height
        self.threads = job.block_width * job.block_height
        across, down = (max(1, -(-side // step)) for side, step in zip(shape[::-1], self.group, strict=True))
        groups = -(-job.total_threads // self.threads) if job.total_threads else across * down
        groups = max(1, min(groups, threads_at_once(session.device, self.threads, memory) // self.threads))
        across = min(across, groups)
        self.grid = across, min(down, groups // across)
        self.groups = self.grid[0] * self.grid[1]
        self.memory = session.room(self.groups * self.threads * memory)

    def take(self, *arguments):
        """Sets the arguments: arrays are passed as they are, a structure for example."""
        self.arguments = arguments
        local = [cl.LocalMemory(size) for size in self.shared]
        for index, argument in enumerate((*arguments, *local)):
            self.kernel.set_arg(index, argument.tobytes() if isinstance(argument, np.ndarray) else argument)

    def start(self, grid=None):
        """Enqueues it; returns its event."""
        size = [groups * side for groups, side in zip(grid or self.grid, self.group, strict=True)]
        return cl.enqueue_nd_range_kernel(self.session.queue, self.kernel, size, self.group)

    def info(self, name):
        return self.kernel.get_work_group_info(getattr(cl.kernel_work_group_info, name), self.session.device)

    def check_group(self):
        most = self.info("WORK_GROUP_SIZE")
        if self.threads > most:
            worker.refuse(f"block {self.group[0]}x{self.group[1]}: a group of this kernel has at most {most} threads")

    def resources(self):
        """What of a device the kernel takes, for `used.methods`."""
        return {
            "block": f"{self.group[0]}x{self.group[1]}",
            "blocks": self.groups,
            "total_threads": self.groups * self.threads,
            "local_bytes": self.info("PRIVATE_MEM_SIZE"),
            "shared_bytes": self.info("LOCAL_MEM_SIZE"),
            "largest_group": self.info("WORK_GROUP_SIZE"),
            "group_multiple": self.info("PREFERRED_WORK_GROUP_SIZE_MULTIPLE"),
            **dict.fromkeys(("registers", "occupancy")),
        }


def threads_at_once(device, threads, memory):
    """How many threads may be in work, so that each has its memory. threads: of a group. memory: bytes of a thread."""
    if memory == 0:
        return 2**31
    fit = device.max_mem_alloc_size // memory
    if fit < threads:
        worker.refuse(
            f"the {threads} threads of a group need {threads * memory} bytes of memory, more than the"
            f" {device.max_mem_alloc_size} of a buffer of {name_of(device)}: take smaller blocks"
        )
    if is_processor(device):
        groups, size = OF_PROCESSOR
        return min(fit, max(threads, min(groups * threads, size // memory)))
    return min(fit, max(threads, device.max_compute_units * IN_FLIGHT))
