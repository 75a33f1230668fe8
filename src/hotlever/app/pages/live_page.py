"""What pages have in common whose numbers and plots follow sliders."""

from __future__ import annotations

import asyncio
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from types import ModuleType
from typing import Any, ClassVar

from nicegui import background_tasks, ui

from hotlever.app.pages.frame import ErrorBanner, caption, number_shown, two_columns
from hotlever.app.pages.plots import redraw
from hotlever.app.pages.task_page import JobView, TaskPage
from hotlever.app.session import Session, Task
from hotlever.errors import HotleverError


def slider(
    words: str,
    value: float,
    low: float,
    high: float,
    unit: str = "",
    hint: str = "",
    *,
    by_decades: bool = False,
    from_zero: bool = False,
) -> ui.number:
    """Show a slider with its number, which is returned, and may be beyond the slider's ends.

    `by_decades` it is even in the logarithm; `from_zero` its lowest position is then 0.
    """
    ends = (math.log10(low), math.log10(high)) if by_decades else (low, high)

    def position(value: float | None) -> float:
        if not by_decades:
            return ends[0] if value is None else value
        return math.log10(max(value or low, low))

    def number_at(position: float) -> float:
        if not by_decades:
            return position
        return 0.0 if from_zero and position <= ends[0] else float(f"{10.0**position:.3g}")

    with ui.column().classes("w-full gap-0"):
        with ui.row().classes("w-full items-center no-wrap justify-between"):
            name = ui.label(words).classes("text-sm remark")
            if hint:
                name.tooltip(hint)
            number = ui.number(value=value, format="%.4g").classes("w-36 shrink-0")
            number.props(remove="outlined").props(f'aria-label="{words}"')
            number.props(f'borderless suffix="{unit}" input-class=text-right')
        step = (ends[1] - ends[0]) / 400
        bar = ui.slider(min=ends[0], max=ends[1], step=step, value=position(value))
        bar.props(f'dense aria-label="{words}"')

    # each follows the other unless it is there already: what is typed has more digits than places
    def typed() -> None:
        if number.value != number_at(bar.value):
            bar.set_value(position(number.value))

    def slid() -> None:
        if bar.value != position(number.value):
            number.set_value(number_at(bar.value))

    number.on_value_change(typed)
    bar.on_value_change(slid)
    return number


