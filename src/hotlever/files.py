"""Files in and out: read with limits, each written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import secrets
import select
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hotlever.errors import HotleverError, InputError, quoted

Name = str | os.PathLike[str]

#: What a figure can be written as, and a film.
FIGURE_TYPES, FILM_TYPES = (".png", ".svg", ".pdf"), (".gif",)
#: How the name of what is written ends if that is a folder.
FOLDER: tuple[str, ...] = ()
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


def check_outputs(
    outputs: Iterable[tuple[Name | None, tuple[str, ...]]], inputs: Iterable[Name] = ()
) -> None:
    """Check before some work that its outputs can be written.

    Parameters
    ----------
    outputs : iterable of (path or None, tuple of str)
        What is written, and how the name of a file may end; of a `FOLDER` nothing.
    inputs : iterable of path
        Files that the work reads, none of which it may write.

    Raises
    ------
    InputError
        If a file is of another type, no regular file, an input or another output too, or its
        folder does not exist or cannot be written; if a folder is a file or cannot be made.
    """
    inputs, targets = list(inputs), set[Path]()
    for path, types in outputs:
        if path is None:
            continue
        if types == FOLDER:
            target = _output_folder(path)
        else:
            target, suffix = output_file(path, inputs), Path(path).suffix
            if suffix.lower() not in types:
                raise InputError(
                    f"{path}: unknown file type '{suffix}', expected {' or '.join(types)}"
                )
        if target in targets:
            raise InputError(f"{path}: two outputs of this name, expected different ones")
        targets.add(target)


def _output_folder(path: Name) -> Path:
    folder = Path(os.path.realpath(path))
    above = next(path for path in (folder, *folder.parents) if os.path.lexists(path))
    if not above.is_dir():
        raise InputError(f"{path}: cannot be made a folder ({above} is a file)")
    if not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot be written (Permission denied)")
    return folder


def output_file(path: Name, inputs: Iterable[Name] = ()) -> Path:
    """Return the file that writing to `path` makes or replaces: links lead to it.

    Raises
    ------
    InputError
        If it is no regular file, or one of some inputs, or its folder does not exist or cannot be
        written.
    """
    target = Path(os.path.realpath(path))
    try:
        if target.exists():
            kind = _kind(target)
            if kind != "file":
                raise InputError(f"{path}: is a {kind}, expected a file name to write to")
            if any(os.path.exists(file) and target.samefile(file) for file in inputs):
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
def whole_file(path: Name) -> Iterator[Path]:
    """Give a temporary path that replaces `path` if the block succeeds.

    It lies beside the file that it replaces and has the same suffix, since writers choose a format
    by it. A failure inside the block leaves an existing file as it was.

    Raises
    ------
    InputError
        As `output_file`.
    HotleverError
        If writing fails: the disk is full, for one.
    """
    target = output_file(path)
    temporary = target.with_name(f".hotlever-{secrets.token_hex(6)}{target.suffix}")
    try:
        # with the permissions that any new file would have here
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    try:
        yield temporary
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o7777)
        temporary.replace(target)
    except BaseException as error:
        reason = _disk_error(error, temporary)
        if reason is not None:
            raise HotleverError(f"{path}: cannot be written ({reason})") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


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

    Raises
    ------
    InputError
        If it cannot be made, or a file of that name exists.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made a folder ({error.strerror})") from error
    return folder


def _kind(path: Name | int) -> str:
    mode = os.stat(path).st_mode
    kinds = {"-": "file", "d": "folder", "p": "pipe", "s": "socket"}
    return kinds.get(stat.filemode(mode)[0], "device")
