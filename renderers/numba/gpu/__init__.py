"""The kernel on a GPU: what CUDA adds to the source that it shares with the processor."""
