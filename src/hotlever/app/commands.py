"""A command of the command line, run in a worker process as the app asks for it."""

from __future__ import annotations

import io
import os
import shlex
from contextlib import redirect_stdout
from pathlib import Path

from hotlever.app.changes import Changes
from hotlever.app.child import Report
from hotlever.cli import main
from hotlever.cli.output import heard_by


def run_command(report: Report, arguments: list[str], folder: Path) -> tuple[int, str]:
    """Run a command in a folder as the command line does; return exit status and result.

    What it writes there can be undone.
    """
    os.chdir(folder)
    result = io.StringIO()
    what = shlex.join(["hotlever", *arguments])
    with heard_by(report), redirect_stdout(result), Changes(folder).recorded(what):
        try:
            main(arguments)
        except SystemExit as ended:
            return int(ended.code or 0), result.getvalue()
