"""Two guards that are met at once: motions go on unless the order matters, which is an outcome of its own."""

import numpy as np
import pytest

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection


class TwoBalls(HybridSystem):
    """Two balls over a table under unit gravity; at an impact of one a share of its speed goes to the other."""

    r: float
    share: float

    states = ("x", "v", "y", "u")

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1, "y": y.u, "u": -1}}

    def guards(self, t, y):
        return {
            "A": Guard("flight", y.x, reset={"v": -self.r * y.v, "u": y.u - self.share * y.v}),
            "B": Guard("flight", y.y, reset={"u": -self.r * y.u, "v": y.v - self.share * y.u}),
            "top": Guard("flight", y.v, letter=""),
        }

    def section(self, t, y):
        return PoincareSection("top", ("x", "y", "u"))


HEIGHTS = (0.3, 0.5, 0.7123, 1.0, 2.9)


@pytest.mark.parametrize("height", HEIGHTS)
def test_a_motion_goes_on_where_the_order_does_not_matter(height):
    system = TwoBalls(r=0.5, share=0.0)
    returns = system.first_return([[height, height, 0.0]])
    assert returns.outcome.tolist() == [Outcome.returned]
    assert returns.words.tolist() in (["AB"], ["BA"])
    fall = np.sqrt(2 * height)
    assert returns.image[0] == pytest.approx([height / 4, height / 4, 0.0], abs=1e-14)
    assert returns.time[0] == pytest.approx(1.5 * fall, rel=1e-14)
    near = system.first_return([[height, height * (1 + 1e-9), 0.0]])
    assert near.image[0] == pytest.approx(returns.image[0], abs=1e-8)


@pytest.mark.parametrize("height", HEIGHTS)
def test_where_the_order_matters_it_is_an_outcome_of_its_own(height):
    system = TwoBalls(r=0.5, share=0.25)
    returns = system.first_return([[height, height, 0.0]])
    assert returns.outcome.tolist() == [Outcome.simultaneous]
    assert not returns.valid[0]
    assert not returns.certified[0]
    assert returns.time[0] == pytest.approx(np.sqrt(2 * height), rel=1e-14)
    before, after = (system.first_return([[height, height * (1 + side * 1e-9), 0.0]]) for side in (-1, 1))
    assert np.abs(before.image - after.image).max() > 0.01 * height  # the two orders differ
    (reason,) = system.reasons([[height, height, 0.0]])
    assert "'A' and 'B'" in reason
    assert "'flight'" in reason
    assert f"{returns.time[0]:.10g} after the start" in reason


def test_it_is_the_same_beside_other_states():
    system = TwoBalls(r=0.5, share=0.25)
    rows = np.array([[h, h, 0.0] for h in HEIGHTS] + [[h, 1.3 * h, 0.1] for h in np.linspace(0.2, 3, 60)])
    outcomes = system.first_return(rows).outcome
    assert outcomes.tolist() == [Outcome.simultaneous] * len(HEIGHTS) + [Outcome.returned] * 60


class Corner(TwoBalls):
    """The same with the section at one of the impacts."""

    def guards(self, t, y):
        return {name: guard for name, guard in super().guards(t, y).items() if name != "top"}

    def section(self, t, y):
        return PoincareSection("A", ("v", "y", "u"))


def test_an_event_at_the_time_of_the_section_matters_where_it_changes_the_image():
    first = Corner(r=0.5, share=0.0).first_return([[-1.0, 0.5, -0.25]])
    assert first.outcome.tolist() == [Outcome.returned]
    fall = 2 * 0.5
    meeting = [[-1.0, 0.5 * fall**2 - 0.25 * fall, 0.25]]
    assert Corner(r=0.5, share=0.0).first_return(meeting).outcome.tolist() == [Outcome.simultaneous]


class Ball(HybridSystem):
    """A ball that a table returns with a share r of its speed, to a ceiling far above."""

    r: float

    states = ("x", "v")

    def modes(self, t, y):
        return {"flight": {"x": y.v, "v": -1}}

    def guards(self, t, y):
        return {"B": Guard("flight", y.x, reset={"v": -self.r * y.v}), "C": Guard("flight", 100 - y.x)}

    def section(self, t, y):
        return PoincareSection("C", ("v",))


def test_impacts_that_never_end_are_an_outcome_of_their_own():
    falling = Ball(r=0.5).first_return([[1.0]])
    assert falling.outcome.tolist() == [Outcome.accumulates]
    (reason,) = Ball(r=0.5).reasons([[1.0]])
    assert "'B' in the mode 'flight' accumulate" in reason
    assert "rests=" in reason
