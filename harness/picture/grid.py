"""Cuts a picture into tiles."""

from dataclasses import dataclass

from harness.errors import UserError

MOST = 10**6  # tiles

Region = tuple[int, int, int, int]  # x0, y0, x1, y1 in pixels of the picture, half open


@dataclass(frozen=True)
class Grid:
    """Tiles of side x side pixels over `bounds`, row by row from the top left; smaller at the right and bottom.

    UserError if there are too many.
    """

    bounds: Region
    side: int

    def __post_init__(self):
        if self.count > MOST:
            raise UserError(f"--tiles {self.side}: that makes {self.count:,} tiles; expected {MOST:,} at most")

    @property
    def width(self) -> int:
        return self.bounds[2] - self.bounds[0]

    @property
    def height(self) -> int:
        return self.bounds[3] - self.bounds[1]

    @property
    def columns(self) -> int:
        return -(-self.width // self.side)

    @property
    def count(self) -> int:
        return self.columns * -(-self.height // self.side)

    def region(self, number: int) -> Region:
        """The region of a tile."""
        row, column = divmod(number, self.columns)
        x0, y0, x1, y1 = self.bounds
        x, y = x0 + column * self.side, y0 + row * self.side
        return x, y, min(x + self.side, x1), min(y + self.side, y1)

    def shape(self, number: int) -> tuple[int, int, int]:
        """The shape of a tile's array: (height, width, 3)."""
        x0, y0, x1, y1 = self.region(number)
        return y1 - y0, x1 - x0, 3
