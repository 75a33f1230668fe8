"""Measurements: of one lever or many; what it is made of, or what to set, and how sure that is."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from nicegui import ui

from hotlever.app import showing
from hotlever.app.pages.frame import (
    ErrorBanner,
    caption,
    download_button,
    drop_zone,
    figure,
    flat_button,
    hand_over,
    say_refused,
    small_button,
    table,
    text_shown,
    two_columns,
)
from hotlever.app.pages.plots import MeasuredPlots, RampPlots
from hotlever.app.pages.task_page import MEDIA, DrawnPage, JobView, TaskPage, several
from hotlever.app.project import DATA, EXAMPLES, FIT
from hotlever.app.session import Job, Session, Task
from hotlever.errors import HotleverError, InputError
from hotlever.files import CALIBRATION, FIGURE_TYPES, TABLE
from hotlever.materials.parameters import sentence
from hotlever.measurement import FileColumn
from hotlever.measurement.columns import GROUP, UNUSED, quantity_of
from hotlever.quantities import FITTED, MEASURANDS
from hotlever.tasks.commands import defaults_of
from hotlever.tasks.measuring import TWIN, measure_lever
from hotlever.text import value_with_error
from hotlever.units import name_and_unit


class MeasurementsPage(TaskPage):
    """One tab of the page."""

    name = "measurements"
    #: What is shown where there is no measurement.
    example = "lever-a.csv"
    first: ClassVar = {
        "kind": "calibrate",
        "data": None,
        "rests": "",
        "medium": "",
        "priors": "",
        "pulses": "",
        "without": [],
        "robust": False,
        "profiles": False,
        "posterior": False,
        "fixed": "",
        "free": "",
        "opened": "",
        "run": False,
    }

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        #: Observables that the measurement has.
        self.observables: list[str] = []
        self._reads = self._shows = 0
        self._read_of: Any = None
        with two_columns("measured") as (left, right):
            with left:
                drop_zone(
                    session,
                    banner,
                    "Drop measurements here (bias, current and what else there is), or press +",
                    self._dropped,
                )
                self._try = small_button("Try the example", self._example, icon="science")
                data, offered = self.chosen["data"] or [], session.project.data
                self._select = ui.select(
                    list(dict.fromkeys([*offered, *data])),
                    label="Measurements",
                    multiple=True,
                    value=data,
                    on_change=self._choose,
                )
                self._select.classes("w-full").props("use-chips")
                with ui.row():
                    flat_button("All", self._take_all)
                    flat_button("None", partial(self._select.set_value, []))
                self.lever_choice()
                self._instrument = MeasureCard(session, banner, self._measured)
                self._instrument.show_fields()
                self._show_options()
                self._button = ui.button("Start", icon="play_arrow", on_click=self.start)
                # until there is something understood
                self._button.classes("w-full").disable()
                results = [*session.project.calibrations, *session.project.fits]
                if results:
                    names = {"": "–"} | {name: name for name in results}
                    self.choice("opened", "Or open a result of the folder", names)
            with right:
                self._instrument.show_rows()
                JobView(session, self.name, self._ended, during=self._follow, notes=False)
                self._result = ui.column().classes("w-full gap-2")
                self._columns = ColumnPicker(partial(self._tell, "columns"))
                opened = ui.expansion("What was understood", value=True)
                self._understood = opened.props("header-class=text-bold")
                with self._understood, ui.column().classes("w-full gap-2"):
                    self._plots = MeasuredPlots()
                    self._rows = ui.column().classes("w-full gap-2")
                self._understood.set_visibility(False)
                self.command()

    def _show_options(self) -> None:
        """Ask what is made, and what is known beforehand."""
        project = self.session.project
        kinds = {"calibrate": "Calibrate", "fit": "Fit"}
        kind = ui.toggle(kinds, value=self.chosen["kind"], on_change=self._keep("kind"))
        meaning = (
            "Calibrate: what to set for a temperature, and how sure that is. Fit: what it is made "
            "of."
        )
        kind.props('aria-label="What is made"').tooltip(meaning)
        self.choice("medium", "Medium", MEDIA)
        self.text("priors", "Known beforehand (n_d=3.3e17±15%)")
        with ui.column().classes("w-full gap-3") as of_calibration:
            rests = {"": "the lever, known as usual"}
            rests |= {f"fit:{name}": f"fit {name}" for name in project.fits}
            rests |= {f"law:{name}": f"power law of {name}" for name in project.laws}
            self._rests = self.choice("rests", "Rests on", rests)
            self.text("pulses", "For pulses too (5us or 5us,100us)")
        flags = {
            "robust": "Lessen the weight of points far off the others",
            "profiles": "Profile the likelihood of each parameter (some 10 s, on a page)",
            "posterior": "Sample the posterior (half a minute, on a page of its own)",
        }
        with ui.column().classes("w-full gap-1") as of_fit:
            ui.label("Fitted").classes("text-sm text-bold")
            self._boxes = {}
            for name, measurand in FITTED.items():
                label, fitted = f"{name} {measurand.symbol}", name not in self.chosen["without"]
                self._boxes[name] = ui.checkbox(label, value=fitted, on_change=self._pick)
            with ui.expansion("More"):
                for name, meaning in flags.items():
                    self.checkbox(name, name, meaning)
                self.text("fixed", "Hold (n_d=3.3e17, p)")
                self.text("free", "Vary too (film.tcr)")
                self._waveform = ui.input(
                    "Pulse of a file in time (10V,20us)", on_change=self._tell_pulse
                )
                self._waveform.classes("w-full").props("debounce=600")
        of_calibration.bind_visibility_from(kind, "value", value="calibrate")
        of_fit.bind_visibility_from(kind, "value", value="fit")

    async def open(self) -> None:
        """Read the measurement that was chosen last, or the latest of the folder."""
        if self.chosen["data"] is None:
            self.chosen["data"] = []
            names = self.session.project.data
            latest = await self.session.ask("full", showing.measurements, names, 1)
            if latest and not self.chosen["data"]:
                self._select.set_value(latest)  # which reads it
                return
        await self.read()

    # --- what is asked ----------------------------------------------------------------------------

    @property
    def data(self) -> list[str]:
        """The measurements that are chosen."""
        return list(self.chosen["data"] or [])

    @property
    def single(self) -> str:
        """The measurement, if it is a single one."""
        return self.data[0] if len(self.data) == 1 else ""

    def _metadata(self, name: str) -> dict[str, Any]:
        """Return what was told of a file that it does not say itself."""
        files = self.session.choices("files", {})
        return files.setdefault(name, {"columns": [], "waveform": ""})

    def _tell(self, key: str, value: Any) -> Awaitable[None] | None:
        """Keep what was told of a measurement, unless it is what is shown for another one."""
        if not self.single or value == self._metadata(self.single)[key]:
            return None
        self._metadata(self.single)[key] = value
        return self.read()

    def _tell_pulse(self, event: Any) -> Awaitable[None] | None:
        return self._tell("waveform", (event.value or "").replace(" ", ""))

    def _pick(self) -> None:
        self.chosen["without"] = [name for name, box in self._boxes.items() if not box.value]
        self.show_command()

    def _choose(self, event: Any) -> Awaitable[None] | None:
        self.chosen |= {"data": list(event.value or []), "opened": ""}
        return self.changed()

    def changed(self) -> Awaitable[None] | None:
        """Read the measurement anew if it, or what it is read with, is another one."""
        self._instrument.show_command()
        self._name_button()
        if self._asked == self._read_of:
            self.show_command()
            return None
        return self.read()

    def _name_button(self) -> None:
        self._button.set_text(self.chosen["kind"].capitalize() + " all" * (len(self.data) > 1))

    @property
    def _asked(self) -> Any:
        """What the measurement is read with, and the result that is opened."""
        return self.data, self.probe, self.chosen["medium"], self.chosen["opened"]

    def task(self) -> Task | None:
        """Return the task that makes a result of each measurement.

        Raises
        ------
        InputError
            If a name is none of the project.
        """
        data, chosen = self.data, self.chosen
        if not data:
            return None
        kind, project = chosen["kind"], self.session.project
        told = [text for name in data for text in self._metadata(name)["columns"]]
        options: dict[str, Any] = {
            "probe": self.probe,
            "column": list(dict.fromkeys(told)),
            "medium": chosen["medium"],
            "prior": several(chosen["priors"]),
        }
        options_of = {"fit": "fit", "law": "power_law"}
        if kind == "calibrate":
            rests, _, name = chosen["rests"].partition(":")
            options |= {options_of[rests]: name, "probe": ""} if rests else {}
            options["pulse"] = chosen["pulses"].replace(" ", "")
        else:
            fitted = [name for name in self.observables if name not in chosen["without"]]
            options |= {
                "observables": "" if fitted == self.observables else ",".join(fitted),
                "fix": several(chosen["fixed"]),
                "free": chosen["free"].replace(" ", ""),
                "robust": chosen["robust"],
            }
        if not self.single:
            folder = "fits" if kind == "fit" else "calibrations"
            output = project.free(folder, "")
            files = {"report": f"{output}-report", "output": output}
            return self._goes_on(Task(kind, tuple(data), options)) or Task(
                kind, tuple(data), {**options, **files}
            )
        stem = Path(self.single).stem
        if kind == "fit":
            stem = project.free(stem, FIT)
            analyses = {name: chosen[name] for name in ("profiles", "posterior")}
            report = f"{stem}-report" if any(analyses.values()) else ""
            waveform = self._metadata(self.single)["waveform"]
            options |= {"pulse": waveform, **analyses, "report": report, "output": f"{stem}{FIT}"}
        else:
            stem = project.free(stem, CALIBRATION, TABLE)
            options |= {"table": f"{stem}{TABLE}", "output": f"{stem}{CALIBRATION}"}
        return Task(kind, tuple(data), options)

    def _goes_on(self, task: Task) -> Task | None:
        """Return the same task of before, if it was stopped: it goes on in its folder."""
        (last, *_) = [*self.session.jobs.of(self.name), None]
        if last is None or last.standing in ("done", "running"):
            return None
        return last.task if last.task.question == task.question else None

    # --- the measurement --------------------------------------------------------------------------

    def _take(self, names: list[str]) -> None:
        data = self.session.project.data
        self._select.set_options(data)
        if self.data == names:
            self._read_of = None
        self._select.set_value([name for name in names if name in data])

    async def _take_all(self) -> None:
        """Choose all measurements of levers that lie in the folder."""
        names = self.session.project.data
        self._take(await self.session.ask("full", showing.measurements, names, len(names)))

    async def _dropped(self, names: list[str]) -> None:
        unknown = [name for name in names if name not in self.session.project.data]
        if unknown:
            raise InputError(
                f"{unknown[0]}: no measurement by its name, expected {', '.join(DATA)}"
            )
        if self.data == names:
            await self.read()
        self._take(names)
        if len(names) > 1:
            await say_refused(self.session, self.banner, names, spectra=False)

    async def _measured(self, name: str) -> None:
        """Take the rows of a measurement that has ended."""
        self._take([name])

    async def _example(self) -> None:
        with self.banner.caught():
            await self._dropped([self.session.project.take_example(self.example)])

    async def read(self) -> None:
        """Read the measurement, and show what was understood, and what was made of it before."""
        self._reads += 1
        turn, name, understood = self._reads, self.single, None
        self._read_of = self._asked
        self.banner.clear()
        columns, groups = list[FileColumn](), list[str]()
        metadata = dict[str, Any](probe=self.probe)
        if name:
            self._waveform.set_value(self._metadata(name)["waveform"])
            metadata |= {**self._metadata(name), "medium": self.chosen["medium"]}
            with suppress(HotleverError):
                groups = await self.session.ask("full", showing.groups, name)
                columns = await self.session.ask("full", showing.columns, name, metadata)
        if name or not self.data:
            try:
                file = name or str(EXAMPLES / self.example)
                understood = await self.session.ask("full", showing.understood, file, metadata)
            except HotleverError as error:
                if turn == self._reads:
                    self.banner.say(str(error))
        if turn != self._reads or self._rows.is_deleted:
            return  # something else has been chosen meanwhile
        told = self._metadata(name)["columns"] if name else []
        self._columns.show(columns, told, understood is not None, groups)
        self._show_understood(understood)
        for job in self.session.jobs.of(self.name)[:1]:
            self._follow(job)
        self._try.set_visibility(not self.data)
        what = "What was understood" if name else f"An example, {self.example}, and what it holds"
        self._understood.props(f'label="{what}"')
        self._name_button()
        self._button.set_enabled(len(self.data) > 1 or bool(name and understood))
        for own, box in self._boxes.items():
            box.set_visibility(own in self.observables or not name)
        self.show_command()
        if self.chosen.pop("run", False) and name and understood:
            self.start()
        await self._show_result()

    def _show_understood(self, understood: dict[str, Any] | None) -> None:
        self.observables = understood["observables"] if understood and self.single else []
        self._understood.set_visibility(understood is not None)
        self._rows.clear()
        if understood is None:
            return
        self._plots.measured(understood["data"], understood["observables"])
        with self._rows:
            head, *rows = understood["rows"]
            table(head, rows)
            for note in understood["notes"]:
                ui.label(f"• {note}").classes("text-sm remark")

    # --- what is made of it -----------------------------------------------------------------------

    def _follow(self, job: Job) -> None:
        """Draw how near to the data the lever is that is being fitted, or was."""
        curve = job.contents.get("curve")
        if curve and self.observables and job.task.files == tuple(self.data):
            self._plots.approach(curve)

    async def _ended(self, job: Job) -> None:
        if job.task.files != tuple(self.data) and self.written(job):
            ui.notify(f"{job.task.written} is written, of {', '.join(job.task.files)}")
        if self.chosen["opened"] == "":
            await self._show_result()
        self.show_command()

    def _job(self) -> Job | None:
        """Return the last job on the measurements that are chosen that has written a result."""
        jobs = self.session.jobs.of(self.name)
        if jobs and jobs[0].standing == "running" and jobs[0].task.files == tuple(self.data):
            return None
        own = (job for job in jobs if job.task.files == tuple(self.data))
        return next(filter(self.written, own), None)

    async def _show_result(self) -> None:
        """Show the result that was opened, or the last one of these measurements."""
        self._shows += 1
        turn, opened, job = self._shows, self.chosen["opened"], self._job()
        self._result.clear()
        self._origin = None
        if not opened and job is None:
            return
        with self._result:
            if not opened and job is not None:
                self.result_of(job)
                for note in job.notes:
                    ui.label(f"• {note}").classes("text-sm remark")
                if len(job.task.files) > 1:
                    await self._show_levers(job, turn)
                    return
                if table_file := job.task.options.get("table"):
                    download_button(self.session, table_file, "Table (CSV)")
                if report := job.task.options.get("report"):
                    download_button(self.session, f"{report}/index.html", "Page (HTML)")
            await self._show_file(opened or job.task.written, turn)  # type: ignore[union-attr]

    async def _show_file(self, name: str, turn: int) -> None:
        """Show the page of a result in the element that is open."""
        waiting = ui.spinner(size="lg").props('aria-label="Being drawn"')
        container = ui.column().classes("w-full gap-2")
        with self.banner.caught():
            result = await self.session.ask("full", showing.result, name)
            if turn == self._shows and not container.is_deleted:
                with container:
                    if self.chosen["opened"]:
                        whence = (
                            f"A result of the folder, made of {result['data']}: it holds its own"
                        )
                        own = f"{whence} lever and options, whatever is chosen here."
                        ui.label(own).classes("remark")
                    await show_result(self.session, self.banner, name, result)
                    if result["kind"] == "fit":
                        on = ui.button("Calibrate with this fit", icon="straighten")
                        on.props("dense").classes("q-px-sm")
                        on.on_click(partial(self._calibrate_with, name))
        if not waiting.is_deleted:
            waiting.delete()

    def _calibrate_with(self, name: str) -> None:
        self.chosen |= {"kind": "calibrate", "rests": f"fit:{name}", "opened": "", "run": True}
        ui.navigate.to(f"/{self.name}")

    async def _show_levers(self, job: Job, turn: int) -> None:
        """Show the table of many levers; each opens its page below."""
        folder, report = job.task.options["output"], job.task.options["report"]
        path = self.session.project.path(folder)
        names = [f"{folder}/{file.name}" for file in sorted(path.glob("*.json"))]
        levers = await self.session.ask("full", showing.levers, names)
        if turn != self._shows:
            return
        page = ui.column().classes("w-full gap-2")

        async def show_lever(stem: str) -> None:
            page.clear()
            with page:
                await self._show_file(f"{folder}/{stem}.json", self._shows)

        with ui.row().classes("items-center"):
            for file in path.glob("*s.csv"):
                download_button(self.session, f"{folder}/{file.name}", "Table (CSV)")
            download_button(self.session, f"{report}/index.html", "Page (HTML)")
        table(levers["head"], levers["rows"], show_lever)
        caption("A click on a lever shows it below.")
        page.move(target_index=-1)


# --- a result: its page, what to set by it, what to measure next ----------------------------------


async def show_result(session: Session, banner: ErrorBanner, name: str, result: Any) -> None:
    """Show what a fit or a calibration file says, as `hotlever.app.showing.result` has it."""
    stem = Path(name).name.split(".")[0]

    async def give(function: Callable[..., Any], file: str, *arguments: str) -> None:
        with banner.caught():
            await hand_over(session.ask("full", function, name, *arguments), file)

    with ui.row().classes("items-center"):
        ui.label(name).classes("text-lg text-bold")
        download_button(session, name, f"{result['kind'].capitalize()} (JSON)")
        if result["kind"] == "calibration":
            budget = partial(give, showing.budget, f"{stem}-budget.html")
            small_button("Uncertainty budget (one sheet)", budget, icon="print")
    questions = list[Callable[[], Awaitable[None]]]()
    if result["kind"] == "calibration":
        with ui.card().classes("w-full").props("flat bordered"):
            ui.label("What do I set?").classes("text-bold")
            if doubt := result["doubt"]:
                refusal = f"This calibration does not tell. {sentence(doubt)}"
                ui.label(refusal).classes("remark").props("data-answer=none")
            else:
                quantities = {
                    "tip_K": ("tip temperature", "K", 600.0),
                    "bias_V": ("bias", "V", 8.0),
                    "power_mW": ("power", "mW", 2.0),
                }
                first = {along: value for along, (*_, value) in quantities.items()}
                targets = session.choices("asked", first)
                questions = [
                    _question(session, name, along, title, unit, targets)
                    for along, (title, unit, _) in quantities.items()
                ]
        if questions:
            Proposals(session, banner, name, stem)
    for answer in questions:
        await answer()
    with ui.row().classes("w-full gap-3 items-start"):
        for block in result["blocks"]:
            if block["kind"] == "heading":
                ui.label(block["text"]).classes("w-full text-lg text-bold")
            elif block["kind"] == "text":
                text_shown(block["text"])
            elif block["kind"] == "table":
                table(block["columns"], block["rows"])
                caption(block["caption"]).classes("w-full")
            else:
                with ui.column().classes("gap-0"):
                    figure(block["figure"], block["caption"])
                    with ui.row().classes("items-center w-full no-wrap"):
                        caption(block["caption"]).classes("remark caption col")
                        for suffix in FIGURE_TYPES:
                            own, kind = block["name"], suffix[1:].upper()
                            click = partial(
                                give, showing.drawn, f"{stem}-{own}{suffix}", own, suffix
                            )
                            flat_button(kind, click, label=f"{own} as {kind}").props("size=sm")


def _question(
    session: Session, name: str, along: str, title: str, unit: str, targets: dict[str, float]
) -> Callable[[], Awaitable[None]]:
    """Ask a number here; return what answers from the calibration for the one that stands there."""
    with ui.row().classes("w-full items-center"):
        number = ui.number(f"For a {title} of", value=targets[along])
        number.props(f"suffix={unit} debounce=150").classes("w-60")
        said = ui.label().classes("remark col min-w-60").props("aria-live=polite")
        said.props(f"data-answer={along}")

    async def answer() -> None:
        value, text = number.value, ""
        if value is not None:
            targets[along] = value
            try:
                row = await session.ask("full", showing.settings, name, along, value)
                text = (
                    "outside of what was calibrated, or in a jump" if row is None else _answer(row)
                )
            except HotleverError as error:
                text = str(error)
        if value == number.value:  # nothing else was typed meanwhile
            said.set_text(text)

    number.on_value_change(answer)
    return answer


def _answer(row: dict[str, float]) -> str:
    low, high = row["tip_low_K"], row["tip_high_K"]
    apex = ""
    if "apex_K" in row:
        apex = f", apex {value_with_error(row['apex_K'], row['apex_stderr_K'])} K"
    return (
        f"set a bias of {row['bias_V']:.3f} V: lever {row['lever_V']:.3f} V, "
        f"{row['current_mA']:.4f} mA, {row['power_mW']:.3f} mW; tip "
        f"{value_with_error(row['tip_K'], row['tip_stderr_K'])} K "
        f"(95 %: {low:.0f} to {high:.0f} K){apex}"
    )


class Proposals(DrawnPage):
    """A card in the element that is open, of a calibration file; what it makes begins with a stem.

    Each calibration has proposals of its own.
    """

    alt = "Error by temperature now and after more measurements; tip temperature by bias"
    kinds: ClassVar = {kind: text for kind, text in DrawnPage.kinds.items() if kind != "NetCDF"}
    #: Where the error counts, and what the tip is to stay below: what counts where nothing is said.
    temperatures: ClassVar = {
        "at": ("Sure at", "hottest measured"),
        "stay_below": ("Stay below", "what melts"),
    }
    first: ClassVar = dict.fromkeys(temperatures)

    def __init__(self, session: Session, banner: ErrorBanner, calibration: str, stem: str) -> None:
        self.name, self._calibration, self._stem = f"next {calibration}", calibration, stem
        super().__init__(session, banner)
        with ui.card().classes("w-full").props("flat bordered data-proposals"):
            ui.label("What do I measure next?").classes("text-bold")
            with ui.row().classes("w-full items-center"):
                for key, (title, empty) in self.temperatures.items():
                    self.number(key, title, "K", empty).classes("w-44", remove="w-36")
                ui.space()
                ui.button("Propose", icon="add_location_alt", on_click=self.start)
            self.show_result()
        self.show_command()

    def task(self) -> Task:
        """Return the task that writes the proposals as a table and a figure."""
        temperatures = {key: self.chosen[key] for key in self.temperatures}
        kelvins = {key: "" if T is None else f"{T:.12g}K" for key, T in temperatures.items()}
        files = self.outputs(self._stem, "next", "SVG")
        return Task("next", (self._calibration,), {**kelvins, **files})


# --- a lever that is measured ---------------------------------------------------------------------


class MeasureCard(TaskPage):
    """What a lever is measured with, beside what is measured; `then` is told the file of rows."""

    name = "measure"
    #: What the fields ask, by option of `hotlever measure`; at first they have its defaults.
    fields: ClassVar = {
        "source": "Source meter (VISA name, or twin to try it)",
        "reader": "Voltmeter at the reader (VISA name, or twin)",
        "bias": "Biases (V), and most rows",
        "settle": "Wait at each",
        "stay_below": "The tip stays below",
        "compliance": "Most current",
    }
    first: ClassVar = {
        **dict.fromkeys(fields, ""),
        **defaults_of(measure_lever),
        # it is tried without an instrument, below a temperature that any tip bears
        "source": TWIN,
        "stay_below": "900K",
        "propose": False,
    }

    def __init__(
        self, session: Session, banner: ErrorBanner, then: Callable[[str], Awaitable[None]]
    ) -> None:
        super().__init__(session, banner)
        self._then = then

    def show_fields(self) -> None:
        """Ask here how it is measured."""
        with ui.expansion("Measure with a source meter", icon="bolt").classes("w-full"):
            for name, label in self.fields.items():
                self.text(name, label)
            words = "Take the biases that tell most, from the fourth row on (--next)"
            self.checkbox("propose", "Most telling biases", words)
            self._button = ui.button("Measure", icon="play_arrow", on_click=self.start)
            self._button.classes("w-full")
            caption(
                "Set the limits of the instrument itself first: it keeps its output on when the "
                "line breaks. Before each bias the rows so far say how hot the tip may get there."
            ).classes("remark")
            self.command()
        self.show_command()

    def show_rows(self) -> None:
        """Draw here what is measured, while it is and after."""
        with ui.column().classes("w-full gap-2 ramp") as self._all:
            JobView(self.session, self.name, self._ended, during=self._follow, stops=True)
            self._plots = RampPlots()
            self._result = ui.column().classes("w-full gap-1")
        self._all.set_visibility(bool(self.session.jobs.of(self.name)))

    def task(self) -> Task:
        """Return the task that measures, and writes the rows to a new file."""
        chosen = {name: self.chosen[name].strip() for name in self.fields}
        options = {**chosen, "next": self.chosen["propose"], "probe": self.probe}
        stem = self.session.project.free(f"{self.stem}-iv", ".csv")
        return Task("measure", (), {**options, "output": f"{stem}.csv"})

    def run(self, task: Task) -> bool:
        """Measure, and show the rows."""
        self._all.set_visibility(True)
        self._result.clear()
        return super().run(task)

    def _follow(self, job: Job) -> None:
        if job.contents:
            self._plots.show(job.contents.get("rows"))

    async def _ended(self, job: Job) -> None:
        with self._result:
            text_shown(job.contents.get("result", ""))
        self.show_command()
        if self.written(job):
            await self._then(Path(job.task.written).name)


# --- columns of its file --------------------------------------------------------------------------


class ColumnPicker:
    """Which column is which; `tell` is told the words of ``--column`` for those that are picked.

    Of a binary file of several groups that whose columns they are is picked first.

    Fields stay while the file is read anew: the next one may be open meanwhile.
    """

    def __init__(self, tell: Callable[[list[str]], Any]) -> None:
        self._tell = tell
        #: What was told, a quantity and perhaps its unit, by the column.
        self._assignments: dict[str, str] = {}
        self._group: str | None = None
        self._columns: dict[str, FileColumn] = {}
        self._fields: dict[str, tuple[ui.select, ui.select]] = {}
        opened = ui.expansion("Columns of the file").props("header-class=text-bold")
        with opened as self._opened:
            self._groups = ui.select([], label="Group of the file").classes("w-64")
            self._groups.on_value_change(lambda event: self._pick_group(event.value))
            caption("The first values of each, and what it is used as.")
            self._rows = ui.column().classes("w-full gap-1")

    def show(
        self,
        columns: list[FileColumn],
        assignments: list[str],
        is_understood: bool,
        groups: list[str],
    ) -> None:
        """Show the columns of a file; they are open where the file is not understood."""
        parts = [text.partition("=") for text in assignments]
        self._assignments = {
            name.strip(): quantity for quantity, _, name in parts if quantity.strip() != GROUP
        }
        self._group = next((name for quantity, _, name in parts if quantity.strip() == GROUP), None)
        self._groups.set_visibility(len(groups) > 1)
        self._groups.set_options(groups, value=self._group if self._group in groups else None)
        self._opened.set_visibility(bool(columns) or len(groups) > 1)
        if not is_understood:
            self._opened.set_value(True)
        before = [(column.name, column.heading, column.cells) for column in self._columns.values()]
        self._columns = {column.name: column for column in columns}
        if before != [(column.name, column.heading, column.cells) for column in columns]:
            self._rows.clear()
            with self._rows:
                self._fields = {column.name: self._row(column) for column in columns}
        # for a column whose heading has none
        offered = {"V": ("V", "mV", "uV"), "mA": ("A", "mA", "uA", "nA"), "K": ("K", "degC")}
        offered["us"] = ("s", "ms", "us", "ns")
        for column in columns:
            picked, unit = self._fields[column.name]
            picked.set_value(column.symbol)
            has_unit = bool(column.symbol and not column.unit)
            unit.set_visibility(has_unit)
            if has_unit:
                assigned_unit = self._unit_of(column.name)
                units = [
                    *offered[MEASURANDS[column.symbol].typed_unit],
                    *filter(None, [assigned_unit]),
                ]
                unit.set_options(list(dict.fromkeys(units)), value=assigned_unit)

    def _row(self, column: FileColumn) -> tuple[ui.select, ui.select]:
        """Show a column; return the fields of what it is, and of its unit."""
        name = column.name
        head = column.heading or f"column {name}"
        with ui.row().classes("w-full items-center gap-2"):
            with ui.column().classes("gap-0 col min-w-40"):
                ui.label(head).classes("text-sm text-bold remark")
                caption(", ".join(cell or "–" for cell in column.cells)).classes("remark")
            options = {"": "not used"} | {
                symbol: f"{symbol}: {'time' if symbol == 't' else measurand.meaning}"
                for symbol, measurand in MEASURANDS.items()
            }
            picked = ui.select(options, value=column.symbol).classes("w-64")
            picked.props(f'aria-label="Column {name} is"')
            picked.on_value_change(lambda event: self._pick(name, event.value))
            unit = ui.select([], label="in").classes("w-24")
            unit.props(f'aria-label="Unit of column {name}"')
            unit.on_value_change(lambda event: self._pick_unit(name, event.value))
        return picked, unit

    def _unit_of(self, name: str) -> str | None:
        """Return the unit that was told of a column."""
        return name_and_unit(self._assignments.get(name, ""))[1]

    def _pick(self, name: str, symbol: str, unit: str | None = None) -> Any:
        """Tell what a column is, and nothing else of it, nor of that quantity."""
        column = self._columns[name]
        if symbol == column.symbol and unit is None:
            return None  # nobody picked it
        # a unit is not guessed: the reader asks for one
        own = f"{symbol} ({unit})" if unit else symbol
        if not symbol and (
            quantity_of(column.heading) is not None or name not in self._assignments
        ):
            # what was only told to be used is taken back; what the file itself says is not
            own = UNUSED
        # at once: the next may be picked before the file is read with this
        self._assignments = {
            heading: quantity
            for heading, quantity in self._assignments.items()
            if heading != name and quantity_of(quantity, assigned=True) != symbol
        } | ({name: own} if own else {})
        group = [f"{GROUP}={self._group}"] if self._group is not None else []
        assigned = [f"{quantity}={heading}" for heading, quantity in self._assignments.items()]
        return self._tell([*group, *assigned])

    def _pick_group(self, group: str | None) -> Any:
        """Tell which group is picked; another one may have other columns."""
        is_new = group is not None and group != self._group
        return self._tell([f"{GROUP}={group}"]) if is_new else None

    def _pick_unit(self, name: str, unit: str | None) -> Any:
        is_new = unit is not None and unit != self._unit_of(name)
        return self._pick(name, self._columns[name].symbol, unit) if is_new else None
