"""Levers in time."""
