"""A job's words go into its log, its progress bar to the terminal as well."""

import os
import pty
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[2] / "workflow/scripts"


def run(folder, code: str, **streams) -> tuple[int, str]:
    """Exit status and log of a job with this body."""
    log = folder / "job.log"
    body = (
        f"import sys\nsys.path[:0] = {[str(SCRIPTS), str(SCRIPTS.parents[1])]!r}\nimport joblog\n"
    )
    body += f"progress = joblog.start({str(log)!r})\n{code}"
    done = subprocess.run([sys.executable, "-c", body], check=False, **streams)
    return done.returncode, log.read_text()


def test_all_that_is_printed_is_in_the_log_in_order(tmp_path):
    code = "import os\nprint('one')\nos.system('echo two')\nprint('three', file=sys.stderr)"
    assert run(tmp_path, code) == (0, "one\ntwo\nthree\n")


def test_an_uncaught_exception_is_in_the_log(tmp_path):
    status, log = run(tmp_path, "print('begun')\nraise RuntimeError('no convergence')")
    assert status == 1
    assert log.startswith("begun\nTraceback")
    assert log.endswith("RuntimeError: no convergence\n")


def test_progress_is_plain_lines_in_the_log_and_a_bar_on_a_terminal(tmp_path):
    code = "report = progress('settle', 'steps')\nreport(1, 2)\nreport(2, 2)"
    main, terminal = pty.openpty()
    _, log = run(tmp_path, code, stderr=terminal)
    os.close(terminal)
    shown = os.read(main, 10_000).decode()
    os.close(main)
    assert "2/2" in shown
    assert "settle: 2 of 2 steps" in log
    assert "\r" not in log


def test_nothing_but_the_log_gets_progress_where_there_is_no_terminal(tmp_path):
    with open(tmp_path / "stderr", "w+") as stderr:
        _, log = run(tmp_path, "progress('settle')(5, 5)", stderr=stderr)
        stderr.seek(0)
        assert stderr.read() == ""
    assert log.startswith("settle: 5 of 5 items")
