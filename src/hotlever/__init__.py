"""Joule-heated silicon cantilever probes: how hot is the tip, and how sure are we?"""

from importlib.metadata import version

__version__ = version("hotlever")
