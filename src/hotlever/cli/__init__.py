"""The command line of hotlever; importing a command's module registers it."""

from hotlever.cli import raman
from hotlever.cli.app import app, main

__all__ = ["app", "main", "raman"]
