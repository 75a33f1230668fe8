"""All commands: importing a command's module registers it on the application."""

from hotlever.cli import (
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
