"""The command line of hotlever: one module for each command, and `main`, which runs them."""

from hotlever.cli.running import main

__all__ = ["main"]
