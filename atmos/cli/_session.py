"""What every command does before its work, and beside it."""

import contextlib
import gc
import os
import sys
import threading
from collections.abc import Callable, Iterator

import jax
from rich.console import Console
from rich.progress import Progress

from ..reference import cache_folder


# XLA's newer emitters for CPUs compile twice as long, for code that is no faster.
_EMITTERS = "--xla_cpu_use_fusion_emitters=false"
# To trace makes many objects, hardly any of which are garbage soon: looking for it as
# often as Python does by itself takes a tenth of a short command.
_OBJECTS = 200_000


def start(double: bool = False) -> None:
    """Readies JAX: it compiles quickly, and keeps it, if there is a place to."""
    gc.set_threshold(_OBJECTS)
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_cpu_use_fusion_emitters" not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {_EMITTERS}".strip()
    folder = cache_folder() / "jax"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            jax.config.update("jax_compilation_cache_dir", str(folder))
            jax.config.update("jax_persistent_cache_min_compile_time_secs", 0)
            jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    if double:
        jax.config.update("jax_enable_x64", True)


@contextlib.contextmanager
def progress_bar(name: str) -> Iterator[Callable[[float], None]]:
    """A bar on the terminal, if there is one and the work takes more than a second."""
    if not sys.stderr.isatty():
        yield lambda done: None
        return

    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(name, total=1.0)
    late = threading.Timer(1.0, bar.start)
    late.start()
    try:
        yield lambda done: bar.update(task, completed=done)
    finally:
        late.cancel()
        late.join()
        if bar.live.is_started:
            bar.stop()
