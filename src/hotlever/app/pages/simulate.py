"""Simulate: a lever that follows sliders, at a bias or in time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import partial
from operator import contains
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import live
from hotlever.app.pages.frame import ErrorBanner, caption, figure, flat_button
from hotlever.app.pages.live_page import LivePage, texts_of
from hotlever.app.pages.plots import LivePlots, compare_histories, redraw
from hotlever.app.pages.task_page import KINDS, DrawnPage, JobView
from hotlever.app.session import Job, Session, Task
from hotlever.errors import HotleverError, InputError
from hotlever.lever.set_points import HELD
from hotlever.materials.parameters import label
from hotlever.probe.surroundings import Physics
from hotlever.tasks.parsing import parse_set_points

# --- the lever that is chosen, a probe and what is changed of it ---------------------------------


def files_of(lever: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the files that a task of a lever is given."""
    return (lever["probe"],) if lever["probe"] else ()


def settings(lever: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a task that say what is changed of a probe."""
    changes = {
        name: str(value).lower() if value is None or isinstance(value, bool) else value
        for name, value in lever["changes"].items()
    }
    medium = changes.pop("medium", None)
    return {"medium": medium, "set": [f"{name}={changes[name]}" for name in sorted(changes)]}


def sweep_of(lever: Mapping[str, Any]) -> Task:
    """Return the task of a sweep of the lever that is chosen, whatever the biases."""
    return Task("sweep", files_of(lever), settings(lever))


def in_python(lever: Mapping[str, Any], last: str, *imports: str) -> str:
    """Return lines of Python that end with what is done with the lever that is chosen.

    Examples
    --------
    >>> print(in_python({"probe": "", "changes": {"n_d": 5e17}}, "sweep = lever.sweep([8.0])"))
    from hotlever import Lever, Probe
    <BLANKLINE>
    lever = Lever(Probe.reference().with_(n_d=5e+17))
    sweep = lever.sweep([8.0])
    """
    name, changes = lever["probe"], dict(sorted(lever["changes"].items()))
    probe = f"Probe.from_file({name!r})" if name else "Probe.reference()"
    if changes and all(name.isidentifier() for name in changes):
        probe += f".with_({', '.join(f'{key}={value!r}' for key, value in changes.items())})"
    elif changes:
        probe += f".with_(**{changes!r})"
    heads = sorted(["from hotlever import Lever, Probe", *imports], key=lambda line: line[0] == "f")
    return "\n".join([*heads, "", f"lever = Lever({probe})", last])


# --- beside the lever that is chosen --------------------------------------------------------------


def options_beside(probes: Iterable[str]) -> dict[str, str]:
    """Return which levers may be shown beside the one that is chosen, in words."""
    return {
        "": "nothing",
        "vacuum": "the same in vacuum",
        "air": "the same in air",
        "now": "the lever as it is now",
        "probe:": "reference probe",
        **{f"probe:{name}": name for name in probes},
    }


def lever_beside(chosen: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the probe and the changes of the lever beside that of the page; None if there is none.

    Examples
    --------
    >>> lever_beside({"beside": "air", "probe": "", "changes": {"n_d": 5e17}})
    {'probe': '', 'changes': {'n_d': 5e+17, 'medium': 'air'}}
    """
    beside = chosen["beside"]
    if not beside:
        return None
    if beside == "now":
        return dict(chosen["kept"])
    if beside.startswith("probe:"):
        return {"probe": beside.removeprefix("probe:"), "changes": {}}
    return {"probe": chosen["probe"], "changes": {**chosen["changes"], "medium": beside}}


def beside_in_words(chosen: Mapping[str, Any]) -> str:
    """Return what the lever beside is called."""
    if chosen["beside"] == "now":
        stored_lever = chosen["kept"]
        changes = ", ".join(f"{name} = {value}" for name, value in stored_lever["changes"].items())
        name = Path(stored_lever["probe"] or "reference probe").stem
        return f"{name} with {changes}" if changes else name
    beside = chosen["beside"]
    return options_beside(()).get(beside) or Path(beside.removeprefix("probe:")).stem


# --- the page -------------------------------------------------------------------------------------


class Pulses(DrawnPage):
    """What the lever shows in time, as `hotlever pulse` computes it."""

    name = "pulse"
    first: ClassVar = {
        "kind": "pulse",
        "height": 10.0,
        "length": 5.0,
        "period": 20.0,
        "count": 5,
        "until": None,
    }
    #: Fields by name: label, unit, kinds that have it, and what stands there if nothing does.
    fields: ClassVar[dict[str, tuple[str, str, tuple[str, ...], str]]] = {
        "height": ("Height", "V", ("pulse", "train", "step"), ""),
        "length": ("Length", "us", ("pulse", "train"), ""),
        "period": ("Period", "us", ("train",), ""),
        "count": ("Pulses", "", ("train",), ""),
        "until": ("Follow until", "us", ("pulse", "train", "step"), "its end"),
    }
    alt = "Voltages, current, tip temperature and heat in time"
    kinds: ClassVar = KINDS | {"film": "the temperature map in time (GIF)"}

    def __init__(self, session: Session, banner: ErrorBanner, lever: dict[str, Any]) -> None:
        super().__init__(session, banner)
        self._lever = lever
        with ui.card().classes("w-full").props("flat bordered"):
            with ui.row().classes("w-full items-center"):
                forms = {"pulse": "one pulse", "train": "several pulses"}
                forms["step"] = "a step that stays"
                kind = ui.toggle(forms, value=self.chosen["kind"], on_change=self._keep("kind"))
                kind.props('aria-label="Wave form"')
                ui.space()
                ui.button("Follow", icon="timeline", on_click=self.start)
            with ui.row().classes("w-full items-center"):
                for key, (title, unit, kinds, empty) in self.fields.items():
                    field = self.number(key, title, unit, empty)
                    field.bind_visibility_from(kind, "value", backward=partial(contains, kinds))
        JobView(session, "pulse-beside", self._beside_ended)
        self.show_result()

    def _values(self) -> dict[str, str]:
        """Return what is set of the wave form.

        Raises
        ------
        InputError
            If something is missing.
        """
        values = {}
        for key, (title, _, kinds, placeholder) in self.fields.items():
            if self.chosen["kind"] in kinds:
                if self.chosen[key] is not None:
                    values[key] = f"{self.chosen[key]:.12g}"
                elif not placeholder:
                    raise InputError(f"{title}: expected a number")
        return values

    def task(self) -> Task:
        """Return the task that simulates the lever, and writes table and figure."""
        return self._task(self._lever, self.outputs(self.stem, "pulse", "SVG"))

    def _task(self, lever: Mapping[str, Any], files: dict[str, str]) -> Task:
        """Return the task that simulates a lever under the wave form that is chosen."""
        values = self._values()
        texts = {key: f"{value}{self.fields[key][1]}" for key, value in values.items()}
        height = texts.pop("height")
        if self.chosen["kind"] == "step":
            wave = {"step": values["height"]}
        else:
            wave = {"pulse": f"{height},{texts.pop('length')}"}
        return Task("pulse", files_of(lever), {**settings(lever), **wave, **texts, **files})

    def start(self) -> bool:
        """Simulate the lever, and that beside it at the same time."""
        other = lever_beside(self._lever)
        with self.banner.caught():
            beside = None
            if other is not None:
                beside = self._task(other, self.outputs(self.stem, "beside.pulse", "CSV"))
            if started := super().start():
                job = self.session.jobs.of(self.name)[0]
                # what is beside it stays so, whatever is chosen by the time it is shown
                job.contents["beside"] = beside and (beside.written, beside_in_words(self._lever))
                if beside is not None:
                    self.session.jobs.start("pulse-beside", beside)
            return started
        return False

    def python(self) -> str:
        """Return the lines of Python that simulate the lever."""
        values, form = self._values(), "step" if self.chosen["kind"] == "step" else "pulse"
        until = f", until={values.pop('until')}" if "until" in values else ""
        last = f"history = simulate(lever, {form}({', '.join(values.values())}){until})"
        imported = f"from hotlever.lever.transient import {form}, simulate"
        return in_python(self._lever, last, imported)

    def show_figure(self, job: Job, path: Path) -> None:
        """Show the figure that was drawn, the lever beside, and the film if there is one."""
        super().show_figure(job, path)
        beside, words = job.contents.get("beside") or ("", "")
        if beside and self.session.project.stamp(beside) >= job.began:
            compare_histories(path.with_suffix(".csv"), self.session.project.path(beside))
            caption(f"Line: the lever. Dashed: {words}.").classes("remark")
        films = (film for film in self.session.jobs.of(self.name) if "film" in film.task.options)
        same = (film for film in films if film.task.question == job.task.question)
        if film := next(filter(self.written, same), None):
            content = self.session.project.path(film.task.written).read_bytes()
            figure(content, "The temperature map in time", wide=True)

    async def _beside_ended(self, job: Job) -> None:
        self._show()

    async def _ended(self, job: Job) -> None:
        if "film" in job.task.options:
            self._show()
        else:
            await super()._ended(job)


class SmallSignals(DrawnPage):
    """What the lever shows under small signals, or its harmonics, as `hotlever spectrum` does."""

    name = "signals"
    first: ClassVar = {"lowest_Hz": 1.0, "highest_Hz": 1e7, "count": 71, "amplitude_V": None}
    alt = "Impedance, and how the tip follows, against the frequency"

    def __init__(self, session: Session, banner: ErrorBanner, lever: dict[str, Any]) -> None:
        super().__init__(session, banner)
        self._lever = lever
        with ui.card().classes("w-full").props("flat bordered"):
            caption(
                "Impedance at the bias of the lever, and how its tip follows power and bias; "
                "with an amplitude the harmonics of the lever voltage (3ω method)."
            )
            with ui.row().classes("w-full items-center"):
                self.number("lowest_Hz", "From", "Hz")
                self.number("highest_Hz", "to", "Hz")
                self.number("count", "Frequencies")
                self.number("amplitude_V", "Amplitude", "V", "small")
                ui.space()
                ui.button("Respond", icon="graphic_eq", on_click=self.start)
        self.show_result()

    def _range(self) -> list[str]:
        values = [self.chosen[key] for key in ("lowest_Hz", "highest_Hz", "count")]
        if None in values:
            raise InputError("frequencies: expected lowest, highest and their count")
        return [f"{value:.12g}" for value in values]

    def task(self) -> Task:
        """Return the task that writes table and figure."""
        low, high, count = self._range()
        amplitude = self.chosen["amplitude_V"]
        options = {
            "bias": f"{self._lever['bias']:.12g}",
            "frequency": f"{low}Hz:{high}Hz:{count}",
            "amplitude": "" if amplitude is None else f"{amplitude:.12g}",
        }
        options |= {**settings(self._lever), **self.outputs(self.stem, "spectrum", "SVG")}
        return Task("spectrum", files_of(self._lever), options)

    def python(self) -> str:
        """Return the lines of Python that do the same."""
        low, high, count = self._range()
        bias, swing = self._lever["bias"], self.chosen["amplitude_V"]
        frequencies = f"np.geomspace({low}, {high}, {count})"
        function, call = "spectrum", f"spectrum(lever.solve([{bias:.12g}])[0], {frequencies})"
        if swing is not None:
            function = "harmonics"
            call = f"harmonics(lever, {bias:.12g}, {swing:.12g}, {frequencies})"
        module = "hotlever.lever.transient.frequency_domain"
        imports = "import numpy as np", f"from {module} import {function}"
        return in_python(self._lever, f"response = {call}", *imports)


class SimulatePage(LivePage):
    """One tab of the page."""

    name, plots_of = "simulate", LivePlots
    live: ClassVar = live
    first: ClassVar = {
        "probe": "",
        "changes": {},
        "beside": "",
        "kept": {"probe": "", "changes": {}},
        "bias": 8.0,
        "most": 12.0,
        "view": "rest",
        "held": "",
        "set_points": "",
    }
    numbers: ClassVar = {
        "tip_K": ("tip", "{:.1f} K", 1.0),
        "current_mA": ("current I_h", "{:.4f} mA", 1.0),
        "lever_V": ("lever voltage V_l", "{:.4f} V", 1.0),
        "power_mW": ("power P_l", "{:.4f} mW", 1.0),
        "reader_V": ("reader V_r", "{:.4f} V", 1.0),
        "knee": ("knee of the I-V curve", "{:.0f} K, {knee_V:.3f} V", 1.0),
    }
    #: Biases of a sweep that is written, and set points of states that are held, as examples.
    biases = 49
    set_points: ClassVar = {"resistance": "2.5kohm:3kohm:6", "power": "1mW:4mW:7"}
    state = ("bias", "most")
    kinds = KINDS

    # --- what is shown ----------------------------------------------------------------------------

    def controls(self) -> None:
        """Ask for a lever to be compared."""
        self._beside = self.chosen["beside"]
        self.choice("beside", "Compare with", options_beside(self.session.project.probes))

    def results(self) -> None:
        """Show the lever at a bias, in time, or under small signals."""
        views = {"rest": "at a bias", "time": "in time", "signals": "small signals"}
        self._view = ui.toggle(views, value=self.chosen["view"])
        self._view.props('aria-label="What is shown"').on_value_change(self._viewed)
        with ui.column().classes("w-full gap-3 parts") as rest:
            super().results()
        with ui.column().classes("w-full gap-3 last") as time:
            self._pulses = Pulses(self.session, self.banner, self.chosen)
        with ui.column().classes("w-full gap-3") as signals:
            self._signals = SmallSignals(self.session, self.banner, self.chosen)
        for name, column in (("rest", rest), ("time", time), ("signals", signals)):
            column.bind_visibility_from(self._view, "value", value=name)

    def _viewed(self, event: Any) -> None:
        self.chosen["view"] = event.value
        redraw(self._view)

    async def changed(self) -> None:
        """Show another probe, as it stands in its file, another one beside, or another table."""
        before, self._beside = self._beside, self.chosen["beside"]
        if self._beside == "now" != before:
            self.chosen["kept"] = {key: self.chosen[key] for key in ("probe", "changes")}
        if self.opened_for == self.probe:
            self.refresh()
        else:
            await self.open()

    async def _reset(self) -> None:
        self.chosen["changes"] = {}
        await self.open()

    def refresh(self) -> None:
        """Follow what was moved, in all views."""
        super().refresh()
        self._pulses.show_command()
        self._signals.show_command()

    # --- what is moved ----------------------------------------------------------------------------

    async def described(self) -> dict[str, Any]:
        """Return what the probe's file says of all that can be moved."""
        if self.chosen["probe"] != self.probe:  # what was changed is of another one
            self.chosen |= {"probe": self.probe, "changes": {}}
        probe = await self.session.ask("quick", live.described, self.probe)
        self._of_probe = probe
        groups = probe["sliders"].values()
        values = {name: value for group in groups for name, value, *_ in group}
        of_material = {name for name, *_ in probe["sliders"]["material"]}
        #: What may change without another reduced lever; nothing if there can be none.
        self._free = of_material | {"series_resistance_ohm"} if probe["reduced"] else set[str]()
        return {**values, **probe["around"]}

    def show_sliders(self) -> None:
        """Show what is around the lever, the bias, and all numbers of the probe."""
        with ui.row().classes("items-center w-full no-wrap"):
            ui.label("in")
            medium = self._field("medium", ui.toggle(["vacuum", "air"]))
            gap = self._field("surface_gap_um", ui.number("surface (µm)", min=0.01, max=1e4))
            gap.props("clearable placeholder=none stack-label")
            gap.bind_visibility_from(medium, "value", value="air")
        with ui.row().classes("items-center w-full"):
            for effect, meaning in Physics.description().items():
                self._field(effect, ui.checkbox(effect).tooltip(meaning))
        with ui.column().classes("w-full gap-0") as of_bias:
            self.slider_of_bias()
        of_bias.bind_visibility_from(self._view, "value", backward=lambda name: name != "time")
        meanings = self._of_probe["meanings"]
        for group, numbers in self._of_probe["sliders"].items():
            opened = ui.expansion(group.capitalize(), value=group == "material")
            with opened.props("dense-toggle header-class=text-bold"):
                for name, _, low, high, unit in numbers:
                    hint = f"{name}: {meanings[name]}" if name in meanings else name
                    unit = "" if unit == "1" else unit
                    self.slider(name, label(name), low, high, unit, hint)
        flat_button("All as in the probe file", self._reset, icon="restart_alt")

    def _field(self, name: str, field: Any) -> Any:
        field.set_value(self.value(name))
        field.on_value_change(lambda event: self.set_value(name, event.value))
        return field

    def value(self, key: str) -> Any:
        """Return a value of the probe as it is changed, or the bias."""
        return self.chosen["changes"].get(key, self.of_file[key])

    def set_value(self, key: str, value: Any) -> None:
        """Change a value of the probe; what is as in its file is no change."""
        if value is None and key != "surface_gap_um":
            return
        changes = {name: old for name, old in self.chosen["changes"].items() if name != key}
        if value != self.of_file[key]:
            changes[key] = value
        if changes != self.chosen["changes"]:
            self.chosen["changes"] = changes
            self.refresh()

    # --- a lever at a bias ------------------------------------------------------------------------

    def of_lever(self) -> Task:
        """Return the command of a sweep, whatever the biases."""
        return sweep_of(self.chosen)

    def also_asked(self) -> tuple[bool]:
        """Return whether the reduced lever of the geometry has been made."""
        return (self.session.reduced.get(self._geometry(), False),)

    def model_and_remark(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return of which lever the numbers are."""
        models = {
            "full lever": "full lever: the numbers of hotlever sweep",
            "reduced lever": "moving: reduced lever, within some 0.1 K",
            "coarse lever": "moving: coarse lever, within some 2 K",
        }
        return models[answer["model"]], ""

    async def follow_answer(self, at: list[float], quick: bool) -> None:
        """Show the lever beside, once the other rests."""
        lever, answer, text = lever_beside(self.chosen), None, ""
        if lever is not None and not quick:
            text = f"Dashed: {beside_in_words(self.chosen)}"
            try:
                arguments = sweep_of(lever), *at, False
                answer = await self.session.ask("beside", live.answer, *arguments)
                numbers = {key: how for key, how in self.numbers.items() if key != "knee"}
                texts = texts_of(answer["now"], numbers)
                text += ": " + ", ".join(f"{numbers[key][0]} {texts[key]}" for key in texts)
            except HotleverError as error:
                text = f"{text}: {error}"
            if self.is_gone or lever != lever_beside(self.chosen):
                return
        self.plots.beside(answer, text)

    def _geometry(self) -> Any:
        """Return what a reduced lever belongs to."""
        changes = self.chosen["changes"].items()
        fixed = {name: value for name, value in changes if name not in self._free}
        return self.chosen["probe"], tuple(sorted(fixed.items(), key=str))

    async def rested(self) -> None:
        """Have the reduced lever of the geometry made, so that sliders are answered by it."""
        geometry, reduced = self._geometry(), self.session.reduced
        around = dict(geometry[1])
        # each combination of what surrounds a lever gets a reduced lever of its own
        others = set(around) - {"medium", "surface_gap_um"}
        if not self._free or geometry in reduced or others:
            return
        reduced[geometry] = False
        task = sweep_of({"probe": geometry[0], "changes": around})
        with suppress(HotleverError):
            reduced[geometry] = await self.session.ask("making", live.prepare, task)

    # --- the table --------------------------------------------------------------------------------

    def about_table(self) -> None:
        """Ask what the table is of."""

        tables = {
            "": "by the bias",
            "resistance": "held at a resistance",
            "power": "held at a power",
        }
        with ui.row().classes("w-full items-end"):
            held = self.choice("held", "A table of states", tables)
            held.classes("w-48", remove="w-full")
            points = self.text("set_points", "Set points").props("debounce=200 stack-label")
            examples = (f"{what}: {text}" for what, text in self.set_points.items())
            points.props(f'placeholder="{", ".join(examples)}"').classes("col", remove="w-full")
            points.bind_visibility_from(held, "value")

    @property
    def _set_points(self) -> str:
        """What states are held at, as the options of commands have it."""
        return self.chosen["set_points"] or self.set_points[self.chosen["held"]]

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return what a table is of; the fields are those at the bias that is shown."""
        chosen = self.chosen
        if held := chosen["held"]:
            return {f"hold_{held}": self._set_points}
        table = f"0:{chosen['most']:.12g}:{self.biases}"
        return {"bias": f"{chosen['bias']:.12g}V" if kind == "VTU" else table}

    def python(self) -> str:
        """Return the lines of Python that make the sweep."""
        if not (held := self.chosen["held"]):
            last = f"sweep = lever.sweep(np.linspace(0, {self.chosen['most']:g}, {self.biases}))"
            return in_python(self.chosen, last, "import numpy as np")
        unit = HELD[held].unit
        try:
            points = parse_set_points(self._set_points, unit, "set points").tolist()
        except InputError:
            return ""  # the command will say what is wrong
        last = f'data = hold(lever, "{held}", {points}).data  # {unit}'
        return in_python(self.chosen, last, "from hotlever.lever.set_points import hold")
