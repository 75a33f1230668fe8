"""All commands: importing a command's module registers it on the application."""

from hotlever.cli import (
    browser,
    cache,
    calibrate,
    design,
    fit,
    materials,
    probe,
    pulse,
    raman,
    reproduce,
    spectrum,
    sweep,
)
from hotlever.cli.application import app

__all__ = [
    "app",
    "browser",
    "cache",
    "calibrate",
    "design",
    "fit",
    "materials",
    "probe",
    "pulse",
    "raman",
    "reproduce",
    "spectrum",
    "sweep",
]