class LivePage(TaskPage):
    """A page whose task is shown at once, at a state that sliders move, and gives its table.

    Attributes
    ----------
    of_file : dict
        What the probe's file says, or what is usual, of what can be chosen.
    opened_for : str or None
        The probe file that it is of.
    """

    #: The module that answers, what draws the answers, and what is shown of ``now`` in them.
    live: ClassVar[ModuleType]
    plots_of: ClassVar[type[Any]]
    numbers: ClassVar[Mapping[str, tuple[str, str, float]]]
    #: What is chosen of a state, beside the task, in the order in which it is asked for.
    state: ClassVar[tuple[str, ...]]
    #: Whether a lever that was solved in full answers at once at any state.
    solved_once = True

    def __init__(self, session: Session, banner: ErrorBanner) -> None:
        super().__init__(session, banner)
        self.of_file: dict[str, Any] = {}
        self.opened_for: str | None = None
        self._notes: dict[str, None] = {}
        with two_columns("live") as (left, right):
            with left:
                self.lever_choice()
                self.controls()
                self._sliders = ui.column().classes("w-full gap-1")
            with right, ui.column().classes("w-full gap-3 parts"):
                self.results()

    # --- for the page to say ----------------------------------------------------------------------

    def controls(self) -> None:
        """Show what is chosen beside sliders."""

    async def described(self) -> dict[str, Any]:
        """Return what the probe's file says."""
        answer: dict[str, Any] = await self.session.ask("quick", self.live.described, self.probe)
        return answer

    @abstractmethod
    def show_sliders(self) -> None:
        """Show the sliders."""

    @abstractmethod
    def of_lever(self) -> Task:
        """Return the task, whatever the state; its probe and options are the lever's."""

    def also_asked(self) -> tuple[Any, ...]:
        """Return what the module that answers is told beside the task and the state."""
        return ()

    def about_table(self) -> None:
        """Ask what is chosen of the table."""

    def of_table(self, kind: str) -> dict[str, Any]:
        """Return the options that a table, or what else is asked for, has more than the task."""
        return {}

    @abstractmethod
    def model_and_remark(self, answer: dict[str, Any], quick: bool) -> tuple[str, str]:
        """Return what the numbers are of, and what else is said of an answer."""

    def completed(self, answer: dict[str, Any], quick: bool) -> dict[str, Any]:
        """Return an answer with all that the plots draw."""
        return answer

    async def follow_answer(self, at: list[Any], quick: bool) -> None:
        """Follow an answer that is shown."""

    async def rested(self) -> None:
        """Follow a lever that is shown in full."""

    # --- what is chosen ---------------------------------------------------------------------------

    async def open(self) -> None:
        """Show the sliders of the probe, and so the first state."""
        if self.opened_for != self.probe:
            self.blank()
        with self.banner.caught():
            self.opened_for = probe = self.probe
            of_file = await self.described()
            if self.is_gone or probe != self.probe:
                return  # another lever was chosen meanwhile
            self.of_file = of_file
            self._sliders.clear()
            with self._sliders:
                self.show_sliders()
            self.refresh()
            return
        self.blank()

    async def changed(self) -> None:
        """Show another probe, or another value of what is no slider."""
        await self.open()

    def value(self, key: str) -> Any:
        """Return what is chosen, or what the probe's file says."""
        chosen = self.chosen[key]
        return self.of_file[key] if chosen in (None, "") else chosen

    def slider(self, key: str, words: str, low: float, high: float, *more: str, **how: Any) -> None:
        """Show the slider of a value; more is its unit and what it says on hover."""
        number = slider(words, self.value(key), low, high, *more, **how)
        number.on_value_change(lambda event: self.set_value(key, event.value))

    def slider_of_bias(self, least: float = 0.0) -> None:
        """Show the slider of the bias; one may type more than it has, and the curves go as far."""

        def set_bias(bias: float | None) -> None:
            if bias is not None:
                most = max(self.chosen["most"], float(math.ceil(bias)))
                self.chosen |= {"bias": float(bias), "most": most}
                self.refresh()

        number = slider("Bias V_b", self.chosen["bias"], least, self.chosen["most"], "V")
        number.on_value_change(lambda event: set_bias(event.value))

    def set_value(self, key: str, value: Any) -> None:
        """Choose a value, and have what is shown follow."""
        if value is not None:
            self.chosen[key] = value
            self.refresh()

    def refresh(self) -> None:
        """Have what is shown follow; only what is wanted last counts."""
        self.show_command()
        # numbers that are not of this are pale after a moment
        self._shown.classes("of-before")
        self._follower.follow(self.of_lever(), [self.chosen[key] for key in self.state])

    def task(self) -> Task | None:
        """Return the task that writes the table."""
        return self._writing("CSV") if self.of_file else None

    def _writing(self, kind: str) -> Task:
        task = self.of_lever()
        files = self.outputs(self.stem, task.command, kind)
        options = {**self.of_table(kind), **task.options, **files}
        return Task(task.command, task.files, options)

    # --- what is shown ----------------------------------------------------------------------------

    def results(self) -> None:
        """Show numbers and plots here, and what can be taken of them."""
        with ui.row().classes("w-full items-end gap-6 numbers") as self._shown:
            titles = {key: title for key, (title, *_) in self.numbers.items()}
            self._numbers = {key: number_shown(key, title) for key, title in titles.items()}
        self._model = caption("starting").props("aria-live=polite")
        self._remarks = ui.label().classes("text-sm remark")
        with ui.column().classes("w-full gap-1") as self._drawn:
            self.plots = self.plots_of()
        # plots without data would be of nothing
        self._drawn.set_visibility(False)
        self._follower = _Follower(self)
        with ui.card().classes("w-full last").props("flat bordered"):
            ui.label("Take it with you").classes("text-bold")
            self.about_table()
            self.kind_buttons(lambda kind: self.run(self._writing(kind)))
            JobView(self.session, self.name, self.give)
            self.command()

    @property
    def is_gone(self) -> bool:
        """Whether the tab was closed."""
        return self._model.is_deleted

    async def show(
        self, lever: Task, at: list[Any], quick: bool, is_wanted: Callable[[], bool]
    ) -> bool:
        """Show a lever in a state if it is still wanted by then; return whether there is one."""
        notes = dict[str, None]()

        def heard(kind: str, content: Any) -> None:
            if kind == "note" and content:
                notes[content] = None
            elif kind == "progress" and not self.is_gone:
                label, done, total = content
                self._model.set_text(f"{label}: {done} of {total}")

        arguments = lever, *at, quick, *self.also_asked()
        try:
            worker = "quick" if quick else "full"
            answer = await self.session.ask(worker, self.live.answer, *arguments, heard=heard)
        except HotleverError as error:
            if not self.is_gone and is_wanted():
                self.blank()
                self.banner.say(str(error))
            return False
        if self.is_gone or not is_wanted():
            return True
        self.banner.clear()
        answer = self.completed(answer, quick)
        for key, text in texts_of(answer["now"], self.numbers).items():
            self._numbers[key].set_text(text)
        self._notes = notes
        self.draw(answer, quick)
        if not self._drawn.visible:
            self._drawn.set_visibility(True)
            redraw(self._drawn)
        if self._follower.last == (lever, at):
            self._shown.classes(remove="of-before")
        await self.follow_answer(at, quick)
        return True

    def draw(self, answer: dict[str, Any], quick: bool) -> None:
        """Draw an answer, and say what it is of."""
        model, remark = self.model_and_remark(answer, quick)
        self._model.set_text(model)
        self._remarks.set_text("; ".join(filter(None, [remark, *self._notes])))
        self.plots.show(answer)

    def blank(self) -> None:
        """Show no numbers where there are none: the last ones were of another state."""
        for number in self._numbers.values():
            number.set_text("–")
        self._model.set_text("no state is shown")
        self._remarks.set_text("")
        self._drawn.set_visibility(False)


