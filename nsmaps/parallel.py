"""Long computations in parts that do not need each other: here, in any executor, kept in a folder and taken up again."""

import hashlib
import json
import pickle
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import singledispatch, wraps
from itertools import takewhile
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError, check_class
from nsmaps.errors.arguments import with_arguments
from nsmaps.files.npz import packed, read_arrays
from nsmaps.files.storage import replace_file, sweep
from nsmaps.interrupts import Interrupted
from nsmaps.progress import Progress, beat, portion, silent, working

P = ParamSpec("P")
R = TypeVar("R")
Arrays = dict[str, NDArray[Any]]
NOTE, OF = "parts.json", "part_of"  #: of a folder of parts: the file that says of what, and the key in each that does
NOT_COMPUTED = "not computed: interrupted"  #: the reason why a result has no numbers of a part
LOST = ("KilledWorker", "CancelledError", "FutureCancelledError")  #: errors of dask for a worker that is lost permanently


def names_as_arrays(coordinates: Coordinates, walls: Sequence[str] = ()) -> Arrays:
    """Names among the arrays of a part; see `names_among`."""
    return {"coordinates": np.array(coordinates.names, str), "angles": coordinates.angles, "walls": np.array(walls, str)}


def names_among(arrays: Arrays) -> tuple[Coordinates, tuple[str, ...]]:
    """The coordinates, with their angles, and the walls that `names_as_arrays` has put there."""
    names = arrays["coordinates"]
    return Coordinates(names.tolist(), names[arrays["angles"]].tolist()), tuple(arrays["walls"].tolist())


@dataclass(frozen=True, slots=True)
class Parallel:
    """Where the parts of a long computation run, where finished parts are kept, and what its progress is reported to.

    The numbers are those of a computation without it, digit for digit, for exact systems.

    Args:
        executor: any `concurrent.futures.Executor`, such as a `ProcessPoolExecutor` or `client.get_executor(pure=False)` of dask;
            this process if omitted. Parts whose worker was lost for good are computed in this process, with a warning.
        checkpoint: a folder for finished parts, which the same call reads instead of computing them again.
        part: how many items a part has: values of a parameter, rows of a diagram, starts, realisations; the function decides if
            omitted.
        progress: called with the fraction of the computation that is done, from 0 to 1; after each part, where there are parts.

    Raises:
        NsmapsError: an invalid executor, or a part without items.
    """

    executor: Executor | None = None
    checkpoint: str | Path | None = None
    part: int | None = None
    progress: Progress | None = None

    def __post_init__(self) -> None:
        if self.executor is not None and not isinstance(self.executor, Executor):
            raise NsmapsError(
                f"the executor is a {type(self.executor).__name__}; expected: a concurrent.futures.Executor, such as a "
                "ProcessPoolExecutor or client.get_executor(pure=False) of a dask client"
            )
        if self.part is not None and self.part < 1:
            raise NsmapsError(f"a part has {self.part} items; expected: at least 1")

    @property
    def divided(self) -> bool:
        """Whether a computation is divided into parts at all: they run elsewhere, or are kept."""
        return self.executor is not None or self.checkpoint is not None

    @property
    def path(self) -> Path | None:
        """The folder for finished parts, if there is one."""
        return None if self.checkpoint is None else Path(self.checkpoint)

    def cuts(self, n_items: int, n_default: int = 1) -> list[slice]:
        """The items of each part: `part` of them, by default as many as the function sets."""
        size = self.part or n_default
        return [slice(k, min(k + size, n_items)) for k in range(0, n_items, size)]

    def share(self, first: float, last: float, *names: str) -> "Parallel":
        """One portion of a computation, between two fractions of it, with a folder of its own under these names."""
        folder = self.path and self.path.joinpath(*names)
        return replace(self, checkpoint=folder, progress=portion(self.progress, first, last))

    def run(
        self,
        work: Callable[..., Arrays],
        parts: Sequence[tuple[Any, ...]],
        unfinished: Callable[[dict[int, Arrays]], Any] | None = None,
    ) -> list[Arrays]:
        """The arrays `work(*part)` of every part, in their order.

        Args:
            work: a function of a module, which every process can import.
            parts: its arguments.
            unfinished: the result of the call of which these are the parts, from the arrays of some of them by number.

        Raises:
            NsmapsError: the checkpoint has parts of other work, or a part cannot be sent to another process or recognised later.
            Interrupted: Ctrl-C; `result` is that of `unfinished`, or without it the arrays of finished parts by number.
        """
        folder = None if self.path is None else _Folder.of(self.path, work, parts)
        found = {} if folder is None else folder.read(len(parts))
        left = [k for k in range(len(parts)) if k not in found]
        with working(work.__name__, self.progress):
            try:
                if found:
                    _report(len(found), len(parts))
                for number, arrays in _computed(work, parts, left, self.executor):
                    found[number] = arrays
                    if folder is not None:
                        folder.write(number, arrays)
                    _report(len(found), len(parts))
            except KeyboardInterrupt:
                raise Interrupted(_unfinished(found, unfinished), self.path, f"{len(found)} of {len(parts)} parts") from None
        return [found[number] for number in range(len(parts))]


SERIAL = Parallel()  #: no parts at all, in this process


