"""The command line: `atmos sky`, `render`, `scene`, `compare`, and tables."""

import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from . import (
    _compare as _compare,
    _picture as _picture,
    _render as _render,
    _scene as _scene,
    _table as _table,
)
from ._app import app, CycloptsError
from ._options import SunPosition as SunPosition


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line, and returns the exit code: 2 after bad input."""
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            app(arguments, exit_on_error=False, print_error=False, verbose=False)
            sys.stdout.flush()
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        # Whoever read our output has enough; Python would complain when it closes it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        name = "" if error.filename is None else f"{error.filename}: "
        return _complain(f"{name}{error.strerror or error}")
    except (CycloptsError, ImportError, ValueError) as error:
        return _complain(str(error))
    except MemoryError:
        return _complain("out of memory; ask for fewer pixels or wavelengths")
    return 0


def _complain(text: str) -> int:
    print(f"atmos: {' '.join(text.split())}", file=sys.stderr)
    return 2


def _warn(message: Any, *rest: Any) -> None:
    print(f"atmos: warning: {' '.join(str(message).split())}", file=sys.stderr)
