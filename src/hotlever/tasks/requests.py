"""What is asked of tasks: dataclasses whose fields are options of commands; here on levers.

The command line fills one from what is typed, the app from what is chosen on a page. With each
field stands what the command line says of it, and of one that names a file whether that is written;
the docstring of a request is the help of its command (`hotlever.tasks.commands`). Requests that
share options inherit them.
"""

from __future__ import annotations

from dataclasses import MISSING, Field, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, get_args

from hotlever.errors import InputError, excerpt
from hotlever.files import FIGURE_TYPES, FILM_TYPES, FOLDER, check_outputs
from hotlever.tasks.shared import read_probe
from hotlever.units import setting

if TYPE_CHECKING:
    from hotlever.lever.transient import Waveform
    from hotlever.probe import Probe
    from hotlever.tasks.reporter import Reporter
    from hotlever.types import Array

#: Times that may be asked for.
MOST_TIMES = 10_000

#: Wave forms that a text tells, as options.
_TOLD_BY_TEXT = ("step", "pulse", "ramp", "sine")

File = Path | None


def option(default: Any, *names: str, **texts: Any) -> Any:
    """Return a field of a request that is an option, by its own name unless others are given."""
    return field(default=default, metadata={"names": names, "texts": texts})


def argument(default: Any, **texts: Any) -> Any:
    """Return a field of a request that stands on the command line without a name."""
    return field(default=default, metadata={"texts": texts})


def written(types: tuple[str, ...], *names: str, default: Any = None, **texts: Any) -> Any:
    """Return a field of a request that is an option, and names a file of some types, or a folder.

    It is what the task writes.
    """
    return field(default=default, metadata={"names": names, "texts": texts, "writes": types})


@dataclass(kw_only=True)
class Request:
    """What is asked of a task that writes files."""

    def non_default_options(self, *names: str) -> list[str]:
        """Return the options, of fields of some names, that say other than if left out."""
        options, by_name = [], {own.name: own for own in fields(self)}
        for name in names:
            own = by_name[name]
            if getattr(self, name) != own.default:
                usual = f"--{'no-' * (own.default is True)}{name.replace('_', '-')}"
                stated = [word for word in own.metadata["names"] if word.startswith("--")]
                options.append((*stated, usual)[0])
        return options

    def refuse(self, *names: str, why: str) -> None:
        """Refuse options of which any would do nothing, or contradict."""
        for option in self.non_default_options(*names):
            raise InputError(f"{option}: {why}")

    def at_most_one(self, *names: str) -> None:
        """Refuse several of some options."""
        if len(options := self.non_default_options(*names)) > 1:
            raise InputError(f"{' and '.join(options)}: expected only one of them")

    def inputs(self) -> list[Path]:
        """Return the files that are read: all that fields name and that are not written."""
        values = [getattr(self, own.name) for own in fields(self) if "writes" not in own.metadata]
        several = (value if isinstance(value, list) else [value] for value in values)
        return [path for paths in several for path in paths if isinstance(path, Path)]

    def types_of(self, own: Field[Any]) -> tuple[str, ...]:
        """Return how the name of a file that is written may end; see `written`."""
        types: tuple[str, ...] = own.metadata["writes"]
        return types

    def check_outputs(self) -> None:
        """Check the files and folders that are written, none of which is read."""
        written = (own for own in fields(self) if "writes" in own.metadata)
        check_outputs(
            ((getattr(self, own.name), self.types_of(own)) for own in written), self.inputs()
        )


@dataclass(kw_only=True)
class PlotRequest(Request):
    """A figure that is drawn."""

    plot: File = written(FIGURE_TYPES, help="Draw to this file: .png, .svg or .pdf.")


@dataclass(kw_only=True)
class ProbeRequest(Request):
    """A probe as it stands in its file."""

    probe: File = argument(
        None, metavar="[PROBE.toml]", help="Probe file; the reference probe if left out."
    )


@dataclass(kw_only=True)
class PhysicsRequest(Request):
    """Physics beyond the paper."""

    physics: str | None = option(
        None,
        metavar="EFFECT,...",
        help="thermoelectric, radiation or both: effects that count beyond the paper's, or none; "
        "what the probe file says if left out.",
    )

    def with_physics(self, probe: Probe) -> Probe:
        """Return a probe with the effects that are asked for."""
        if self.physics is None:
            return probe
        names = [name.strip() for name in self.physics.split(",")]
        return probe.with_physics(() if names == ["none"] else names, "--physics")


