"""Samples one GPU through NVML: its identity, a row of SERIES at every tick, and why a column is empty.

gpu_percent      share of a sample period in which a kernel ran, not how busy the device was. The device makes a new
                 value every 1/6 s to 1 s: the first tick that sees it has it, the others are empty
gpu_memory_bytes, gpu_process_memory_bytes      used on the device by all processes, and by the watched ones
gpu_power_w, gpu_energy_j      of the device; the energy counts from loading the driver, in steps of about 0.1 s
gpu_clock_mhz, gpu_memory_clock_mhz, gpu_temperature_c
gpu_throttle     reasons why clocks are held back, separated by semicolons, or "none"
"""

import os

from harness.system import nvml

SERIES = (
    *("gpu_percent", "gpu_memory_bytes", "gpu_process_memory_bytes", "gpu_power_w", "gpu_energy_j"),
    *("gpu_clock_mhz", "gpu_memory_clock_mhz", "gpu_temperature_c", "gpu_throttle"),
)
OF_THE_WHOLE = "gpu_percent", "gpu_power_w", "gpu_energy_j"
OF_A_PART = "gpu_memory_bytes", "gpu_process_memory_bytes"
OF_ALL_PARTS = "MIG is on: NVML reports this for the whole GPU alone, not for the part in use"
UNNAMED_PART = "MIG is on: name the part in CUDA_VISIBLE_DEVICES"
NO_PERMISSION = 4


class Gpu:
    """NVML's view of the GPU that a CUDA program gets here. unavailable: None, or why there is no view.

    without: "", or why NVML is not to be asked.
    """

    def __init__(self, without: str = ""):
        self.unavailable = without or None
        if without:
            return
        try:
            import pynvml
        except ImportError:
            self.unavailable = "nvidia-ml-py is not installed (pip install 'rayrace[gpu]')"
            return
        self.nvml = pynvml
        # the second, not an NVMLError, is raised if the driver is older than nvidia-ml-py
        self.errors = (pynvml.NVMLError, getattr(pynvml, "NVMLLibraryMismatchError", pynvml.NVMLError))
        try:
            pynvml.nvmlInit()
        except pynvml.NVMLError as error:
            what = "no permission to use NVML" if error.value == NO_PERMISSION else "no NVIDIA driver"
            self.unavailable = f"{what}: {error}"
            return
        try:
            self.part, self.device, self.mig = self._find()
        except (nvml.Untold, *self.errors) as error:
            self.unavailable = f"no NVIDIA device: {error}"
            return
        self.columns = nvml.columns()
        if self.mig:
            self.columns |= {name: nvml.Column(refused=OF_ALL_PARTS) for name in OF_THE_WHOLE}
            if self.part is self.device:
                self.columns |= {name: nvml.Column(refused=UNNAMED_PART) for name in OF_A_PART}

    def _find(self):
        """Handles of the MIG part and of its GPU, equal if there is no part; and whether MIG is on.

        The device is the first in CUDA_VISIBLE_DEVICES (a number, the start of a UUID, or a part), else number 0.
        Renderers run with CUDA_DEVICE_ORDER = PCI_BUS_ID (process.py), so CUDA and NVML number devices alike.
        """
        ask = self.nvml
        named = os.environ.get("CUDA_VISIBLE_DEVICES")
        first = "0" if named is None else named.split(",")[0].strip()
        if first.startswith("MIG-"):
            part = ask.nvmlDeviceGetHandleByUUID(first)
            return part, ask.nvmlDeviceGetDeviceHandleFromMigDeviceHandle(part), True
        if first.startswith("GPU-"):
            every = map(ask.nvmlDeviceGetHandleByIndex, range(ask.nvmlDeviceGetCount()))
            device = next((handle for handle in every if ask.nvmlDeviceGetUUID(handle).startswith(first)), None)
        else:
            device = ask.nvmlDeviceGetHandleByIndex(int(first)) if first.isdecimal() else None
        if device is None:
            raise nvml.Untold(f'CUDA_VISIBLE_DEVICES is "{named}"')
        try:
            mig = ask.nvmlDeviceGetMigMode(device)[0] == 1
        except ask.NVMLError:  # it cannot be split
            mig = False
        return device, device, mig

    def identity(self) -> dict | None:
        """Name, driver, memory, limits and modes, each a value or "unavailable: reason"; None without a GPU."""
        if self.unavailable:
            return None
        facts = {}
        for name, way in nvml.IDENTITY.items():
            column = nvml.Column(way)
            value = column.read(self)
            facts[name] = f"unavailable: {column.state}" if value is None else value
        try:
            driver = self.nvml.nvmlSystemGetDriverVersion()
        except self.errors as error:
            driver = f"unavailable: {error}"
        return {**facts, "driver": driver, "mig": "on" if self.mig else "off"}

    def sample(self, pids: frozenset[int], now: float) -> tuple:
        """The values of SERIES now, None for each that is unavailable. pids: of the watched processes; now: s."""
        if self.unavailable:
            return (None,) * len(SERIES)
        self.pids, self.now = pids, now
        return tuple(self.columns[name].read(self) for name in SERIES)

    def states(self) -> dict[str, str]:
        """For each column "available", or why it is empty. Call it after the last sample."""
        if self.unavailable:
            return dict.fromkeys(SERIES, self.unavailable)
        return {name: self.columns[name].state for name in SERIES}

    def sources(self) -> dict[str, dict]:
        """For each column with values {call, window_s}: the NVML call, and the seconds that its value covers."""
        sources = {} if self.unavailable else {name: self.columns[name].source for name in SERIES}
        return {name: source for name, source in sources.items() if source}
