"""The options of a wave form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hotlever.errors import InputError

if TYPE_CHECKING:
    from hotlever.lever.transient import Waveform


@dataclass
class Drive:
    """At most one wave form: as a text of some kind, or a table."""

    step: Annotated[str | None, Option(metavar="V", help="Switch the bias on, and leave it.")] = (
        None
    )
    pulse: Annotated[str | None, Option(metavar="V,TIME", help="A pulse, such as 10V,5us.")] = None
    period: Annotated[str | None, Option(metavar="TIME", help="Of pulses that are repeated.")] = (
        None
    )
    count: Annotated[int | None, Option(metavar="N", help="Number of pulses.")] = None
    ramp: Annotated[
        str | None, Option(metavar="V,TIME", help="Raise the bias, such as 8V,50us.")
    ] = None
    sine: Annotated[str | None, Option(metavar="V+V@FREQ", help="Such as 3V+0.5V@20kHz.")] = None
    waveform: Annotated[
        Path | None, Option(help="A table of times and biases, such as a supply takes.")
    ] = None

    @property
    def options(self) -> dict[str, Any]:
        """Those that are given, by name."""
        return {f"--{name}": value for name, value in vars(self).items() if value is not None}

    def read(self) -> Waveform | None:
        """Return the one wave form that is asked for; None if none is.

        Raises
        ------
        InputError
            If several are, or it is none.
        """
        from hotlever.lever.transient import read_waveform
        from hotlever.lever.transient.waveform_texts import KINDS, waveform_from_text

        texts = {kind: getattr(self, kind) for kind in KINDS if getattr(self, kind) is not None}
        names = [f"--{name}" for name in (*texts, *["waveform"] * (self.waveform is not None))]
        if len(names) > 1:
            raise InputError(f"found {', '.join(names)}: expected one of {_listed(KINDS)}")
        for name in ("--period", "--count"):
            if name in self.options and "pulse" not in texts:
                raise InputError(f"{name}: goes with --pulse")
        if self.waveform is not None:
            return read_waveform(self.waveform)
        for kind, text in texts.items():
            return waveform_from_text(kind, text, self.period, self.count, mark="--")
        return None

    def need(self) -> Waveform:
        """Return the wave form as `read` does, or raise that there is none."""
        from hotlever.lever.transient.waveform_texts import KINDS

        waveform = self.read()
        if waveform is None:
            raise InputError(f"found none: expected one of {_listed(KINDS)}")
        return waveform


def _listed(kinds: tuple[str, ...]) -> str:
    return ", ".join(f"--{kind}" for kind in (*kinds, "waveform"))
