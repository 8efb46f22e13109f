"""What NVML says about the first GPU: identity once, counters at every tick. Without NVML: the reason."""

SERIES = ("gpu_percent", "gpu_memory_bytes", "gpu_power_w", "gpu_clock_mhz")


class Gpu:
    """NVML's view of GPU 0. `unavailable` is None, or why there is nothing to see."""

    def __init__(self):
        self.unavailable = None
        self._handle = None
        try:
            import pynvml
        except ImportError:
            self.unavailable = "nvidia-ml-py is not installed (pip install nvidia-ml-py)"
            return
        self._nvml = pynvml
        try:
            pynvml.nvmlInit()
            self._handle = pynvml.nvmlDeviceGetHandleByIndex(0)
        except pynvml.NVMLError as error:
            self.unavailable = f"no NVIDIA driver or device: {error}"

    def identity(self):
        """Name, driver, memory of the device, or None."""
        if self._handle is None:
            return None
        nvml = self._nvml
        return {
            "name": self._ask(nvml.nvmlDeviceGetName),
            "driver": nvml.nvmlSystemGetDriverVersion(),
            "uuid": self._ask(nvml.nvmlDeviceGetUUID),
            "memory_bytes": self._ask(nvml.nvmlDeviceGetMemoryInfo, "total"),
        }

    def sample(self):
        """The values of SERIES now; None for each that the device does not tell."""
        if self._handle is None:
            return (None,) * len(SERIES)
        nvml = self._nvml
        power = self._ask(nvml.nvmlDeviceGetPowerUsage)
        return (
            self._ask(nvml.nvmlDeviceGetUtilizationRates, "gpu"),
            self._ask(nvml.nvmlDeviceGetMemoryInfo, "used"),
            None if power is None else power / 1000,
            self._ask(lambda handle: nvml.nvmlDeviceGetClockInfo(handle, nvml.NVML_CLOCK_SM)),
        )

    def _ask(self, question, attribute=None):
        try:
            answer = question(self._handle)
        except self._nvml.NVMLError:
            return None
        return answer if attribute is None else getattr(answer, attribute)
