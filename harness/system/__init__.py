"""What the operating system and the drivers report: control groups, counters, NVML, CUDA."""
