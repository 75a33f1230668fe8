"""``python -m hotlever``: the command line, where its script is not on the path."""

from hotlever.cli import main

main()
