"""What the sections have in common that divide a window of states into cells."""

from typing import TYPE_CHECKING

from pydantic import Field

from nsmaps.reduced.conditions.region import Box
from nsmaps.study.ahead import call_boxes
from nsmaps.study.estimates import Size, cover_size
from nsmaps.study.reading.values import Bounds, CellsPerAxis, Depth
from nsmaps.study.sections.base import Analysis

if TYPE_CHECKING:
    from nsmaps.study.ahead import Call
    from nsmaps.study.sections.base import Binding, Study, System


class WindowSection(Analysis):
    """An analysis of a window by cells whose images under the exact map are enclosed."""

    box: Bounds = Field(description="the window")
    depth: Depth = 3
    n_cells: CellsPerAxis = 32

    def bind(self, binding: "Binding") -> Box:
        from nsmaps.enclosures.box_images import box_map

        box_map(binding.system)
        return binding.box((self.key, "box"), self.box)

    def calls(self) -> "tuple[Call, ...]":
        return (call_boxes,)

    def describe(self, study: "Study") -> str:
        return f"{self.n_cells} cells an axis, halved {self.depth} times"

    def size(self, study: "Study", system: "System") -> Size:
        return cover_size(self.n_cells, len(system.coordinates), self.depth)
