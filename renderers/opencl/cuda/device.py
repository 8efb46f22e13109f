"""Finds the GPU of a job and describes it."""

from cuda.bindings import driver

from renderers import worker

from .calls import call


def find(wanted):
    """Returns the device. wanted: its number, a part of its name, or "" for the first."""
    try:
        call(driver.cuInit, 0)
        every = [call(driver.cuDeviceGet, number) for number in range(call(driver.cuDeviceGetCount))]
    except RuntimeError as error:
        worker.refuse(f"no CUDA device: {error}")
    if not every:
        worker.refuse("no CUDA device")
    listed = ", ".join(f"{number} {name_of(device)}" for number, device in enumerate(every))
    if wanted.isdecimal():
        if int(wanted) >= len(every):
            worker.refuse(f"no CUDA device {wanted}; there are: {listed}")
        return every[int(wanted)]
    named = [device for device in every if wanted.lower() in name_of(device).lower()]
    if not named:
        worker.refuse(f'no CUDA device "{wanted}"; there are: {listed}')
    return named[0]


def name_of(device):
    return call(driver.cuDeviceGetName, 256, device).partition(b"\0")[0].decode()


def attribute(device, name):
    return call(driver.cuDeviceGetAttribute, getattr(driver.CUdevice_attribute, "CU_DEVICE_ATTRIBUTE_" + name), device)


def capability(device):
    return [attribute(device, f"COMPUTE_CAPABILITY_{part}") for part in ("MAJOR", "MINOR")]


def check(device, job):
    """Refuses a block that the device does not have."""
    width, height, most = (attribute(device, f"MAX_{of}") for of in ("BLOCK_DIM_X", "BLOCK_DIM_Y", "THREADS_PER_BLOCK"))
    if job.block_width * job.block_height > most or job.block_width > width or job.block_height > height:
        worker.refuse(
            f"block {job.block_width}x{job.block_height}: a block of {name_of(device)} has at most"
            f" {most} threads, {width} across and {height} down"
        )


def describe(device):
    """The event `device` of the contract."""
    version = call(driver.cuDriverGetVersion)
    return {
        "name": name_of(device),
        "simulated": False,
        "compute_capability": capability(device),
        "multiprocessors": attribute(device, "MULTIPROCESSOR_COUNT"),
        "clock_mhz": attribute(device, "CLOCK_RATE") / 1e3,
        "memory_bytes": call(driver.cuDeviceTotalMem, device),
        "shared_bytes_per_block": attribute(device, "MAX_SHARED_MEMORY_PER_BLOCK"),
        "registers_per_multiprocessor": attribute(device, "MAX_REGISTERS_PER_MULTIPROCESSOR"),
        "driver": f"{version // 1000}.{version % 1000 // 10}",
    }
