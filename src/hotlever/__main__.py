"""``python -m hotlever``: the command line, where its script is not on the path."""

from hotlever.cli import main

if __name__ == "__main__":
    main()
