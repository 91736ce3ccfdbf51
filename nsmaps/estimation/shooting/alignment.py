"""The impacts of a record beside those of a model: which are the same, which were missed and which are spurious.

Times are in order on both sides, so that the best pairing is an alignment of two sequences: S. B. Needleman and C. D. Wunsch,
J. Mol. Biol. 48 (1970) 443, with impacts of the model before and after the record left out at no cost.
"""

import numpy as np

from nsmaps.arrays import Floats, Ints

UNPAIRED = -1  #: in place of the partner of an impact


def align(times: Floats, letters: Ints, model_times: Floats, model_letters: Ints, scale: Floats, gap: float) -> Ints:
    """The impact of the model that each of a record is, shape (N,), `UNPAIRED` of spurious ones.

    The sum of squared differences of paired times, in units of `scale`, is least, where an unpaired impact on either side counts
    as the square of `gap`.

    Args:
        times, letters: of the record, shape (N,); letter -1 where the wall is unknown.
        model_times, model_letters: of the model, shape (M,), letter -1 for what no sensor sees.
        scale: shape (N,), standard deviations of the times.
        gap: in units of these.
    """
    n, m, price = len(times), len(model_times), gap**2
    if n == 0 or m == 0:
        return np.full(n, UNPAIRED)
    reach = gap * scale
    inside = (model_times >= times[0] - reach[0]) & (model_times <= times[-1] + reach[-1]) & (model_letters >= 0)
    left_out = np.concatenate([[0.0], np.cumsum(price * inside)])  # the price of all impacts of the model up to each
    costs, best = np.empty((n + 1, m + 1)), left_out
    costs[0] = best
    for k in range(n):
        same = (letters[k] < 0) | (model_letters == letters[k])
        paired = np.where(same & (model_letters >= 0), ((times[k] - model_times) / scale[k]) ** 2, np.inf)
        before = np.minimum(best + price, np.concatenate([[np.inf], best[:-1] + paired]))
        best = np.minimum.accumulate(before - left_out) + left_out
        costs[k + 1] = best
    return _partners(costs, left_out, price)


def _partners(costs: Floats, left_out: Floats, price: float) -> Ints:
    """The partners on the cheapest way through a table of costs, followed from its end."""
    n, j = len(costs) - 1, costs.shape[1] - 1
    found = np.full(n, UNPAIRED)
    k = n
    while k > 0:
        if j > 0 and costs[k, j] == costs[k, j - 1] + left_out[j] - left_out[j - 1]:
            j -= 1
        elif _is_near(costs[k, j], costs[k - 1, j] + price):
            k -= 1
        elif j > 0 and not _is_near(costs[k, j], costs[k, j - 1] + left_out[j] - left_out[j - 1]):
            found[k - 1], k, j = j - 1, k - 1, j - 1
        else:
            j -= 1
    return found


def _is_near(cost: float, other: float) -> bool:
    """Whether two costs are the same up to rounding."""
    return bool(np.isfinite(other)) and abs(cost - other) <= 1e-9 * max(1.0, abs(cost))
