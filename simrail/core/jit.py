"""Compiled kernels: one decorator and one cache that cannot go stale.

numba does not notice a change in what a kernel takes from another module (a kernel, a constant, the layout
of a record), so its disk cache can silently hold old physics. Here the cache folder is named after a hash of
every source that a kernel can take something from, and of numba's version: a changed source is a new folder.
"""

import atexit
import hashlib
import multiprocessing
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt
import platformdirs
from numba.core import event
from numba.core.options import DefaultOptions

from simrail.core.source_hash import source_hash

FloatArray = npt.NDArray[np.float64]
"""A float64 array; every hot loop takes these, C-contiguous."""

IntArray = npt.NDArray[np.int64]
"""An int64 array, C-contiguous: which of several a sample belongs to."""

KERNEL_FOLDERS = ("core", "track", "vehicle", "recording", "sensors", "estimators")
"""Where kernels lie, and what is compiled into them."""

_Function = TypeVar("_Function", bound=Callable[..., object])


def cache_folder() -> Path:
    """Folder of everything that simrail may throw away: rides and compiled kernels."""
    return Path(platformdirs.user_cache_dir("simrail", appauthor=False))


def kernel_hash() -> str:
    """SHA-256 over the sources of `KERNEL_FOLDERS`, and numba's version, 16 digits."""
    text = numba.__version__ + source_hash(*KERNEL_FOLDERS)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _kernel_folder() -> Path:
    """Where kernels are kept: in the cache, or in a temporary folder where that cannot be written.

    numba would put them beside their sources, where they go stale.
    """
    if _SPARE in os.environ:
        return Path(os.environ[_SPARE])
    folder = cache_folder() / "kernels" / kernel_hash()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        Path(tempfile.mkdtemp(prefix=".", dir=folder)).rmdir()
        return folder
    except OSError:
        spare = tempfile.mkdtemp(prefix="simrail-kernels-")
    os.environ[_SPARE] = spare  # processes that this one starts share it
    atexit.register(shutil.rmtree, spare, ignore_errors=True)
    with suppress(OSError, shutil.Error):
        shutil.copytree(folder, spare, dirs_exist_ok=True)
    return Path(spare)


_SPARE = "SIMRAIL_SPARE_KERNELS"
_KERNELS = str(_kernel_folder())
# numba reads its settings anew from the environment whenever a variable of its own has changed there.
os.environ["NUMBA_CACHE_DIR"] = _KERNELS
numba.config.CACHE_DIR = _KERNELS  # type: ignore[attr-defined]


_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
"""Nobody calls a kernel from C, so numba need not make an entrance for it."""


def njit(function: _Function) -> _Function:
    """Compile a function for float64 arrays: cached on disk, without the GIL, IEEE division."""
    return cast("_Function", numba.njit(**_OPTIONS)(function))


_BORROWED: dict[str, Any] = {**_OPTIONS, **({"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {})}
"""numba's switch for its reference counts; a release without it is slower, not wrong."""
_INNER: dict[str, Any] = {**_BORROWED, "no_cpython_wrapper": True}


def njit_borrowed(function: _Function) -> _Function:
    """`njit` for functions that neither make nor return an array: they borrow what they are handed.

    Without reference counts: numba counts at every view and every call that takes arrays, which in the
    force kernel costs as much as the physics (2.1 against 1.2 us for a bogie). The caller holds the
    arrays, so nothing can vanish. A function that makes an array does not compile.
    """
    return cast("_Function", numba.njit(**_BORROWED)(function))


def njit_inner(function: _Function) -> _Function:
    """`njit_borrowed` for functions that only kernels call, never Python: a tenth less to compile."""
    return cast("_Function", numba.njit(**_INNER)(function))


def njit_inline(function: _Function) -> _Function:
    """`njit_borrowed` for a function that the compiler puts in the place of its call.

    LLVM leaves most calls as they are. Where the arrays' shapes are known in the caller, the loops become
    straight lines there: the update of the trajectory filter takes 0.45 in place of 0.68 us for a sample.
    Only where that is measured: putting everything in place makes the same filter slower (0.51 us).
    """
    return cast("_Function", numba.njit(forceinline=True, **_BORROWED)(function))


class _Announcer(event.Listener):
    """Says on stderr, once per module, that its kernels are being compiled; one in the cache is not."""

    def __init__(self) -> None:
        self._depth = 0
        self._modules: set[str] = set()

    def on_start(self, event: Any) -> None:
        module = event.data["dispatcher"].py_func.__module__
        if self._depth == 0 and module.startswith("simrail.") and module not in self._modules:
            self._modules.add(module)
            print(
                f"compiling {module} (some seconds, once for each version) ...", file=sys.stderr, flush=True
            )
        self._depth += 1

    def on_end(self, _event: Any) -> None:
        self._depth -= 1


if multiprocessing.current_process().name == "MainProcess":  # the workers of a campaign keep silent
    event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]
