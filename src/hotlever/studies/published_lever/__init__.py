"""The lever of the paper, which nobody has drawn: all layouts that what is printed of it leaves."""