@dataclass(kw_only=True)
class LeverRequest(PhysicsRequest, ProbeRequest):
    """A lever to solve: its probe, with some values changed, the medium and the effects."""

    #: Whether the task takes air where nothing is said.
    finds_air: ClassVar = False

    medium: str | None = option(None, help="vacuum or air; what the files say if left out.")
    set: list[str] | None = option(
        None, "--set", metavar="NAME=VALUE", help="Change a value of the probe file."
    )

    def read_probe(self, reporter: Reporter) -> Probe:
        """Read the probe; what should be known of its shape is told."""
        check_medium(self.medium)
        probe = read_probe(reporter, self.probe, self.set)
        probe = self.with_physics(probe)
        probe = probe if self.medium is None else probe.in_medium(self.medium)
        if probe.surroundings.medium == "vacuum" and not self.finds_air:
            refuse_air(self.set, probe)
        return probe


@dataclass(kw_only=True)
class TableRequest(PlotRequest):
    """The files of a computed table, and of its figure."""

    output: File = written(
        (".csv", ".nc"), "-o", "--output", help="FILE.csv or FILE.nc; standard output if left out."
    )


@dataclass(kw_only=True)
class SweepRequest(TableRequest, LeverRequest):
    """Solve a lever over a range of bias."""

    bias: str | None = option(
        None,
        metavar="START:STOP:COUNT",
        help="In volts, ends included, or a single one; 1:11:25 if left out.",
    )
    and_back: bool = option(
        False,
        "--and-back",
        help="Let the bias go back as well: a lever that jumps does so elsewhere.",
    )
    hold_resistance: str | None = option(
        None,
        metavar="OHM",
        help="The states that a controller of V_l/I_h holds, in place of a bias: such as 3kohm, "
        "2.5kohm,3kohm or 2.5kohm:3.3kohm:9.",
    )
    hold_power: str | None = option(
        None, metavar="WATT", help="The same of V_l I_h, such as 2.5mW or 1mW:4mW:7."
    )
    model: str = option(
        "flat",
        help="flat: the lever in its plane; full-3d: its true thickness and the air around it "
        "(minutes; goes on where it was stopped).",
    )
    map: File = written(
        FIGURE_TYPES,
        help="Draw the temperature at the highest tip temperature to this file, as --plot.",
    )
    fields: File = written(FOLDER, help="Write the fields of each state as VTU to this folder.")

    @property
    def set_points(self) -> tuple[str, str, Array] | None:
        """What is held, by which option, and the set points (Ω, mW); None of a range of bias."""
        from hotlever.tasks.texts import parse_set_points

        self.at_most_one("bias", "hold_resistance", "hold_power")
        if self.hold_resistance is not None:
            what, text, unit = "resistance", self.hold_resistance, "ohm"
        elif self.hold_power is not None:
            what, text, unit = "power", self.hold_power, "mW"
        else:
            return None
        option = f"--hold-{what}"
        self.refuse("and_back", why=f"does not go with {option}")
        if self.model != "flat":
            raise InputError(f"{option}: goes with --model flat, found {excerpt(self.model)}")
        return what, option, parse_set_points(text, unit, option)


@dataclass(kw_only=True)
class DriveRequest(Request):
    """At most one wave form: as a text of some kind, or a table."""

    step: str | None = option(None, metavar="V", help="Switch the bias on, and leave it.")
    pulse: str | None = option(None, metavar="V,TIME", help="A pulse, such as 10V,5us.")
    period: str | None = option(None, metavar="TIME", help="Of pulses that are repeated.")
    count: int | None = option(None, metavar="N", help="Number of pulses.")
    ramp: str | None = option(None, metavar="V,TIME", help="Raise the bias, such as 8V,50us.")
    sine: str | None = option(None, metavar="V+V@FREQ", help="Such as 3V+0.5V@20kHz.")
    waveform: File = option(None, help="A table of times and biases, such as a supply takes.")

    def required_waveform(self) -> Waveform:
        """Return the wave form as `read_waveform` does, or raise that there is none."""
        waveform = self.read_waveform()
        if waveform is None:
            kinds = ", ".join(f"--{kind}" for kind in (*_TOLD_BY_TEXT, "waveform"))
            raise InputError(f"found none: expected one of {kinds}")
        return waveform

    def read_waveform(self) -> Waveform | None:
        """Return the one wave form that is asked for; None if none is."""
        from hotlever.lever.transient import read_waveform
        from hotlever.lever.transient.waveform import waveform_from_text

        self.at_most_one(*_TOLD_BY_TEXT, "waveform")
        if self.pulse is None:
            self.refuse("period", "count", why="goes with --pulse")
        if self.waveform is not None:
            return read_waveform(self.waveform)
        for kind in _TOLD_BY_TEXT:
            if (text := getattr(self, kind)) is not None:
                return waveform_from_text(kind, text, self.period, self.count, mark="--")
        return None


