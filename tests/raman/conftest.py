"""Silicon spectra: the shared ones, and those made for the tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import synthetic_spectra as synthetic

REPO = Path(__file__).parents[2]


@pytest.fixture
def real_spectra(shared: Callable[..., list[Path]]) -> list[Path]:
    return shared(
        "data/raman",
        "FMNT-M_BW532__Sil10_iR532_Probe_100_60000msx2.txt",
        "FMNT-M_Ho785__Sil10_iR785_OP01_6000msx4.txt",
        "labram_spectrum_wn.txt",
    )


@pytest.fixture
def hot_plate_files(shared: Callable[..., list[Path]]) -> list[Path]:
    names = (f"si100_{number:02d}.txt" for number in range(25))
    return shared("data/virtual-lab/raman-hot-plate", *names)


@pytest.fixture
def tip_files(shared: Callable[..., list[Path]]) -> list[Path]:
    names = (f"tip_{number:02d}.txt" for number in range(12))
    return shared("data/virtual-lab/raman-tip", *names)


@pytest.fixture
def examples() -> Path:
    return REPO / "src" / "hotlever" / "examples" / "raman"


@pytest.fixture(scope="session")
def silicon() -> tuple[np.ndarray, np.ndarray]:
    """One spectrum at 300 K, rounded as files hold it."""
    x, y = synthetic.spectrum(300.0, np.random.default_rng(5), synthetic.Instrument(spike_rate=0))
    return np.round(x, 3), np.round(y, 1)


def write_spectrum(path: Path, x: np.ndarray, y: np.ndarray, header: str = "") -> Path:
    rows = "".join(f"{a:.3f}\t{b:.1f}\n" for a, b in zip(x, y, strict=True))
    path.write_text(header + rows, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def hot_plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A made-up hot-plate series, 295 to 895 K, temperatures in the file names."""
    folder = tmp_path_factory.mktemp("hot-plate")
    rng = np.random.default_rng(11)
    for temperature in range(295, 900, 25):
        x, y = synthetic.spectrum(temperature, rng)
        write_spectrum(folder / f"si_{temperature}K.txt", x, y)
    return folder
