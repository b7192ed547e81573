"""Files that are either whole or absent."""

import errno
import glob
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LEAST_ROOM = 2**20
"""Bytes that a disk has which is not full."""


@contextmanager
def atomic(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a temporary path beside `path`; move it into place when the block ends well.

    The temporary file has the suffix of `path`, because some writers choose the format by it.
    When the block raises, the temporary file is removed and `path` stays as it was. Raises OSError
    with the errno ENOSPC where the disk is full, whatever the writer made of that.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes the file private; a result has the permissions of any other new file.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, path)
    except (OSError, RuntimeError) as error:
        # Libraries hide the system's word: NetCDF says "HDF error".
        if _is_full(temporary):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path)) from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _is_full(path: Path) -> bool:
    """Whether the disk has no room for a file like `path`, as far as it was written, again."""
    try:
        return shutil.disk_usage(path.parent).free < max(path.stat().st_size, LEAST_ROOM)
    except OSError:
        return False


def remove_leftovers(path: str | os.PathLike) -> None:
    """Remove temporary files of `path` that a killed process left; none may be at work on it."""
    path = Path(path)
    # Eight characters are what mkstemp draws.
    stem, suffix = glob.escape(path.stem), glob.escape(path.suffix)
    for temporary in path.parent.glob(f".{stem}.{8 * '?'}{suffix}"):
        temporary.unlink()
