"""The command line of hotlever: the commands of `hotlever.tasks`, and `main`, which runs them."""

from hotlever.cli.running import main

__all__ = ["main"]
