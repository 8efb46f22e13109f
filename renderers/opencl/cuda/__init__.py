"""The kernel as CUDA C++: compiled by NVRTC, launched by CUDA's driver."""
