"""Box maps of formulas, by interval arithmetic written out: for the tests of what is made from box images."""

from dataclasses import dataclass

import numpy as np

from nsmaps.coordinates import Angle, wrap
from nsmaps.exact.enclosure.images import BoxImages
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns


def square(low, high):
    """The squares of intervals."""
    ends = np.stack([low * low, high * high])
    return np.where((low < 0) & (high > 0), 0.0, ends.min(axis=0)), ends.max(axis=0)


def one_each(images, bounded=None, empty=None):
    """One image box a source; rounding is far below the cells of the tests, and a little is added for it."""
    images = images + np.array([-1e-13, 1e-13])
    n = len(images)
    bounded = np.ones(n, bool) if bounded is None else bounded
    images[~bounded] = [-np.inf, np.inf]
    empty = np.zeros(n, bool) if empty is None else empty
    return BoxImages(np.arange(n), images, np.full(n, ""), bounded, empty)


@dataclass
class Henon(ReturnMap):
    """x' = 1 - a x^2 + y, y' = b x, with its derivative."""

    a: float = 1.4
    b: float = 0.3
    coordinates: tuple[str, ...] = ("x", "y")

    def image_boxes(self, boxes):
        (x0, x1), (y0, y1) = boxes[:, 0].T, boxes[:, 1].T
        low, high = square(x0, x1)
        sides = [[1 - self.a * high + y0, 1 - self.a * low + y1], [self.b * x0, self.b * x1]]
        return one_each(np.array(sides).transpose(2, 0, 1))

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        image = np.column_stack([1 - self.a * x[:, 0] ** 2 + x[:, 1], self.b * x[:, 0]])
        slopes = np.zeros((len(x), 2, 2))
        slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 0] = -2 * self.a * x[:, 0], 1, self.b
        return plain_returns(self.coordinates, x, image, slopes if derivative else None)


@dataclass
class Logistic:
    """x' = a x (1 - x)."""

    a: float = 4.0
    coordinates: tuple[str, ...] = ("x",)

    def image_boxes(self, boxes):
        ends = self.a * boxes[:, 0] * (1 - boxes[:, 0])
        top = np.where((boxes[:, 0, 0] < 0.5) & (boxes[:, 0, 1] > 0.5), self.a / 4, ends.max(axis=1))
        return one_each(np.stack([ends.min(axis=1), top], axis=1)[:, None, :])


@dataclass
class Turn(ReturnMap):
    """phi' = phi + shift on the circle, r' = r / 2: every orbit comes to the circle r = 0."""

    shift: float = 1.0
    turns: int = 3
    coordinates: tuple[str, ...] = ("r", Angle("phi"))

    def image_boxes(self, boxes):
        return one_each(np.stack([boxes[:, 0] / 2, boxes[:, 1] + self.shift + 2 * np.pi * self.turns], axis=1))

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        slopes = np.broadcast_to(np.diag([0.5, 1.0]), (len(x), 2, 2)) if derivative else None
        return Returns.of_map(self.coordinates, x, x * [0.5, 1] + [0, self.shift], slopes)


@dataclass
class Sway(ReturnMap):
    """r' = r / 2, phi' = phi + sin(phi) / 2, increasing: fixed points 0, on the end of the turn, and pi."""

    coordinates: tuple[str, ...] = ("r", Angle("phi"))

    def image_boxes(self, boxes):
        return one_each(np.stack([boxes[:, 0] / 2, boxes[:, 1] + np.sin(boxes[:, 1]) / 2], axis=1))

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        image = np.column_stack([x[:, 0] / 2, x[:, 1] + np.sin(x[:, 1]) / 2])
        slopes = np.zeros((len(x), 2, 2))
        slopes[:, 0, 0], slopes[:, 1, 1] = 0.5, 1 + np.cos(x[:, 1]) / 2
        return plain_returns(self.coordinates, x, image, slopes if derivative else None)


def plain_returns(names, start, image, slopes=None):
    """Returns of a formula."""
    angles = np.array([isinstance(name, Angle) for name in names])
    image = np.where(angles, wrap(image), image)
    blank = np.zeros(len(start))
    zero = np.zeros(start.shape, np.int32)
    return Returns(tuple(names), ("B",), start, image, zero, np.full(len(start), 5), blank.astype(np.int8), blank, slopes)
