"""Files in and out: read with limits, written whole or not at all.

`Outputs` are the files of one command, which are written all or none.
"""

from __future__ import annotations

import json
import math
import os
import secrets
import select
import stat
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from hotlever.errors import HotleverError, InputError, quoted

Name = str | os.PathLike[str]

#: What a figure can be written as, and a film.
FIGURE_TYPES, FILM_TYPES = (".png", ".svg", ".pdf"), (".gif",)
#: What names of files end in that are made of a measurement: its calibration, and the table.
CALIBRATION, TABLE = ".calibration.json", ".table.csv"
#: Bytes that a text file may have, unless its reader says otherwise.
LARGEST_TEXT = 64 * 2**20
#: Seconds to wait for a pipe that says nothing.
PATIENCE_S = 8.0


# --- reading ------------------------------------------------------------------------------------


def read_bytes(path: Name, largest: int = LARGEST_TEXT) -> bytes:
    """Read a file or a pipe of at most as many bytes, once and to its end.

    Raises
    ------
    InputError
        If it does not exist, is neither file nor pipe, cannot be read, is larger, or is a pipe
        that nobody writes to for `PATIENCE_S`.
    """
    content = bytearray()
    try:
        with open(path, "rb", buffering=0, opener=_opened) as file:
            kind = _kind(file.fileno())
            if kind not in ("file", "pipe"):
                raise InputError(f"{path}: is a {kind}, expected a file")
            # a file is always ready, and on Windows nothing but a socket can be asked
            while kind == "file" or select.select([file], [], [], PATIENCE_S)[0]:
                part = file.read(2**20)
                if part == b"":
                    return bytes(content)
                content += part or b""
                if len(content) > largest:
                    raise InputError(
                        f"{path}: larger than the {largest / 1e6:.3g} MB that such a file may have"
                    )
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder, expected a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read ({reason})") from None
    raise InputError(f"{path}: a pipe without data for {PATIENCE_S:g} s, expected a file")


