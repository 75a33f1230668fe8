"""What users have done, on the command line and in the app: read files, compute, write files.

A task takes what was asked for, tells a `hotlever.tasks.reporter.Reporter` what there is to know
while it works, and writes its files all or none.
"""
