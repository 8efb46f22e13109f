"""The kernel on a GPU: the CUDA parts, around the source that it shares with the processor."""
