"""The command line of hotlever; importing a command's module registers it."""

from hotlever.cli import fit, probe, reproduce, sweep
from hotlever.cli.app import app, main

__all__ = ["app", "fit", "main", "probe", "reproduce", "sweep"]
