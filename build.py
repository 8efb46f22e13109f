"""Packs plotly.js into the wheel: a report needs this one file of plotly, whose Python package takes 70 MB."""

from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from plotly.offline import get_plotlyjs


class Packed(BuildHookInterface):
    def initialize(self, version: str, build_data: dict) -> None:
        """Writes the script beside the page that embeds it, for a wheel and for an editable install."""
        target = Path(self.root, "reports", "page", "plotly.min.js")
        target.write_text(get_plotlyjs(), encoding="utf-8")
