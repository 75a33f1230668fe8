"""A reduced basis for the lever: its space, its training, its response surface, its error."""
