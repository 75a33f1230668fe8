"""What users have done, on the command line and in the app: read files, compute, write files.

A command is a function that takes what is asked for, tells a `hotlever.tasks.arguments.Reporter`
what there is to know while it works, and writes its files, each whole or not at all.
"""
