"""The alignment of impacts, against the best of all pairings."""

from itertools import combinations, pairwise

import numpy as np

from nsmaps.estimation.shooting.alignment import UNPAIRED, align

GAP = 3.0


def cost_of(pairs: list[tuple[int, int]], times: np.ndarray, model: np.ndarray, scale: float) -> float:
    """The cost of a pairing, where all impacts of the model count that lie within the record, up to the gap."""
    inside = (model >= times[0] - GAP * scale) & (model <= times[-1] + GAP * scale)
    left = sum(inside) - sum(inside[j] for _, j in pairs)
    return sum(((times[i] - model[j]) / scale) ** 2 for i, j in pairs) + GAP**2 * (len(times) - len(pairs) + left)


def best_of_all(times: np.ndarray, letters: np.ndarray, model: np.ndarray, names: np.ndarray, scale: float) -> float:
    """The least cost of all monotone pairings with equal letters."""
    costs = []
    for count in range(min(len(times), len(model)) + 1):
        for rows in combinations(range(len(times)), count):
            for columns in combinations(range(len(model)), count):
                pairs = list(zip(rows, columns, strict=True))
                if all(letters[i] < 0 or letters[i] == names[j] for i, j in pairs):
                    costs.append(cost_of(pairs, times, model, scale))
    return min(costs)


def test_the_alignment_is_the_best_of_all_pairings() -> None:
    rng, tried = np.random.default_rng(3), 0
    for _ in range(30):
        times, model = np.sort(rng.uniform(0, 3, 5)), np.sort(rng.uniform(0, 3, rng.integers(3, 7)))
        letters, names = rng.integers(-1, 2, 5), rng.integers(0, 2, len(model))
        found = align(times, letters, model, names, np.full(5, 0.2), GAP)
        pairs = [(i, int(j)) for i, j in enumerate(found) if j != UNPAIRED]
        assert all(a < b for (_, a), (_, b) in pairwise(pairs))
        assert all(letters[i] < 0 or letters[i] == names[j] for i, j in pairs)
        assert np.isclose(cost_of(pairs, times, model, 0.2), best_of_all(times, letters, model, names, 0.2))
        tried += 1
    assert tried == 30


def test_missed_and_doubled_impacts_are_left_unpaired() -> None:
    model = np.arange(10.0)
    times = np.array([0.01, 1.0, 1.0, 2.02, 4.01, 5.0])  # 1 twice, 3 missed
    found = align(times, np.full(6, -1), model, np.zeros(10, int), np.full(6, 0.05), 5.0)
    assert sorted(found[1:3].tolist()) == [UNPAIRED, 1]
    assert found[[0, 3, 4, 5]].tolist() == [0, 2, 4, 5]


def test_nothing_is_paired_with_nothing() -> None:
    none = np.zeros(0)
    assert align(none, none.astype(int), np.ones(2), np.zeros(2, int), none, 5.0).tolist() == []
    assert align(np.ones(2), np.zeros(2, int), none, none.astype(int), np.ones(2), 5.0).tolist() == [UNPAIRED] * 2
