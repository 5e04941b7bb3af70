"""When a picture is done, and how it is stopped before that."""

import contextlib
import dataclasses
import math
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Annotated

from ..film import Film
from ._app import HIGHEST, real, whole


# Fewer looks do not say how exact a picture is.
_LEAST, _KNOWN = 2, 8


@dataclasses.dataclass(frozen=True)
class Stop:
    """When a picture is done: by what comes first of what is asked for."""

    samples: Annotated[
        int | None,
        whole(
            "Paths a pixel and light, at least; with --solver march looks.  "
            "[default: 256, unless the others say when]",
            1,
            10**9,
        ),
    ] = None
    error: Annotated[
        float | None,
        real(
            "Relative standard error, 0.01 for one per cent: the root mean square over "
            "the pixels that are not black, of which the dark count less.",
            1e-6,
            10.0,
            "",
        ),
    ] = None
    time: Annotated[
        float | None,
        real(
            "Time, with what went before if the work is taken up again; but each pixel "
            "is looked at twice.",
            0.0,
            HIGHEST,
            "SECONDS",
        ),
    ] = None

    def share(self, film: Film, each: int, seconds: float) -> float:
        """How much of the work is done, roughly; 1 if all is.

        A look is of `each` paths. Errors are looked at when all pixels are even.
        """
        if film.looks < _LEAST:
            return 0.0
        shares = []
        if self.samples is not None or self.error is None and self.time is None:
            looks = math.ceil((self.samples or 256) / each)
            shares.append(film.looks / looks)
        if self.error is not None and film.even and film.looks >= _KNOWN:
            found = film.error()
            shares.append((self.error / found) ** 2 if found > 0.0 else 1.0)
        if self.time is not None:
            shares.append(seconds / self.time if self.time > 0.0 else 1.0)
        return min(max(shares, default=0.0), 1.0)


@contextlib.contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Tells if someone pressed Ctrl-C; who does so again ends the program at once."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    before = signal.getsignal(signal.SIGINT)

    def note(*_):
        pressed.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)