def _opened(path: str, flags: int) -> int:
    """Open a file; a pipe too, where opening would wait for a writer who may never come."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_text(path: Name, largest: int = LARGEST_TEXT) -> str:
    """Read a text file in UTF-8.

    Raises
    ------
    InputError
        If `read_bytes` does, or it is no such text.
    """
    try:
        return read_bytes(path, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file in utf-8 (byte {error.start})") from error


def read_json(path: Name) -> dict[str, Any]:
    """Read a JSON file that holds an object.

    Raises
    ------
    InputError
        If it cannot be read, is no JSON, which has neither NaN nor infinities, or has a key twice.
    """

    def finite(text: str) -> float:
        if not math.isfinite(float(text)):
            raise ValueError(f"found {text[:20]}, expected a finite number")
        return int(text) if text.lstrip("-").isdigit() else float(text)

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        content = dict(pairs)
        if len(content) < len(pairs):
            names = [name for name, _ in pairs]
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"the key {quoted(twice)} is there twice")
        return content

    numbers: Any = dict.fromkeys(("parse_int", "parse_float", "parse_constant"), finite)
    try:
        content = json.loads(read_text(path), object_pairs_hook=once, **numbers)
    except RecursionError:
        raise InputError(f"{path}: not valid JSON: nested too deeply") from None
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: holds a {type(content).__name__}, expected an object {{...}}")
    return content


def json_text(content: dict[str, Any]) -> str:
    """Return the text of a JSON file that people may read."""
    plain = without_nan(content)
    return json.dumps(plain, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def without_nan(value: Any) -> Any:
    """Replace what is no finite number by None in plain values: JSON has no other word for it."""
    if isinstance(value, dict):
        return {key: without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# --- writing ------------------------------------------------------------------------------------


class Outputs:
    """The files a command writes: checked before its work, put in place together after it.

    Parameters
    ----------
    *inputs : path or None
        Files that the command reads, none of which it may write.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outputs = Outputs()
    ...     outputs.file(f"{folder}/a.csv", ".csv", ".nc")
    ...     with outputs.together():
    ...         write_text(f"{folder}/a.csv", "bias_V")
    ...         os.listdir(folder) == ["a.csv"]
    ...     os.listdir(folder)
    False
    ['a.csv']
    """

    def __init__(self, *inputs: Name | None) -> None:
        self._inputs = [Path(path) for path in inputs if path is not None]
        self._targets: set[Path] = set()
        self._written: dict[Path, Path] = {}
        self._new_folders: list[Path] = []

    def file(self, path: Name | None, *suffixes: str) -> None:
        """Check that a file can be written, and is of one of some types.

        Raises
        ------
        InputError
            If it is of another type, no regular file, an input or another output too, or its
            folder does not exist or cannot be written.
        """
        if path is None:
            return
        target, suffix = self.target(path), Path(path).suffix
        if suffixes and suffix.lower() not in suffixes:
            raise InputError(
                f"{path}: unknown file type '{suffix}', expected {' or '.join(suffixes)}"
            )
        self._ask(path, target)

    def folder(self, path: Name | None) -> None:
        """Check like `file` that a folder is there or can be made, and files written to it."""
        if path is None:
            return
        folder = Path(os.path.realpath(path))
        above = next(path for path in (folder, *folder.parents) if os.path.lexists(path))
        if not above.is_dir():
            raise InputError(f"{path}: cannot be made a folder ({above} is a file)")
        if not os.access(above, os.W_OK | os.X_OK):
            raise InputError(f"{path}: cannot be written (Permission denied)")
        self._ask(path, folder)

    def _ask(self, path: Name, target: Path) -> None:
        if target in self._targets:
            raise InputError(f"{path}: two outputs of this name, expected different ones")
        self._targets.add(target)

    def target(self, path: Name) -> Path:
        """Return the file that writing to `path` makes or replaces: links lead to it.

        Raises
        ------
        InputError
            See `file`.
        """
        target = Path(os.path.realpath(path))
        try:
            if target.exists():
                kind = _kind(target)
                if kind != "file":
                    raise InputError(f"{path}: is a {kind}, expected a file name to write to")
                if any(file.exists() and file.samefile(target) for file in self._inputs):
                    raise InputError(f"{path}: is an input of this command, expected another name")
            elif not target.parent.is_dir():
                raise InputError(f"{path}: the folder {Path(path).parent} does not exist")
            for needed in (target, target.parent):
                if needed.exists() and not os.access(needed, os.W_OK):
                    raise InputError(f"{path}: cannot be written (Permission denied)")
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from error
        return target

    @contextmanager
    def together(self) -> Iterator[Outputs]:
        """Let files written inside the block wait for its end; if it fails, none is written.

        Raises
        ------
        InputError
            If one of them is an input.
        HotleverError
            If one cannot be written.
        """
        before = _outputs.set(self)
        try:
            yield self
            for target in self._written:
                self.target(target)
            for target, temporary in self._written.items():
                _put_in_place(temporary, target)
        finally:
            _outputs.reset(before)
            for temporary in self._written.values():
                temporary.unlink(missing_ok=True)
            # the innermost first; one that is not empty stays
            for folder in self._new_folders:
                with suppress(OSError):
                    folder.rmdir()
            self._written, self._new_folders = {}, []


#: The outputs of the `together` block that is running.
_outputs: ContextVar[Outputs | None] = ContextVar("outputs", default=None)


@contextmanager
def whole_file(path: Name) -> Iterator[Path]:
    """Give a temporary path that replaces `path` if the block succeeds.

    It lies beside the file that it replaces and has the same suffix, since writers choose a format
    by it. A failure inside the block leaves an existing file as it was.

    Raises
    ------
    InputError
        If it cannot be a file, or its folder does not exist or cannot be written.
    HotleverError
        If writing fails: the disk is full, for one.
    """
    running = _outputs.get()
    with nullcontext(running) if running else Outputs().together() as outputs:
        target = outputs.target(path)
        temporary = target.with_name(f".hotlever-{secrets.token_hex(6)}{target.suffix}")
        try:
            # with the permissions that any new file would have here
            os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from error
        try:
            yield temporary
            # what the same block wrote there before is replaced
            temporary.replace(outputs._written.setdefault(target, temporary))
        except BaseException as error:
            reason = _disk_error(error, temporary)
            temporary.unlink(missing_ok=True)
            if reason is not None:
                raise HotleverError(f"{path}: cannot be written ({reason})") from error
            raise


def _disk_error(error: BaseException, temporary: Path) -> str | None:
    """Return why a file cannot be written, if that is what a writer failed for."""
    try:
        if isinstance(error, OSError):
            raise error
        if isinstance(error, Exception):
            # NetCDF and PDF say a full disk in words of their own
            with temporary.open("ab") as file:
                file.write(bytes(100_000))
    except OSError as disk_error:
        return disk_error.strerror or str(disk_error)
    return None


def write_text(path: Name, text: str) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all."""
    with whole_file(path) as temporary:
        # file names need not be text; in JSON the escape stands for the same name
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def output_folder(path: Name) -> Path:
    """Make the folder `path` (and its parents) if needed and return it.

    Inside a `together` block it goes again at the end if nothing was put into it.

    Raises
    ------
    InputError
        If it cannot be made, or a file of that name exists.
    """
    folder, outputs = Path(path), _outputs.get()
    try:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror})") from error
    if outputs is not None:
        outputs._new_folders[:0] = missing
    return folder


def _put_in_place(temporary: Path, target: Path) -> None:
    """Rename a file; it gets the permissions of the one it replaces."""
    try:
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o7777)
        temporary.replace(target)
    except OSError as error:
        raise HotleverError(f"{target}: cannot be written ({error.strerror})") from error


def _kind(path: Name | int) -> str:
    mode = os.stat(path).st_mode
    kinds = {"-": "file", "d": "folder", "p": "pipe", "s": "socket"}
    return kinds.get(stat.filemode(mode)[0], "device")
