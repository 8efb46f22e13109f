"""One kernel source in C for every GPU: through OpenCL, or through CUDA's NVRTC."""