@dataclass(kw_only=True)
class TimesRequest(DriveRequest):
    """A wave form, and the times that matter."""

    until: str | None = option(None, metavar="TIME", help="When to stop.")
    at: str | None = option(
        None, metavar="TIME,...", help="Times to report; where the solver stepped if left out."
    )

    @property
    def end_us(self) -> float | None:
        """When to stop (µs), if that is asked."""
        return None if self.until is None else setting(self.until, "us", "--until")

    @property
    def times_us(self) -> list[float] | None:
        """Times to report (µs), if these are asked."""
        if self.at is None:
            return None
        times = [setting(time, "us", "--at") for time in self.at.split(",")]
        if len(times) > MOST_TIMES:
            raise InputError(f"--at: found {len(times)} times, expected at most {MOST_TIMES}")
        return times


@dataclass(kw_only=True)
class PulseRequest(TableRequest, LeverRequest, TimesRequest):
    """Follow a lever in time: steps, pulses, ramps, sines, or what a file says."""

    fields: File = written(FOLDER, help="Write the fields as a series of VTU to this folder.")
    film: File = written(
        FILM_TYPES,
        help="Animate temperature and tip to this file: .gif; a frame for each of --at, or 120.",
    )
    report: File = written(
        FOLDER, help="Folder for a page of the lever in time; goes without a wave form."
    )

    def need_no_waveform(self) -> None:
        """Refuse what does not go with a page, which has wave forms of its own."""
        goes = {"report", *(own.name for own in fields(LeverRequest))}
        others = [own.name for own in fields(self) if own.name not in goes]
        why = "does not go with --report, which has wave forms of its own"
        self.refuse(*others, why=why)


@dataclass(kw_only=True)
class ContactRequest(TableRequest, LeverRequest, TimesRequest):
    """Touch a sample with the tip: apex, heat into the sample, change of the current."""

    sample: str | None = option(
        None,
        metavar="LAYER,...",
        help="From the top, such as polymer,100nm,silicon: materials or their W/(m K), each but "
        "the last with its thickness; what the probe file says if left out.",
    )
    radius: str | None = option(
        None, metavar="LENGTH", help="Of the contact, the tip's flat end, such as 5nm."
    )
    interface: str | None = option(
        None, metavar="RESISTANCE", help="Such as 1e7K/W, or for an area 1e-8m2K/W; none at first."
    )
    bias: str | None = option(
        None,
        metavar="START:STOP:COUNT",
        help="In volts, ends included, or a single one; 1:11:25 if neither this nor a wave form is "
        "given.",
    )


@dataclass(kw_only=True)
class SpectrumRequest(TableRequest, LeverRequest):
    """Show impedance and thermal response to small signals at a bias, or harmonics."""

    bias: str = option(MISSING, metavar="V", help="Of the operating point.")
    frequency: str = option(
        "1Hz:10MHz:71",
        metavar="START:STOP:COUNT",
        help="Spaced evenly in the logarithm, or a single one.",
    )
    amplitude: str | None = option(
        None, metavar="V", help="Of a sine about the bias: harmonics of V_l instead (3ω method)."
    )


@dataclass(kw_only=True)
class ReaderRequest(TableRequest, LeverRequest):
    """Read the distance to a surface: signal, noise, resolution."""

    finds_air = True

    distance: str = option(
        "0.3um:3um:10",
        metavar="START:STOP:COUNT",
        help="From the lever's lower face to the surface, ends included, or a single one.",
    )
    bias: str | None = option(
        None,
        metavar="START:STOP:COUNT",
        help="In volts, ends included, or a single one; the one up to 11 V that resolves the "
        "distances best if left out.",
    )
    pressure: str | None = option(
        None,
        metavar="START:STOP:COUNT",
        help="Of the air, in mbar, spaced evenly in the logarithm, or a single one; what the probe "
        "file says if left out.",
    )
    bandwidth: str = option("1Hz:1kHz", metavar="LOW:HIGH", help="Of what is read.")
    amplifier: str = option("5nV", metavar="V", help="Noise at its input, for each √Hz.")
    hooge: float = option(0.0, help="Hooge's parameter of the silicon, for 1/f noise.")
    vibration: str | None = option(
        None, metavar="LENGTH", help="Of the lever itself, for each √Hz; none if left out."
    )


def check_medium(medium: str | None, *more: str) -> None:
    """Refuse a medium that does not exist."""
    from hotlever.probe.surroundings import Medium

    media = *get_args(Medium), *more
    if medium is not None and medium not in media:
        raise InputError(f"--medium {excerpt(medium)}: expected {' or '.join(media)}")


def refuse_air(settings: list[str] | None, probe: Probe) -> None:
    """Refuse settings of the air around a lever that is in vacuum, where they do nothing."""
    from hotlever.probe.file_sections import field_of
    from hotlever.tasks.texts import parse_settings

    for name, value in parse_settings(settings, probe).items():
        section, key, _ = field_of(probe, name)
        if section == "surroundings" and key != "medium" and value not in (None, False):
            raise InputError(
                f"--set {name}: counts in air, and this lever is in vacuum; expected --medium air "
                "too"
            )
