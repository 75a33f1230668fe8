"""Studies: what the paper claims and what was found, computed; each returns a dataset."""
