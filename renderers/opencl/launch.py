"""A kernel with its arguments, and the grid of groups in which it is launched."""

from renderers import worker

MOST_DOWN = 65535  # groups of a grid that CUDA has one below the other


class Launch:
    """shape: (h, w) of what the kernel makes. memory: bytes of a thread. shared: bytes of each local array it takes.

    session: of OpenCL or of CUDA.
    """

    def __init__(self, session, job, kernel, shape, memory, shared):
        self.session, self.kernel, self.shared = session, kernel, shared
        self.group = job.block_width, job.block_height
        self.threads = job.block_width * job.block_height
        across, down = (max(1, -(-side // step)) for side, step in zip(shape[::-1], self.group, strict=True))
        groups = -(-job.total_threads // self.threads) if job.total_threads else across * down
        groups = max(1, min(groups, session.threads_at_once(self.threads, memory) // self.threads))
        across = min(across, groups)
        self.grid = across, min(down, groups // across, MOST_DOWN)
        self.groups = self.grid[0] * self.grid[1]
        self.memory = session.room(self.groups * self.threads * memory)
        most = session.largest_group(kernel)
        if self.threads > most:
            worker.refuse(f"block {self.group[0]}x{self.group[1]}: a group of this kernel has at most {most} threads")

    def take(self, *arguments):
        """Sets the arguments: buffers, and arrays that are passed by value, a structure for example."""
        self.arguments = self.session.take(self.kernel, arguments, self.shared)

    def start(self, grid=None):
        """Enqueues it; returns its event."""
        return self.session.start(self.kernel, self.arguments, grid or self.grid, self.group)

    def resources(self):
        """What of a device the kernel takes, for `used.methods`."""
        return {
            "block": f"{self.group[0]}x{self.group[1]}",
            "blocks": self.groups,
            "total_threads": self.groups * self.threads,
            **self.session.resources(self.kernel, self.threads),
        }
