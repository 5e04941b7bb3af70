"""A picture on its way: taken up, gone on with, and kept now and then."""

import sys
import time
from pathlib import Path

from .. import checkpoint
from ..camera import AbstractCamera
from ..film import expose, Film
from ..image import Attribute
from ..render import Response
from ..sky import AbstractSky
from ..solver import SolvedSky
from ._session import progress_bar
from ._stop import interruptible, Stop
from ._write import Seen


_EVERY = 60.0  # seconds between two checkpoints
_LATE = (
    "atmos: paths of very many turns were ended by chance; by them would come {:.2g} "
    "of the light, were it even all around: it is seldom found, and then bright"
)


class Work:
    """Looks again and again, until enough has been seen or someone interrupts it.

    A look is of `each` paths. What there is lies in the file `kept` now and then.
    """

    def __init__(self, stop: Stop, kept: Path, each: int):
        self.stop = stop
        self.kept = kept
        self.each = each
        self.interrupted = False

    def look(
        self, sky: AbstractSky, camera: AbstractCamera, response: Response | None
    ) -> Seen:
        """What a camera sees in the end."""
        assert isinstance(sky, SolvedSky)
        film, seconds = self._seen(sky, camera, response)
        layers = {}
        if film.late > 0.0:
            print(_LATE.format(film.late), file=sys.stderr)
        said: dict[str, Attribute] = {
            "samples": round(film.looks * self.each),
            "seconds": round(seconds, 3),
            "lateShare": film.late,
        }
        if film.looks >= 2.0:
            layers["variance"] = film.variance()
            said["relativeError"] = film.error()
        return Seen(film.mean(), layers=layers, said=said)

    def _seen(
        self, sky: SolvedSky, camera: AbstractCamera, response: Response | None
    ) -> tuple[Film, float]:
        film, before = Film.blank(camera, sky, response), 0.0
        made = checkpoint.words(film, sky, response)
        if self.kept.exists():
            film, before = checkpoint.load(self.kept, film, made)
        began = saved = time.monotonic()
        seconds = lambda: before + time.monotonic() - began
        done = self.stop.share(film, self.each, before)
        with progress_bar("render") as tell, interruptible() as interrupted:
            for now in expose(film, sky, response) if done < 1.0 else ():
                film = now
                done = max(done, self.stop.share(film, self.each, seconds()))
                tell(done)
                self.interrupted = done < 1.0 and interrupted()
                ends = self.interrupted or done >= 1.0
                if ends or time.monotonic() - saved >= _EVERY:
                    checkpoint.save(self.kept, film, made, seconds())
                    saved = time.monotonic()
                if ends:
                    break
        return film, seconds()
