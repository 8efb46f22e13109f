"""Finds the OpenCL device of a job and describes it."""

import pyopencl as cl

from renderers import worker

INSTALL = "install a driver of your GPU with OpenCL, or PoCL for the processor (Debian: apt install pocl-opencl-icd)"
KINDS = (cl.device_type.GPU, cl.device_type.ACCELERATOR, cl.device_type.CPU)  # the order of preference


def find(wanted):
    """Returns the device. wanted: its number, a part of its name or of its platform's, or "" for the best kind."""
    try:
        every = [device for platform in cl.get_platforms() for device in platform.get_devices()]
    except cl.Error as error:
        worker.refuse(f"no OpenCL platform ({error}): {INSTALL}")
    if not every:
        worker.refuse(f"no OpenCL device: {INSTALL}")
    listed = ", ".join(f"{number} {name_of(device)}" for number, device in enumerate(every))
    if wanted.isdecimal():
        if int(wanted) >= len(every):
            worker.refuse(f"no OpenCL device {wanted}; there are: {listed}")
        return every[int(wanted)]
    named = [device for device in every if wanted.lower() in f"{name_of(device)} {device.platform.name}".lower()]
    if not named:
        worker.refuse(f'no OpenCL device "{wanted}"; there are: {listed}')
    return min(named, key=lambda device: next(i for i, kind in enumerate((*KINDS, device.type)) if device.type & kind))


def name_of(device):
    return device.name.strip()


def is_processor(device):
    return bool(device.type & cl.device_type.CPU)


def check(device, job):
    """Refuses a job that the device cannot do."""
    if job.precision == "float64" and not device.double_fp_config:
        worker.refuse(f"{name_of(device)} has no float64")
    threads, most = job.block_width * job.block_height, device.max_work_group_size
    width, height = device.max_work_item_sizes[:2]
    if threads > most or job.block_width > width or job.block_height > height:
        worker.refuse(
            f"block {job.block_width}x{job.block_height}: a work-group of {name_of(device)} has at most"
            f" {most} work-items, {width} across and {height} down"
        )


def describe(device):
    """The event `device` of the contract."""
    return {
        "name": name_of(device),
        "simulated": False,
        "multiprocessors": device.max_compute_units,
        "clock_mhz": device.max_clock_frequency or None,
        "memory_bytes": device.global_mem_size,
        "shared_bytes_per_block": device.local_mem_size,
        "driver": f"{device.platform.name} {device.driver_version}",
        **({"type": "cpu"} if is_processor(device) else {}),
    }
