"""Where compiled kernels are kept: it has to be settled before numba meets the first of them."""

import os
import stat
import sys
import tempfile
from pathlib import Path


def find_cache_folder() -> None:
    """Name a folder for numba's cache where numba would find none, and give up.

    numba keeps what it compiled beside the source or in the user's cache folder. Where neither can
    be written, NUMBA_CACHE_DIR becomes a folder of this user alone in the system's temporary one.
    """
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    usual = (Path(__file__).parent / "__pycache__", Path(cache) / "numba")
    if "NUMBA_CACHE_DIR" in os.environ or any(map(_can_be_written, usual)):
        return
    folder = os.environ["NUMBA_CACHE_DIR"] = _private_folder()
    config = sys.modules.get("numba.core.config")
    if config is not None:  # then it has read the environment already
        vars(config)["CACHE_DIR"] = folder


def _can_be_written(folder: Path) -> bool:
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _private_folder() -> str:
    """A folder that the next process finds again, unless someone else has put his there.

    What numba reads from its cache it executes.
    """
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"dustfall-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if stat.S_ISDIR(found.st_mode) and found.st_uid == user and not found.st_mode & 0o077:
            return str(folder)
    except OSError:
        pass
    return tempfile.mkdtemp(prefix="dustfall-")
