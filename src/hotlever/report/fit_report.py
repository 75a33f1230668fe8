"""A fit in words and figures."""

from __future__ import annotations

import re

from uncertainties import ufloat

from hotlever.fitting.fit import Fit
from hotlever.materials import PARAMETERS
from hotlever.report.figures import (
    correlation_matrix,
    data_and_model,
    iv_curve,
    temperature_power,
    tip_band,
)
from hotlever.report.page import Page

_COLUMNS = ("parameter", "value", "unit", "")


def value_with_error(value: float, stderr: float | None, scale: float = 1.0) -> str:
    """Return a value with its standard error in the last digits, such as ``0.686(5)``.

    Examples
    --------
    >>> value_with_error(0.6862, 0.0049)
    '0.686(5)'
    >>> value_with_error(5.75e17, None, 1e17)
    '5.75'
    """
    if not stderr:
        return f"{value / scale:.6g}"
    number = ufloat(value / scale, stderr / scale)
    return f"{number:.1uS}" if f"{stderr:e}"[0] > "1" else f"{number:.2uS}"


def parameter_rows(fit: Fit) -> list[tuple[str, str, str, str]]:
    """Return symbol, value with error, unit and a remark for each parameter."""
    rows = []
    for name, fitted in fit.parameters.items():
        shown = value_with_error(fitted.value, fitted.stderr, PARAMETERS[name].scale)
        rows.append((name, shown, scaled_unit(name), "" if fitted.vary else "fixed"))
    return rows


def scaled_unit(name: str) -> str:
    """Return the unit a parameter is printed in.

    Examples
    --------
    >>> scaled_unit("n_d")
    '1e17 cm⁻³'
    """
    known = PARAMETERS[name]
    power = "" if known.scale == 1 else f"{known.scale:.0e}".replace("e+", "e") + " "
    return (power + ("" if known.unit == "1" else known.unit)).strip()


def fit_text(fit: Fit) -> str:
    """Return the result of a fit as lines of text."""
    rows = parameter_rows(fit)
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)).rstrip()
        for row in rows
    ]
    error = fit.inversion_temperature_stderr_K
    inversion = value_with_error(fit.inversion_temperature_K, error if error == error else None)
    lines.append(f"inversion temperature: {inversion} K")
    lines.append(
        "rms of data - model: "
        + ", ".join(
            f"{name.rsplit('_', 1)[0]} {rms:.3g} {name.rsplit('_', 1)[1]}"
            for name, rms in fit.residual_rms.items()
        )
    )
    lines.append(
        f"fitted to {', '.join(fit.observables)} in {fit.steps} steps, {fit.seconds:.1f} s"
    )
    return "\n".join(lines)


def sentence(text: str) -> str:
    """Make a note a sentence; names of parameters keep their small letters.

    Examples
    --------
    >>> sentence("the levers differ"), sentence("n_d is not determined")
    ('The levers differ.', 'n_d is not determined.')
    """
    begins_with_name = re.split(r"\W", text, maxsplit=1)[0] in PARAMETERS
    return f"{text if begins_with_name else text[0].upper() + text[1:]}."


def add_fit(page: Page, fit: Fit, prefix: str = "fit_") -> None:
    """Add tables and figures of a fit to a page; `prefix` begins their file names."""
    model = fit.model()
    page.table(
        _COLUMNS,
        parameter_rows(fit),
        "Material parameters; standard errors in units of the last digits.",
    )
    for text in fit.notes:
        page.text(sentence(text))
    page.text(fit_text(fit).split("\n", len(fit.parameters))[-1].replace("\n", "; ") + ".")
    page.figure(
        f"{prefix}data_and_model",
        data_and_model(fit.measurement, model, fit.observables),
        "Measured and modelled observables against bias, and their difference. "
        "Grey: the stated error of the measured temperature.",
    )
    page.figure(
        f"{prefix}correlation",
        correlation_matrix(fit.names, fit.correlation),
        "Correlation of the fitted parameters.",
    )
    page.figure(
        f"{prefix}tip_band",
        tip_band(fit.band, fit.measurement),
        "The tip temperature that the fit predicts, with the 95 % band that follows from the "
        "covariance of the parameters (model errors not included).",
    )
    page.figure(
        f"{prefix}iv",
        iv_curve(model, measurement=fit.measurement),
        "Heater current against lever voltage.",
    )
    page.figure(
        f"{prefix}temperature_power",
        temperature_power(
            model,
            measurement=fit.measurement,
            base_temperature_K=fit.probe.circuit.base_temperature_K,
        ),
        "Tip temperature against the power dissipated in the lever, beside the published law.",
    )


def fit_page(fit: Fit) -> Page:
    """Return the report page of one fit."""
    page = Page(
        f"Fit of {fit.measurement.path}",
        f"Material parameters of a {fit.probe.shape.shape} lever from its measured "
        f"{', '.join(fit.observables)}.",
    )
    add_fit(page, fit)
    return page