def divides(call: Callable[P, R]) -> Callable[P, R]:
    """A long call with the keyword `parallel`, whose progress its own `beat` and its parts report, or a line."""

    @wraps(call)
    def call_divided(*args: P.args, **kwargs: P.kwargs) -> R:
        parallel: Any = kwargs.get("parallel") or SERIAL
        check_class(parallel, Parallel, "`parallel` has the parts of a call")
        with working(call.__name__, parallel.progress) as work:
            kwargs["parallel"] = replace(parallel, progress=work.reached)
            return with_arguments(call, *args, **kwargs)

    return call_divided


def _unfinished(found: dict[int, Arrays], result: Callable[[dict[int, Arrays]], Any] | None) -> Any:
    """What an interrupted call has as its result; None where no part gives one."""
    try:
        return (result(found) if result else found) if found else None
    except NsmapsError:
        return None


def _report(done: int, parts: int) -> None:
    beat(done / parts, f"{done} of {parts} parts")


def begun(found: Mapping[int, Arrays]) -> list[Arrays]:
    """The arrays of the first parts, up to one that is not finished."""
    return [found[k] for k in takewhile(found.__contains__, range(max(found) + 1))]


def concatenated(parts: Sequence[Arrays]) -> Arrays:
    """The arrays of all parts by name, joined along their first axis."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _computed(
    work: Callable[..., Arrays], parts: Sequence[tuple[Any, ...]], todo: list[int], executor: Executor | None
) -> Iterator[tuple[int, Arrays]]:
    """The numbers and arrays of the parts to do, as they are finished."""
    left = set(todo)
    if executor is not None and todo:
        _check_sent(work, parts[todo[0]], executor)
        futures: dict[Future[Arrays], int] = {}
        why = ""
        try:
            try:
                for k in todo:
                    futures[executor.submit(work, *parts[k])] = k
            except Exception as error:  # a worker was lost before all were sent
                why = _lost(error)
            for future in as_completed(futures):
                try:
                    arrays = future.result()
                except Exception as error:  # of this part alone: others may be finished elsewhere
                    why = _lost(error)
                    continue
                yield futures[future], arrays
                left.discard(futures[future])
        finally:
            for future in futures:
                future.cancel()
        if left:
            text = f"workers were lost ({why}); {len(left)} of {len(parts)} parts are computed here"
            warnings.warn(text, RuntimeWarning, stacklevel=4)
    for number in sorted(left):
        with silent(), working("part"):
            arrays = work(*parts[number])
        yield number, arrays


def _lost(error: Exception) -> str:
    """The message of the error of a worker that was lost permanently; any other error is raised."""
    if not isinstance(error, BrokenExecutor) and type(error).__name__ not in LOST:
        raise error
    return str(error) or type(error).__name__


def _check_sent(work: object, part: tuple[Any, ...], executor: Executor) -> None:
    """Whether another process can be sent a part. Threads need not, and dask has ways of its own."""
    if isinstance(executor, ProcessPoolExecutor):
        try:
            pickle.dumps((work, part))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise NsmapsError(
                f"a part cannot be sent to another process: {error}; expected: functions and classes of modules, "
                "such as nsmaps.exact.Along(system, 'd') for a map_of"
            ) from error


@dataclass(frozen=True, slots=True)
class _Folder:
    """Finished parts as files, beside a note of what they are parts of."""

    path: Path
    work: str  #: a digest of what they are parts of, which each of them holds

    @classmethod
    def of(cls, path: Path, work: Callable[..., Arrays], parts: Sequence[tuple[Any, ...]]) -> "_Folder":
        """The folder for these parts; made, or found to be of the same."""
        text = fingerprint((f"{work.__module__}.{work.__qualname__}", tuple(parts)))
        digest = hashlib.sha256(text.encode()).hexdigest()
        note = {"work": work.__qualname__, "parts": len(parts), "of": digest}
        path.mkdir(parents=True, exist_ok=True)
        sweep(path)
        found = _note(path / NOTE)
        if found is not None and found != note:
            raise NsmapsError(f"the folder {path} holds parts of other work; expected: the same again, or another folder")
        if found is None:
            replace_file(path / NOTE, json.dumps(note).encode())
        return cls(path, digest)

    def read(self, count: int) -> dict[int, Arrays]:
        """The finished parts among the first `count`; one that is broken, or of other work, is not among them."""
        files = {k: self._file(k) for k in range(count)}
        found = {k: read_arrays(file) for k, file in files.items()}
        return {k: arrays for k, arrays in found.items() if arrays is not None and str(arrays.pop(OF, "")) == self.work}

    def write(self, number: int, arrays: Arrays) -> None:
        """Keep a part: its file appears whole or not at all."""
        replace_file(self._file(number), packed({**arrays, OF: np.array(self.work)}))

    def _file(self, number: int) -> Path:
        return self.path / f"part-{number:06d}.npz"


def _note(file: Path) -> Any:
    """What is noted of the work whose parts are in a folder; None where nothing is, or where it cannot be read."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


@singledispatch
def fingerprint(value: Any) -> str:
    """A text that is the same for the same value in every process, and another for another; types may register their own."""
    if is_dataclass(value) and not isinstance(value, type):
        compared = [fingerprint(getattr(value, field.name)) for field in fields(value) if field.compare]
        return f"{type(value).__qualname__}({', '.join(compared)})"
    if isinstance(value, tuple | list):
        return f"({', '.join(map(fingerprint, value))})"
    if isinstance(value, np.ndarray):
        return f"array({value.dtype}, {value.shape}, {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()})"
    text = repr(value)
    if " at 0x" in text:
        raise NsmapsError(
            f"{text} cannot be recognised in another run; expected with a checkpoint: nsmaps.exact.Along(system, 'd')"
        )
    return text
