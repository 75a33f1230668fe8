"""The command line of hotlever; importing a command's module registers it."""

from hotlever.cli import fit, probe, raman, reproduce, sweep
from hotlever.cli.app import app, main

__all__ = ["app", "fit", "main", "probe", "raman", "reproduce", "sweep"]
