"""From a source meter to a measured curve: instruments, who watches over them, and the ramp.

`source_meter` speaks SCPI to a source meter and a voltmeter through VISA; a `supervisor`, a process
of its own, owns them and turns the output off however a measurement ends; `ramp` chooses the
biases, so that the tip stays below a limit; `twin` is an instrument with a solved lever behind it.
"""
