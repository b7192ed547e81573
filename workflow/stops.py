"""Why a run stopped, in one sentence at the end of what the terminal shows.

A job that stops leaves its sentence in `logs/stopped`; Snakemake's process says it last.
"""

import atexit
import errno
import fcntl
import os
import re
import shlex
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from workflow.checksums import RESULTS

NOTE = Path("logs/stopped")
SCRIPTS = Path(".snakemake/scripts")
OWN_RUN = Path(".snakemake/dustfall.lock")

CAUSES = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota of the disk is used up",
    errno.EACCES: "no permission to write or read there",
    errno.EROFS: "the file system is read-only",
    errno.ENOMEM: "the memory is used up",
}
"""What the errors of the system mean that a campaign meets."""


def sentence(error: BaseException) -> str:
    """Say in one line what an exception means."""
    words = " ".join(str(error).split())
    if isinstance(error, OSError) and error.errno in CAUSES:
        file = f"{error.filename}: " if error.filename else ""
        return f"{file}{CAUSES[error.errno]}"
    told = re.search(r"\(os error (\d+)\)", words)  # by libraries in Rust, safetensors among them
    if told and int(told[1]) in CAUSES:
        return CAUSES[int(told[1])]
    if isinstance(error, MemoryError):
        return f"{CAUSES[errno.ENOMEM]}: {words}" if words else CAUSES[errno.ENOMEM]
    return words or type(error).__name__


def note(words: str) -> None:
    """Leave a sentence for the end; without one, where even that finds no place."""
    with suppress(OSError):
        NOTE.parent.mkdir(exist_ok=True)
        with open(NOTE, "a", encoding="utf-8") as file:
            file.write(f"{words}\n")


def be_alone() -> None:
    """Exit with a sentence where another run is at work in this folder; keep others out from now.

    Snakemake's own lock knows files, and lets runs through that share none, `verify` among them:
    it would complain of files that are being written, and `clear` takes scripts that still run.
    """
    OWN_RUN.parent.mkdir(exist_ok=True)
    # Held until this process ends, however it ends.
    file = os.open(OWN_RUN, os.O_RDWR | os.O_CREAT)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        sys.exit(_last_words("another run is at work in this folder, and goes on"))
    except OSError:
        pass  # a file system without locks


def clear() -> None:
    """Remove what runs leave that nobody needs: notes, Snakemake's copies of scripts of a run that
    was killed, empty folders. No job may be at work."""
    NOTE.unlink(missing_ok=True)
    for script in SCRIPTS.glob("tmp*"):
        script.unlink(missing_ok=True)
    for folder, _, _ in os.walk(RESULTS, topdown=False):
        with suppress(OSError):  # not empty
            os.rmdir(folder)


def require_writable() -> None:
    """Exit with a sentence where nothing can be written to `results`.

    Snakemake removes old outputs before a job begins, and shows no more than a traceback where it
    cannot.
    """
    if RESULTS.exists() and not os.access(RESULTS, os.W_OK):
        read_only = os.statvfs(RESULTS).f_flag & os.ST_RDONLY
        cause = CAUSES[errno.EROFS if read_only else errno.EACCES]
        sys.exit(_last_words(f"{RESULTS}: {cause}"))


def tell_interrupts(end_line: Callable[[], None]) -> None:
    """Have an interrupt end with a sentence where Snakemake ends with a traceback, or with nothing.

    So it does while it plans, until its scheduler waits for jobs and answers signals itself.
    `end_line` ends what is shown of the run.
    """
    usual = sys.excepthook

    def hook(kind, error, trace) -> None:
        if issubclass(kind, KeyboardInterrupt):
            end_line()
            warnings.simplefilter("ignore")  # of what is cut short
            print(_last_words(str(error) or "interrupted"), file=sys.stderr, flush=True)
        else:
            usual(kind, error, trace)

    def end(number, frame) -> None:
        raise KeyboardInterrupt(f"ended by {signal.Signals(number).name}")

    sys.excepthook = hook
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) != signal.SIG_IGN:
                # Python's own handler of SIGINT would give way to that of asyncio, which planning
                # does not wait for.
                signal.signal(number, end)


def announce(logs) -> None:
    """Say at the very end why the run stopped, and what goes on; `logs` are those of Snakemake."""
    words = "; ".join(dict.fromkeys(_notes())) or _killed(logs) or "the cause is shown above"
    atexit.register(print, _last_words(words), file=sys.stderr, flush=True)


def _last_words(words: str) -> str:
    return f"Stopped: {words}. To go on: {shlex.join(['snakemake', *sys.argv[1:]])}"


def _notes() -> list[str]:
    try:
        return NOTE.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def _killed(logs) -> str:
    """The signal that a job died of, as the log of Snakemake tells it."""
    for log in logs:
        found = re.search(r"died with <Signals\.(SIG\w+)", Path(log).read_text(encoding="utf-8"))
        if found:
            short = " (by the system, where memory is short)" if found[1] == "SIGKILL" else ""
            return f"a job was ended by {found[1]}{short}"
    return ""
