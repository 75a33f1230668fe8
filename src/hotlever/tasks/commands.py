"""The commands: what each takes, and the task that does it, for the command line and the app."""

from __future__ import annotations

from dataclasses import Field, dataclass, fields
from importlib import import_module
from typing import Any

from hotlever.tasks.caching import CacheRequest
from hotlever.tasks.evidence import ReproduceRequest, ValidateRequest
from hotlever.tasks.measured_requests import (
    CalibrateRequest,
    FitRequest,
    JoinRequest,
    RamanRequest,
)
from hotlever.tasks.planning_requests import (
    DesignRequest,
    ImportRequest,
    MaterialsRequest,
    NewRequest,
    NextRequest,
    ShowRequest,
)
from hotlever.tasks.reporter import Reporter
from hotlever.tasks.requests import (
    ContactRequest,
    PulseRequest,
    ReaderRequest,
    SpectrumRequest,
    SweepRequest,
)


@dataclass(frozen=True)
class Command:
    """What is done by one command.

    Attributes
    ----------
    request : type
        A dataclass whose fields are arguments and options, and whose docstring is the help.
    module, task : str
        The function that takes a reporter and a request, and returns an exit status or nothing. Its
        module, which may import what it computes with, is imported when the command is done.
    """

    request: type
    module: str
    task: str

    @property
    def arguments(self) -> list[Field[Any]]:
        """The fields of the request that have no names on the command line."""
        return [field for field in fields(self.request) if "names" not in field.metadata]

    @property
    def written(self) -> set[str]:
        """The names of the fields that say what is written."""
        return {field.name for field in fields(self.request) if "writes" in field.metadata}

    def do(self, reporter: Reporter, request: Any) -> int:
        """Do what is requested; return the exit status."""
        status: int | None = getattr(import_module(self.module), self.task)(reporter, request)
        return status or 0


#: By name, in the order in which the help lists them.
COMMANDS = {
    "probe new": Command(NewRequest, "hotlever.tasks.describing", "new_probe"),
    "probe show": Command(ShowRequest, "hotlever.tasks.describing", "show_probe"),
    "probe import": Command(ImportRequest, "hotlever.tasks.describing", "propose_probe"),
    "materials": Command(MaterialsRequest, "hotlever.tasks.describing", "list_materials"),
    "sweep": Command(SweepRequest, "hotlever.tasks.sweeping", "sweep"),
    "pulse": Command(PulseRequest, "hotlever.tasks.simulating", "simulate_in_time"),
    "contact": Command(ContactRequest, "hotlever.tasks.surfaces", "touch"),
    "reader": Command(ReaderRequest, "hotlever.tasks.surfaces", "approach"),
    "spectrum": Command(SpectrumRequest, "hotlever.tasks.sweeping", "respond"),
    "design": Command(DesignRequest, "hotlever.tasks.designing", "vary_design"),
    "raman": Command(RamanRequest, "hotlever.tasks.spectra", "measure_spectra"),
    "join": Command(JoinRequest, "hotlever.tasks.spectra", "join_spectra"),
    "fit": Command(FitRequest, "hotlever.tasks.estimating", "fit_files"),
    "calibrate": Command(CalibrateRequest, "hotlever.tasks.estimating", "calibrate_files"),
    "next": Command(NextRequest, "hotlever.tasks.estimating", "propose"),
    "reproduce": Command(ReproduceRequest, "hotlever.tasks.evidence", "reproduce"),
    "validate": Command(ValidateRequest, "hotlever.tasks.evidence", "validate"),
    "cache": Command(CacheRequest, "hotlever.tasks.caching", "show_cache"),
}
