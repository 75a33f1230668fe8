"""The folder of a project: the files that the app and the command line both read and write."""

from __future__ import annotations

import json
import re
import unicodedata
from pathlib import Path

from hotlever.errors import InputError
from hotlever.files import TABLE, output_folder, whole_file, write_text

#: Bytes that a dropped file may have.
LARGEST_FILE = 64 * 2**20

DATA = (".csv", ".txt", ".tsv", ".dat", ".lvm", ".tdms", ".ibw", ".asc")
DRAWINGS = (".gds", ".gds2", ".gdsii", ".oas", ".oasis", ".dxf")
#: What a fit is called that the app writes, and corrections of spectra; see also `files`.
FIT, CORRECTIONS = ".fit.json", ".corrections.csv"
EXAMPLES = Path(__file__).parents[1] / "examples"


def safe_name(name: str) -> str:
    """Return the name under which a dropped file is kept: of one folder, printable, no option.

    Examples
    --------
    >>> safe_name("../../etc/passwd"), safe_name("-o <b>.csv"), safe_name("")
    ('passwd', 'o _b_.csv', 'file')
    """
    last = re.split(r"[/\\]", unicodedata.normalize("NFC", name))[-1]
    file_name = "".join(mark if mark.isalnum() or mark in " ._-+()=,µΩ°" else "_" for mark in last)
    file_name = file_name.lstrip(" .-").rstrip(" .")
    stem, dot, suffix = file_name.rpartition(".")
    most = 100
    if len(file_name) > most:
        file_name = f"{stem[: most - len(suffix) - 1]}{dot}{suffix}"[:most]
    return file_name or "file"


def file_stamp(path: Path) -> float:
    """Return when a file was written, which tells whether it is as it was.

    Raises
    ------
    InputError
        If it does not exist.
    """
    stamp = _time_of(path)
    if not stamp:
        raise InputError(f"{path.name}: no such file")
    return stamp


