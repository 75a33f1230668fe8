"""The command line of hotlever; importing a command's module registers it."""

from hotlever.cli.app import app, main

__all__ = ["app", "main"]

from hotlever.cli import raman  # noqa: E402, F401
