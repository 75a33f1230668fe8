"""Renishaw's ``.wdf`` files: blocks, each of a name, a number, a size, and its content.

The layout is that of Renishaw's own reader (renishaw-wdf, Apache-2.0), which trusts the sizes that
a file states, and searches a damaged file without end. Here a size is compared with the file
before anything is read by it.
"""

from __future__ import annotations

import struct

import numpy as np

from hotlever.raman.part import Part, positions
from hotlever.raman.stated import sample_temperature
from hotlever.types import Array
from hotlever.units import LARGEST_NUMBER, ZERO_CELSIUS_K

SIGNATURE = b"WDF1"

#: Block: name, number, size in bytes with these three.
_BLOCK = struct.Struct("<4s4xQ")
#: The first block: flags, samples of a spectrum, spectra that there is room for and that were
#: measured, samples of the axis, and the laser (cm⁻¹).
_HEADER = struct.Struct("<16xQ36xIQQ8xI64xf352x")
_SEVERAL_AXES = 0b1001  # flags: several axes, or tracks with one each

#: A quantity of each spectrum: kind, unit and label, before its values.
_ORIGIN = struct.Struct("<II16s")
_PRIMARY = 0x8000_0000  # marks the kinds by which a map or a series runs
_NAMES = {3: "X", 4: "Y", 5: "Z", 9: "T", 11: "t"}
_TO_KELVIN = {10: 0.0, 21: ZERO_CELSIUS_K}  # by unit
_MOST_BLOCKS, _MOST_ORIGINS = 10_000, 100
_FILE_TIME = 24  # a unit whose values are no floating-point numbers

_NANOMETRE = 3
_AXIS_UNITS = (0, 1, 2, _NANOMETRE)  # none stated, Raman shift, wavenumber


def read_wdf(raw: bytes) -> list[Part]:
    """Read every spectrum of a file, with its place in a map and its temperature where stated.

    Raises
    ------
    ValueError
        If the file is cut short, its sizes contradict each other, its values are no numbers, or
        its axis is no Raman shift.
    """
    blocks = _blocks(raw)
    if len(raw) < _HEADER.size:
        raise ValueError(f"{len(raw)} bytes, less than its header")
    flags, samples, room, measured, axis_samples, laser = _HEADER.unpack_from(raw)
    if not (0 < measured <= room and samples):
        raise ValueError(f"{measured} of {room} spectra of {samples} samples")
    if axis_samples != samples or flags & _SEVERAL_AXES:
        raise ValueError(
            f"{axis_samples} Raman shifts and {samples} intensities, expected one axis for all"
        )
    data, axis = blocks.get(b"DATA", b""), blocks.get(b"XLST", b"")
    if len(data) < 4 * samples * room or len(axis) < 8 + 4 * samples:
        raise ValueError(f"no room for {room} spectra of {samples} samples and their axis")
    x = _floats(axis[8:], samples)
    (unit,) = struct.unpack_from("<4xI", axis)
    if unit not in _AXIS_UNITS:
        raise ValueError(f"an axis in unit {unit}, expected a Raman shift in cm⁻¹")
    if unit == _NANOMETRE:
        with np.errstate(divide="ignore"):
            x = laser - 1e7 / x
    y = _floats(data, samples * measured).reshape(measured, samples)
    places, temperatures = _origins(blocks.get(b"ORGN", b""), room, measured)
    labels = positions(places, measured)
    return [Part(x, y[i], labels[i], temperatures[i]) for i in range(measured)]


def _blocks(raw: bytes) -> dict[bytes, bytes]:
    """Content by name, of the first block of each; ValueError if blocks do not fill the file."""
    blocks: dict[bytes, bytes] = {}
    place = count = 0
    while place < len(raw):
        count += 1
        name, size = b"", 0
        if place + _BLOCK.size <= len(raw):
            name, size = _BLOCK.unpack_from(raw, place)
        if count > _MOST_BLOCKS or not _BLOCK.size <= size <= len(raw) - place:
            raise ValueError(
                f"cut short or damaged: its blocks do not follow each other at byte {place} of "
                f"{len(raw)}"
            )
        blocks.setdefault(name, raw[place + _BLOCK.size : place + size])
        place += size
    return blocks


def _floats(content: bytes, count: int) -> Array:
    values = np.frombuffer(content, "<f4", count).astype(float)
    if not (np.abs(values) <= LARGEST_NUMBER).all():
        raise ValueError("values that are no numbers")
    return values


def _origins(
    content: bytes, room: int, measured: int
) -> tuple[dict[str, Array], list[float | None]]:
    """Where and at which temperature (K) spectra were measured, as far as the file says."""
    places: dict[str, Array] = {}
    temperatures: list[float | None] = [None] * measured
    size = _ORIGIN.size + 8 * room
    for at in range(4, len(content) - size + 1, size)[:_MOST_ORIGINS]:
        kind, unit, _ = _ORIGIN.unpack_from(content, at)
        name = _NAMES.get(kind & ~_PRIMARY)
        values = np.frombuffer(content, "<f8", measured, at + _ORIGIN.size)
        if name is None or unit == _FILE_TIME or not (np.abs(values) <= LARGEST_NUMBER).all():
            continue
        if name == "T" and unit in _TO_KELVIN:
            values = values + _TO_KELVIN[unit]
            temperatures = [sample_temperature(kelvin) for kelvin in values.tolist()]
        if name == "T" or kind & _PRIMARY:
            places[name] = values
    return places, temperatures