def texts_of(
    now: Mapping[str, Any], numbers: Mapping[str, tuple[str, str, float]]
) -> dict[str, str]:
    """Return the texts of numbers of an answer.

    Examples
    --------
    >>> texts_of({"tip_K": 612.34, "mean_K": float("nan")}, {"tip_K": ("tip", "{:.1f} K", 1.0)})
    {'tip_K': '612.3 K'}
    """
    return {
        key: "none" if math.isnan(now[key]) else form.format(factor * now[key], **now)
        for key, (_, form, factor) in numbers.items()
    }


class _Follower:
    """Has a page follow its sliders: quickly while they move, in full when they rest.

    Attributes
    ----------
    last : tuple of Task and list, or None
        What is wanted: a lever and its state.
    """

    def __init__(self, page: LivePage) -> None:
        self._page = page
        self.last: tuple[Task, list[Any]] | None = None
        self._asked: tuple[Task, list[Any]] | None = None
        self._solved: Task | None = None
        self._busy = False

    def follow(self, lever: Task, at: list[Any]) -> None:
        """Have a state of a lever shown; only what is wanted last counts."""
        self.last, self._asked = (lever, at), None
        if not self._busy:
            self._busy = True
            background_tasks.create(self._follow(), name="live lever")

    async def _follow(self) -> None:
        try:
            while self.last is not None and self._asked != self.last and not self._page.is_gone:
                self._asked = lever, at = self.last
                solved = self._page.solved_once and lever == self._solved
                # of a lever that moves each state is shown, of another one none
                is_wanted = partial(self._is_of, lever.files)
                shown = await self._page.show(lever, at, not solved, is_wanted)
                if shown and not solved and self.last == (lever, at):
                    background_tasks.create(self._rest(lever, at), name="full lever")
        finally:
            self._busy = False

    def _is_of(self, files: tuple[str, ...]) -> bool:
        return self.last is not None and self.last[0].files == files

    async def _rest(self, lever: Task, at: list[Any]) -> None:
        """Ask for all once sliders have rested; they may move on meanwhile."""

        def is_wanted() -> bool:
            return self.last == (lever, at)

        await asyncio.sleep(0.35)
        if self._page.is_gone or not is_wanted():
            return
        if await self._page.show(lever, at, False, is_wanted):
            self._solved = lever
            background_tasks.create(self._page.rested(), name="reduced lever")
            if self.last is not None and not is_wanted():
                self.follow(*self.last)
