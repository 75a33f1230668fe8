"""An error that nobody foresaw: its line, and the file that keeps its traceback."""

from __future__ import annotations

import os
import platform
import tempfile
import traceback

from hotlever import __version__


def unforeseen_error(error: BaseException, arguments: list[str]) -> str:
    """Return the line for an error that nobody foresaw, with where its traceback is kept."""
    what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
    return f"internal error: {what} ({_logged(error, arguments)})"


def _logged(error: BaseException, arguments: list[str]) -> str:
    """Keep the traceback in a file, and say where."""
    import platformdirs

    lines = [
        f"hotlever {__version__}, Python {platform.python_version()}, {platform.platform()}\n",
        f"{['hotlever', *arguments]}\n",
        *traceback.format_exception(error),
    ]
    for folder in (platformdirs.user_log_dir("hotlever"), tempfile.gettempdir()):
        try:
            os.makedirs(folder, exist_ok=True)
            handle, path = tempfile.mkstemp(".log", "hotlever-", folder, text=True)
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.writelines(lines)
        except OSError:
            continue
        return f"please report it with {path}"
    return "no log could be written"
