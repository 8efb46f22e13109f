"""A scene of an experiment without one thing."""

from harness.reduction.leave_out import LeaveOut, apply
from harness.renderer.parameters import Parameters
from harness.scene.source import Source


class Reduced(Source):
    """The scene of `whole` with `leave_out` made, and jobs of it."""

    def __init__(self, whole: Source, leave_out: LeaveOut):
        # A change takes the same from a scene whatever the job is.
        super().__init__(whole.name, lambda: apply([leave_out], whole.scene, Parameters())[0], size=whole.size)
        self.leave_out = leave_out

    def parameters(self, image, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        return self.leave_out.change(self.scene, super().parameters(image, threads, frames, least_frame))[1]
