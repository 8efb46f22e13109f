"""A value that a run does not have."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Missing:
    """A missing value and the reason. Its text starts with "unavailable"."""

    reason: str

    def __str__(self):
        return self.reason if self.reason.startswith("unavailable") else f"unavailable: {self.reason}"
