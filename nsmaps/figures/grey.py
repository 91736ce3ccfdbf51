"""What pictures become in print without colour, and which entries of a legend then look alike."""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from nsmaps.figures.style import luminance

CLOSE = 10.0  #: difference in lightness L* of CIELAB, from 0, black, to 100, white


class AlikeInGrey(NamedTuple):
    """Two entries of a legend that differ little in lightness."""

    one: str
    other: str
    difference: float  #: in lightness L*


def alike_in_grey(shown: Figure | Mapping[str, Any], least: float = CLOSE) -> list[AlikeInGrey]:
    """The pairs of a figure's legends, or of colours by name, that differ by less than `least` in lightness, the closest first.

    Lines of a figure with different dashes or markers differ by these and form none.

    >>> [(pair.one, pair.other) for pair in alike_in_grey({"red": "#ff0000", "grey": "0.5", "white": "w"})]
    [('red', 'grey')]
    """
    looks = dict(_looks(shown)) if isinstance(shown, Figure) else {name: (colour, None) for name, colour in shown.items()}
    light = {name: lightness(colour) for name, (colour, _) in looks.items()}
    pairs = [AlikeInGrey(a, b, abs(light[a] - light[b])) for a, b in combinations(looks, 2) if looks[a][1] == looks[b][1]]
    return sorted((pair for pair in pairs if pair.difference < least), key=lambda pair: pair.difference)


def lightness(colour: Any) -> float:
    """L* of CIELAB of a colour on white paper, from 0 to 100 (IEC 61966-2-1, CIE 15).

    >>> round(lightness("w")), round(lightness("k")), round(lightness("0.5"), 1)
    (100, 0, 53.4)
    """
    *parts, opacity = to_rgba(colour)
    light = float(luminance(opacity * np.array(parts) + 1 - opacity))
    return float(116 * np.cbrt(light) - 16) if light > (6 / 29) ** 3 else light * (29 / 3) ** 3


def in_grey(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Opaque pixels, shape (height, width, 4), as greys of the same luminance."""
    colours, place = np.unique(pixels.view(np.uint32), return_inverse=True)
    light = luminance(colours.view(np.uint8).reshape(-1, 4)[:, :3] / 255)
    grey = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    shades = np.repeat(np.round(255 * grey).astype(np.uint8)[:, None], 4, axis=1)
    shades[:, 3] = 255
    return shades[place.ravel()].reshape(pixels.shape)


def _looks(figure: Figure) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """The colour of each entry of the legends, and what distinguishes it besides colour: kind, dashes and marker."""
    for legend in (*figure.legends, *(found for ax in figure.axes if (found := ax.get_legend()) is not None)):
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
            if isinstance(handle, Line2D):
                dashed = handle.get_linestyle() not in ("None", "none", "")
                yield (
                    text.get_text(),
                    (
                        handle.get_color() if dashed else handle.get_markerfacecolor(),
                        (handle.get_linestyle(), handle.get_marker()),
                    ),
                )
            elif isinstance(handle, Patch):
                yield text.get_text(), (tuple(np.ravel(handle.get_facecolor())[:4]), handle.get_hatch())
