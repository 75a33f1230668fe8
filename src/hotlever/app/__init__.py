"""The same in the browser: ``hotlever app`` serves a page to one user on their own machine.

Nothing is computed here. Commands run in processes of their own, exactly as the command line runs
them; what a slider moves is read from a lever in another process (`live`). `project` is the folder
that both share with the command line, and the record of all that was done: what a page writes is a
new file in it. `pages` is what is shown.
"""
