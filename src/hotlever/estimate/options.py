"""What users ask of a fit, and of a calibration, and the numbers that steer how it is found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, TypeVar, get_args

from hotlever.errors import InputError, unknown_name
from hotlever.estimate.power_law import PowerLaw
from hotlever.estimate.tip_table import PulseTiming
from hotlever.materials import PARAMETERS
from hotlever.probe import Probe
from hotlever.probe.priors import SCALES, Prior
from hotlever.probe.probe_parameters import (
    heat_capacities,
    of_materials,
    parameter_of,
    usual_parameters,
)
from hotlever.probe.surroundings import Medium
from hotlever.quantities import FITTED

Weights = Literal["maximum", "errors"]
#: Of what there are uncertainty budgets: a tip, or its apex that touches a sample.
BudgetOf = Literal["tip", "apex"]


# --- the numbers that steer an estimate -----------------------------------------------------------


@dataclass(frozen=True)
class DataNoiseOptions:
    """How data tell their noise, and when they are outliers.

    Attributes
    ----------
    shares : tuple of float
        Of the variance that may be in proportion to the square of what is shown; of all of it, data
        near zero would count infinitely.
    freedom : float
        Degrees of freedom of the t distribution by which residuals tell the shares: with few of
        them it does not matter how far off outliers are (Lange, Little and Taylor, J. Am. Stat.
        Assoc. 84, 881 (1989), who take 4).
    rounds : int
        In which the scale of it is found.
    least_free : float
        A datum that alone decides a parameter says nothing of its noise: at least this share of its
        square is taken for free.
    huber : float
        Huber's weights lessen from so many standard deviations on.
    full_weight, no_weight : float
        Other weights are full up to, and nothing beyond, so many: data without outliers keep nearly
        all of theirs, and their scatter.
    most_of_noise, most_of_discrepancy : float
        What is smooth is no noise: data scatter by so many times as much as about their neighbours,
        or as a model is off, at most, or a search would be content with a wrong lever and noisy
        data.
    fewest_neighbours : int
        So many data tell how they scatter about their neighbours.
    """

    shares: tuple[float, ...] = (0.0, 0.5, 0.8, 0.95, 0.99)
    freedom: float = 4.0
    rounds: int = 20
    least_free: float = 0.05
    huber: float = 1.345
    full_weight: float = 3.5
    no_weight: float = 6.0
    most_of_noise: float = 4.0
    most_of_discrepancy: float = 2.0
    fewest_neighbours: int = 7


@dataclass(frozen=True)
class SearchOptions:
    """What steers a search.

    Attributes
    ----------
    most_branches : int
        Levers solved for one choice of weights, after which it ends where it is. Good data take 6
        to 15; those of levers of which little is known up to 30.
    most_in_all : int
        Levers solved for all choices of weights together, in one search with priors, after which it
        ends where it is.
    most_in_estimate : int
        Levers solved for one estimate, in all of its searches. With priors it is never reached. A
        robust one without priors, which begins anew with each choice of weights, takes twice as
        many.
    first_region, largest_region : float
        How far a step goes, in units of `Coordinates.room`: logarithms, where parameters are
        positive. Beyond a factor of two neighbours say little.
    decrement : float
        Sum of squares that Gauss and Newton's step would still take away at an optimum, where
        squares count standard deviations (with priors): a tenth of a standard error.
    relative_decrement : float
        The same in units of the noise, where weights count no standard deviations: a thirtieth of a
        standard error.
    rough_decrement : float
        The same before the model is confirmed, which moves the optimum anyway: a quarter of a
        standard error.
    small_decrement : float
        The same where steps gain next to nothing: a third of a standard error. With priors that is
        where no longer step than the ``rough_region`` gains anything, since values are not smooth
        there, as near a fold that moves past a row.
    rough_region : float
        See there; in units of `Coordinates.room`, as all regions.
    smallest_region : float
        One in which only rounding errors are left.
    negligible, negligible_of_misfit, misfit : float
        A decrement as a share of the sum of squares; the second where that is so many times what
        noise explains that no such lever shows the data.
    precision : float
        Differences, as shares of the largest value of an observable, of which only rounding errors
        are left.
    gentle_rounds, robust_rounds : int
        Most reweightings by Huber's weights, with which there is one optimum; then by those that
        forget outliers.
    settled, settled_relative : float
        A confirmation by the full lever that moves no parameter by more than these shares of its
        standard error and of its value ends the fit: the confirmed model is exact to first order.
    confirmations : int
        Most of them.
    discrepancy : float
        By how much a model is off that describes the data, a share of an observable's largest
        value, and of the bias, where something was known of the lever beforehand (Kennedy and
        O'Hagan, J. R. Stat. Soc. B 63, 425 (2001)).
    scatter_rounds : int
        Rounds in which an observable without measurement errors finds its scatter.
    creeping_steps : int
        Steps in succession of which none promises a third of a standard error, after which a search
        without priors has come to its end: data leave a curved valley open, as those of a current
        below the knee, along which it would creep on.
    """

    most_branches: int = 25
    most_in_all: int = 40
    most_in_estimate: int = 120
    first_region: float = 0.5
    largest_region: float = 0.7
    decrement: float = 1e-2
    relative_decrement: float = 1e-3
    rough_decrement: float = 0.05
    small_decrement: float = 0.1
    rough_region: float = 1e-3
    smallest_region: float = 1e-6
    negligible: float = 1e-6
    negligible_of_misfit: float = 1e-3
    misfit: float = 10.0
    precision: float = 1e-7
    gentle_rounds: int = 6
    robust_rounds: int = 14
    settled: float = 0.5
    settled_relative: float = 0.03
    confirmations: int = 5
    discrepancy: float = 5e-4
    scatter_rounds: int = 3
    creeping_steps: int = 5


@dataclass(frozen=True)
class DiagnosisOptions:
    """When data are not described, and when a hypothesis explains them.

    Attributes
    ----------
    usual_scatter, held_scatter : float
        The largest difference of data that are described (rms), as a share of the largest value of
        an observable; the second where weights are no errors: such fits hold dimensions and
        whatever else is fixed.
    correlation : float
        Data beyond it are not described if neighbours differ together: if the product of two is
        this share of the square, which of white noise is 0.
    run : int
        Neither are data of which so many neighbours differ by three times the usual scatter in
        their median.
    run_of_noise : float
        Of noisier data they differ by chance by up to so many times their scatter.
    fewest_rows : int
        Fewer tell nothing of their neighbours.
    outlier : float
        Standard deviations beyond which a datum is an outlier.
    run_of_outliers : int
        Outliers stand alone: so many neighbours are none; nor are one fewer at the end, with
        nothing beyond.
    contact_probability : float
        Temperatures of a contact are off where by chance this share of levers is.
    cold_factor : float
        The resistance of a cold lever is within this factor of its model's.
    fewest_biases : int
        Different ones that a calibration needs.
    shift : float
        Data are not described where they, with all other priors, are so many standard deviations
        from one prior: of the nearly twenty of a lever one is, by chance, in one lever of 500.
    doubtful_shift : float
        Where data that are described are so many from a prior, it is asked what may be behind them:
        in one lever of fifty by chance, and where a medium that is stated wrongly passes for a law
        that departs.
    shift_probability : float
        The same as ``shift`` of all parameters together.
    error, error_of_largest : float
        What a coarse lever may differ by from what was measured: of each current and of the
        largest.
    robust_beyond : float
        Differences beyond this many of those count less and less, so that no single datum decides.
    excluded_row, unknown : float
        Sum of squares as which each row that a hypothesis leaves out counts, and each unknown that
        it finds.
    improvement, squares_per_row, squares : float
        A hypothesis has to lower the sum of squares to this share of what it is without, and to no
        more than so much for each row and altogether.
    another_lever : float
        Data that leave so many times that, with all that is known of a lever, are those of another:
        of right levers of which little is known the farthest left twice.
    as_likely_factor, as_likely_difference : float
        Hypotheses within a factor or a difference of the best are as likely.
    """

    usual_scatter: float = 0.004
    held_scatter: float = 0.01
    correlation: float = 0.4
    run: int = 4
    run_of_noise: float = 2.5
    fewest_rows: int = 7
    outlier: float = 8.0
    run_of_outliers: int = 3
    contact_probability: float = 2e-4
    cold_factor: float = 2.5
    fewest_biases: int = 3
    shift: float = 3.85
    doubtful_shift: float = 3.0
    shift_probability: float = 2e-3
    error: float = 3e-3
    error_of_largest: float = 1e-3
    robust_beyond: float = 3.0
    excluded_row: float = 1.2
    unknown: float = 2.0
    improvement: float = 0.5
    squares_per_row: float = 2.0
    squares: float = 10.0
    another_lever: float = 4.0
    as_likely_factor: float = 1.3
    as_likely_difference: float = 4.0


@dataclass(frozen=True)
class TrialOptions:
    """How trials are made.

    Attributes
    ----------
    tails : float
        Degrees of freedom of the Student's t that errors are drawn from.
    accuracy : float
        Standard errors within which a trial finds its estimate; otherwise it counts for nothing.
    most_evaluations : int
        Levers that a trial looks at.
    rounds : int
        Estimates by which noise and optimum settle that follow from each other.
    block : int
        Trials that a process makes at a time.
    fewest_effective : int
        Independent samples that quantiles take at least (Vehtari et al., Bayesian Analysis 16
        (2021) 667).
    """

    tails: float = 10.0
    accuracy: float = 0.03
    most_evaluations: int = 20
    rounds: int = 10
    block: int = 100
    fewest_effective: int = 400


@dataclass(frozen=True)
class PulseOptions:
    """How pulses are followed, and what is uncertain in them alone.

    Attributes
    ----------
    heat_capacity_spread : float
        Standard deviation of the heat capacity: tables of pure silicon differ by 1 to 2 %, and
        doping, oxides and metal on a lever are not in them.
    heat_in_air_spread : float
        The same of what air takes up, by the properties of cold air: 7 % too much at a rise of
        600 K.
    heights : int
        That are followed with the coarse mesh.
    chosen : tuple of int
        Which of them are followed with the fine one and for moved levers, falling.
    per_step : int
        Points of a history for each step.
    distance : float
        How far directions of the covariance are followed, in standard errors.
    least_variance, neglected : float
        Directions that matter: share of the variance of a parameter that they have, and of that of
        the highest pulse that may be left out at others.
    """

    heat_capacity_spread: float = 0.03
    heat_in_air_spread: float = 0.1
    heights: int = 13
    chosen: tuple[int, ...] = (12, 9, 6, 3)
    per_step: int = 8
    distance: float = 0.5
    least_variance: float = 1e-3
    neglected: float = 2e-3


@dataclass(frozen=True)
class Numerics:
    """The numbers that steer an estimate; hardly anybody has to change one.

    Attributes
    ----------
    noise : DataNoiseOptions
    search : SearchOptions
    diagnosis : DiagnosisOptions
    trials : TrialOptions
    pulses : PulseOptions

    Raises
    ------
    InputError
        If a number is negative or not finite.

    Examples
    --------
    >>> Numerics(search=SearchOptions(most_in_all=80)).search.most_in_all
    80
    """

    noise: DataNoiseOptions = DataNoiseOptions()
    search: SearchOptions = SearchOptions()
    diagnosis: DiagnosisOptions = DiagnosisOptions()
    trials: TrialOptions = TrialOptions()
    pulses: PulseOptions = PulseOptions()

    def __post_init__(self) -> None:
        for part, options in asdict(self).items():
            for name, value in options.items():
                for number in value if isinstance(value, list | tuple) else (value,):
                    if not 0.0 <= number < math.inf:
                        raise InputError(
                            f"{part}: found {name} = {number:g}, expected a finite number of 0 or "
                            "more"
                        )


# --- what users ask -------------------------------------------------------------------------------


@dataclass(frozen=True)
class FitOptions:
    """What a fit is asked.

    Attributes
    ----------
    observables : sequence of {"current", "reader", "tip", "bridge"}, optional
        Option I of the paper is ``["current"]``, option II ``["current", "reader"]``, option
        III adds the tip. All that the measurement has, by default.
    fixed : mapping of str to float or None
        Parameters to hold, at a value or (None) at the probe's.
    robust : bool
        Lessen the weight of points far from the others' fit: from 3.5 standard deviations on, as
        the median absolute residual tells them, down to nothing beyond 6. With priors this is done
        wherever there are enough data to tell.
    weights : {"maximum", "errors"}
        Divide every observable by its largest measured value, as in the paper, or every datum by
        its measurement error; an observable without errors then takes its scatter about the fit.
    medium : {"vacuum", "air", "unknown"}, optional
        What the lever was measured in; wins over measurement and probe. If it is unknown both are
        tried (`hotlever.estimate.estimator`).
    priors : mapping of str to Prior or str
        What is known before, of parameters of the material, dimensions, the circuit or the scales
        of meters, also as text (`hotlever.probe.priors`); all that have a prior are varied.
    usual_priors : bool
        Whether what is usually known beforehand counts where no prior is stated, as it does in a
        calibration (`hotlever.probe.priors.default_priors`).
    free : sequence of str
        What else is varied, beside what usually is.
    usual : sequence of str
        What usually is: by default the six parameters of the paper's lever. A fit takes what its
        probe is made of (`hotlever.probe.probe_parameters.usual_parameters`), and one of what was
        measured in time the scales of the heat capacities.
    numerics : Numerics
        What steers how the estimate is found.

    Raises
    ------
    InputError
        If a name does not exist, with the nearest that does.
    """

    observables: Sequence[str] | None = None
    fixed: Mapping[str, float | None] = field(default_factory=dict)
    robust: bool = False
    weights: Weights = "maximum"
    medium: Medium | Literal["unknown"] | None = None
    priors: Mapping[str, Prior | str] = field(default_factory=dict)
    usual_priors: bool = False
    free: Sequence[str] = ()
    usual: Sequence[str] = tuple(PARAMETERS)
    numerics: Numerics = Numerics()

    def __post_init__(self) -> None:
        for name in self.fixed:
            for others, what in ((self.priors, "has a prior"), (self.free, "is free")):
                if name in others:
                    raise InputError(f"{name} is fixed and {what}, expected one of them")
        for kind, names, existing in (
            ("weights", [self.weights], get_args(Weights)),
            ("observable", self.observables or (), tuple(FITTED)),
            (
                "medium",
                [] if self.medium is None else [self.medium],
                (*get_args(Medium), "unknown"),
            ),
        ):
            for name in names:
                if name not in existing:
                    raise unknown_name(kind, str(name), existing)
        if self.observables is None:
            return
        if not self.observables:
            raise InputError(f"no observables; expected some of {', '.join(FITTED)}")
        chosen = tuple(name for name in FITTED if name in self.observables)
        object.__setattr__(self, "observables", chosen)

    @property
    def varied(self) -> list[str]:
        """All parameters to find."""
        named = dict.fromkeys([*self.usual, *self.priors, *self.free])
        return [name for name in named if name not in {*self.fixed, *SCALES}]

    def of(self, probe: Probe, *, in_time: bool = False) -> FitOptions:
        """Return the options for a probe: what usually varies is what it is made of.

        Raises
        ------
        InputError
            If it has no such parameter as is fixed or free, with the nearest that it has; or if
            all are fixed.
        """
        existing = of_materials(probe, in_time=in_time)
        for name in self.fixed:
            if name not in existing:
                raise unknown_name("parameter", name, existing)
        for name in self.free:
            parameter_of(probe, name, in_time=in_time)
        usual = heat_capacities(probe) if in_time else usual_parameters(probe)
        own = replace(self, usual=usual)
        if not own.varied:
            raise InputError("all parameters are fixed; nothing is left to fit")
        return own

    @property
    def media(self) -> tuple[Medium | None, ...]:
        """What is to be tried: None is what measurement and probe say."""
        return get_args(Medium) if self.medium == "unknown" else (self.medium,)

    def values(self) -> dict[str, Any]:
        """Return the options as plain values."""
        values = asdict(self) | {"fixed": dict(self.fixed), "free": list(self.free)}
        if not values["usual_priors"]:
            del values["usual_priors"]
        if tuple(values.pop("usual")) != tuple(PARAMETERS):
            values["usual"] = list(self.usual)
        return values | _unusual(values.pop("numerics"))


@dataclass(frozen=True)
class CalibrationOptions:
    """What a calibration is asked.

    Attributes
    ----------
    law : PowerLaw, optional
        A power law in vacuum, in place of a model. It takes a lever that only the swept supply
        heats.
    medium : {"vacuum", "air", "unknown"}, optional
        What the lever is in; by default what the data file says, or else the fit or the probe. If
        it is unknown both are tried. With vacuum for data from air the paper's rule is used: the
        temperatures that the probe has in vacuum, at k times the power.
    priors : mapping of str to Prior or str, optional
        What is known beforehand, in place of some of the usual priors, such as
        ``{"n_d": "3.3e17 ± 15%"}``; see `hotlever.probe.priors`. If empty there are none, and
        dimensions are held.
    pulse : PulseTiming, optional
        Of pulses whose tip temperature is wanted too (`hotlever.estimate.pulses`).
    samples : int
        Of the posterior, at least, from which the limits of the tip temperature are taken; by
        default they follow from its linearised error, or estimates of hotter and colder levers.
    at_V : float, optional
        Bias of the uncertainty budget; that of the hottest tip by default.
    budget_of : {"tip", "apex"}
        What the uncertainty budget is of: the tip, or its apex that touches a sample.
    numerics : Numerics
        What steers how the estimate is found.

    Raises
    ------
    InputError
        If a name does not exist, with the nearest that does, or options exclude each other.
    """

    law: PowerLaw | None = None
    medium: Medium | Literal["unknown"] | None = None
    priors: Mapping[str, Prior | str] | None = None
    pulse: PulseTiming | None = None
    samples: int = 0
    at_V: float | None = None
    budget_of: BudgetOf = "tip"
    numerics: Numerics = Numerics()

    def __post_init__(self) -> None:
        if self.law is not None and self.medium not in (None, "vacuum"):
            raise InputError("a power law holds in vacuum; with one, leave the medium out")
        if self.law is not None and self.priors is not None:
            raise InputError("a power law takes no priors; a probe or a fit does")
        if self.budget_of not in get_args(BudgetOf):
            raise InputError(
                f"an uncertainty budget of '{self.budget_of}': expected "
                f"{' or '.join(get_args(BudgetOf))}, of which it is at rest (the errors of a pulse "
                "by source are in its table)"
            )

    @property
    def of_lever(self) -> FitOptions:
        """What of the lever is estimated, and beside which priors."""
        usual = self.priors is None or bool(self.priors)
        return FitOptions(
            priors=self.priors or {},
            usual_priors=usual,
            medium=self.medium,
            numerics=self.numerics,
        )

    def need_none_of_the_rule(self) -> None:
        """Raise an error if something is asked that the paper's rule has not."""
        lacks = {
            "has no posterior": self.samples > 0,
            "has no uncertainty budget": self.at_V is not None or self.budget_of != "tip",
            "says nothing about a pulse": self.pulse is not None,
        }
        for lack, is_requested in lacks.items():
            if is_requested:
                raise InputError(
                    f"the paper's rule {lack}; expected a probe or a fit, in the medium of the data"
                )

    def values(self) -> dict[str, Any]:
        """Return as plain values what does not say of the lever what is estimated."""
        return {
            "power_law": None if self.law is None else self.law.model_dump(),
            "pulse": None if self.pulse is None else asdict(self.pulse),
            "samples": self.samples,
            "budget_of": self.budget_of,
            **_unusual(asdict(self.numerics)),
        }


def _unusual(numerics: dict[str, Any]) -> dict[str, Any]:
    """Return what steers an estimate as plain values, if it is not what usually does."""
    return {} if numerics == asdict(Numerics()) else {"numerics": numerics}


Options = TypeVar("Options", FitOptions, CalibrationOptions)


def chosen(kind: str, options: Options, choices: Mapping[str, Any]) -> Options:
    """Return the options of a fit or a calibration with some of them chosen by name.

    Raises
    ------
    InputError
        If there is no such option; the text gives the nearest one.
    """
    names = list(type(options).__dataclass_fields__)
    for name in choices:
        if name not in names:
            raise unknown_name("option", name, names, kind)
    return replace(options, **choices)
