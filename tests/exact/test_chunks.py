"""Batches on all cores: which chunks they are cut into, and what becomes of failures."""

from threading import Lock

import numpy as np
import pytest
from messages import message

from nsmaps.exact.kernel import chunks_of, in_chunks


@pytest.mark.parametrize(
    ("n", "size", "cores"),
    [(26_000, 25_000, 2), (200_000, 25_000, 2), (1_000_003, 25_000, 64), (9, 8, 3), (9, 5, 3), (5, 2, 4), (3, 1, 64)],
)
def test_chunks_cover_all_and_are_small_in_the_end(n: int, size: int, cores: int) -> None:
    chunks = list(chunks_of(n, size, cores))
    assert [0, *(k.stop for k in chunks)] == [*(k.start for k in chunks), n]
    lengths = [k.stop - k.start for k in chunks]
    assert max(lengths) <= size
    assert lengths == sorted(lengths, reverse=True)
    assert max(lengths[-cores:]) <= max(size // 8, n // (2 * cores), 1)
    assert len(chunks) >= cores or n < cores * size // 8


def test_every_state_is_computed_once() -> None:
    seen, lock = np.zeros(10_000, int), Lock()

    def run(k: slice) -> None:
        with lock:
            seen[k] += 1

    for n in (0, 1, 100, 10_000):
        seen[:] = 0
        in_chunks(n, run, 100)
        assert (seen[:n] == 1).all()
        assert (seen[n:] == 0).all()


def test_a_failure_is_told_and_ends_the_rest() -> None:
    done: list[slice] = []

    def run(k: slice) -> None:
        if k.start == 0:
            raise ZeroDivisionError("raised by the test")
        done.append(k)

    with pytest.raises(ZeroDivisionError, match=message("others.raised")):
        in_chunks(100_000, run, 10)
    assert len(done) < len(list(chunks_of(100_000, 10, 1)))
