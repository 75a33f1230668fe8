"""The command line of hotlever; importing a command's module registers it."""

from hotlever.cli import calibrate, design, fit, probe, raman, reproduce, sweep
from hotlever.cli.app import app, main

__all__ = ["app", "calibrate", "design", "fit", "main", "probe", "raman", "reproduce", "sweep"]
