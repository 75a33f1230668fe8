"""A tip that touches a sample: the cone, the interface, spreading in layers, and air beside it."""