def _time_of(path: Path) -> float:
    """Return when a file was written; 0 if it does not exist."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


class Project:
    """A folder with probes, drawings, measurements, fits, calibrations and spectra.

    Parameters
    ----------
    folder : path
        Made if it does not exist.

    Raises
    ------
    InputError
        If it is a file, or cannot be made.
    """

    def __init__(self, folder: str | Path) -> None:
        if Path(folder).is_file():
            raise InputError(f"{folder}: is a file, expected a folder")
        self.folder = output_folder(folder).resolve()

    def path(self, name: str) -> Path:
        """Return the path of a file of the project.

        Raises
        ------
        InputError
            If it leads out of the folder.
        """
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder):
            raise InputError(f"{name}: is not in the folder of the project")
        return path

    # --- what is there ----------------------------------------------------------------------------

    def names(self, *suffixes: str) -> list[str]:
        """Return the files with one of some endings, the latest first."""
        files = [
            (-_time_of(path), path.name)
            for path in self.folder.glob("[!.]*")
            if path.name.lower().endswith(suffixes) and path.is_file()
        ]
        return [name for _, name in sorted(files)[:500]]

    @property
    def probes(self) -> list[str]:
        """Probe files."""
        return self.names(".toml")

    @property
    def drawings(self) -> list[str]:
        """Drawings of levers."""
        return self.names(*DRAWINGS)

    @property
    def data(self) -> list[str]:
        """Files that may be measurements."""
        # tables that commands write are no measurements
        written = (
            *(TABLE, CORRECTIONS, ".raman.csv", ".sweep.csv", ".pulse.csv", ".spectrum.csv"),
            *(".design.csv", ".contact.csv", ".reader.csv", ".next.csv"),
        )
        return [name for name in self.names(*DATA) if not name.endswith(written)]

    @property
    def fits(self) -> list[str]:
        """Fit files, those of many levers too."""
        return self._with_keys({"correlation"}, "fits")

    @property
    def calibrations(self) -> list[str]:
        """Calibration files, those of many levers too."""
        return self._with_keys({"route"}, "calibrations")

    @property
    def laws(self) -> list[str]:
        """Files that hold a power law."""
        return self._with_keys({"power_law", "linear_K_per_mW"})

    @property
    def raman_calibrations(self) -> list[str]:
        """Calibrations of a Raman thermometer."""
        return self._with_keys({"anharmonic"})

    def _with_keys(self, keys: set[str], folder: str = "") -> list[str]:
        """Return the JSON files with one of some keys, and all in folders of a name."""
        alone = [name for name in self.names(".json") if keys & self._keys(name)]
        among = sorted(self.folder.glob(f"{folder}*/*.json")) if folder else []
        return [*alone, *(path.relative_to(self.folder).as_posix() for path in among[:500])]

    def _keys(self, name: str) -> set[str]:
        """Return the keys of a JSON file; none of one that is too large or damaged."""
        path = self.folder / name
        try:
            # what is larger is no result of ours
            if path.stat().st_size > 2**22:
                return set()
            content = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return set()
        return set(content) if isinstance(content, dict) else set()

    def spectra(self, folder: str) -> list[str]:
        """Return the spectra in a folder of the project, which may not exist yet."""
        return sorted(path.name for path in self.path(folder).glob("*") if path.is_file())

    def stamp(self, name: str) -> float:
        """Return when a file was written; 0 if it does not exist."""
        return _time_of(self.path(name))

    # --- what is written --------------------------------------------------------------------------

    def free(self, stem: str, *endings: str) -> str:
        """Return a stem with which no file ends so yet: it, or it with a number behind."""
        number, free = 1, stem
        while any(self.path(f"{free}{ending}").exists() for ending in endings):
            number += 1
            free = f"{stem}-{number}"
        return free

    def write(self, name: str, text: str) -> None:
        """Write a new text file.

        Raises
        ------
        InputError
            If there is one of this name, it is not in the folder, or cannot be written.
        """
        path = self.path(name)
        if path.exists():
            own = Path(name)
            other = f"{self.free(own.stem, own.suffix)}{own.suffix}"
            raise InputError(f"{name}: is there already, expected a new name such as {other}")
        write_text(path, text)

    def take(self, name: str, content: bytes, folder: str = "") -> str:
        """Keep a dropped file, beside others of the same name; return its name in the project.

        Raises
        ------
        InputError
            If it is larger than `LARGEST_FILE`, or cannot be written.
        """
        file_name = safe_name(name)
        if len(content) > LARGEST_FILE:
            raise InputError(f"{file_name}: larger than the {LARGEST_FILE // 2**20} MB of a file")
        target = output_folder(self.path(folder))
        stem, suffix = Path(file_name).stem, Path(file_name).suffix
        number = 1
        while (path := target / file_name).exists():
            if path.is_file() and path.read_bytes() == content:
                break
            number += 1
            file_name = f"{stem}-{number}{suffix}"
        else:
            with whole_file(path) as temporary:
                temporary.write_bytes(content)
        return f"{folder}/{file_name}" if folder else file_name

    def take_example(self, name: str) -> str:
        """Copy a file that comes with hotlever into the project; return its name."""
        return self.take(Path(name).name, (EXAMPLES / name).read_bytes())

    def take_example_folders(self, name: str, *folders: str) -> None:
        """Copy folders that come with hotlever.

        Raises
        ------
        InputError
            If one of them is there and holds something else: examples among the user's own files
            would be measured with them.
        """
        source = EXAMPLES / name
        for folder in folders:
            for own in self.spectra(folder):
                example, there = source / folder / own, self.path(f"{folder}/{own}")
                if not example.is_file() or example.read_bytes() != there.read_bytes():
                    raise InputError(
                        f"{folder}/{own}: is no file of the example, which needs the folder "
                        f"{folder} for itself; try it in another project"
                    )
        for folder in folders:
            for path in sorted((source / folder).iterdir()):
                self.take(path.name, path.read_bytes(), folder)
