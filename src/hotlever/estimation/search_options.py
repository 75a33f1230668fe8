"""Every number that steers a search, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SearchOptions:
    """What steers a search.

    Attributes
    ----------
    most_branches, most_in_all : int
        Levers solved for one choice of weights, and for all of them, after which a search ends
        where it is; robust fits without priors, which begin anew, take several times as many. Good
        data take 6 to 15; those of levers of which little is known up to 30.
    first_region, largest_region, smallest_region : float
        How far a step goes, in units of `Coordinates.room`: logarithms, where parameters are
        positive. Beyond a factor of two neighbours say little; below the last, only rounding
        errors.
    trusted, doubted : float
        The share of the predicted gain from which on the region grows, and below which it shrinks.
    decrement : float
        Sum of squares that Gauss and Newton's step would still take away at an optimum, where
        squares count standard deviations (with priors): a tenth of a standard error.
    decrement_where_rough, rough_region : float
        The same where no longer step than the latter gains anything, since values are not smooth
        there, as near a fold that moves past a row: a third of a standard error.
    relative_decrement : float
        The same in units of the noise, where weights count no standard deviations: a thirtieth of
        a standard error.
    negligible, negligible_of_misfit : float
        The same as a share of the sum of squares; the latter where that is so many times what
        noise explains that no such lever shows the data.
    misfit : float
        So many times.
    precision : float
        Differences, as shares of the largest value of an observable, of which only rounding errors
        are left.
    kept : int
        Latest predictions that tell how values bend between them.
    scatter_rounds : int
        Rounds in which an observable without measurement errors finds its scatter.
    gentle_rounds, robust_rounds : int
        Most reweightings by Huber's weights, with which there is one optimum; then by those that
        forget outliers.
    settled, settled_relative : float
        A confirmation by the full lever that moves no parameter by more than these shares of its
        standard error and of its value ends the fit: the confirmed model is exact to first order.
    confirmations : int
        Most of them.
    usual_scatter : float
        Noise that is usual, as a share of the largest value: it counts as one datum more.
    """

    most_branches: int = 25
    most_in_all: int = 40
    first_region: float = 0.5
    largest_region: float = 0.7
    smallest_region: float = 1e-6
    trusted: float = 0.7
    doubted: float = 0.25
    decrement: float = 1e-2
    decrement_where_rough: float = 0.1
    rough_region: float = 1e-3
    relative_decrement: float = 1e-3
    negligible: float = 1e-6
    negligible_of_misfit: float = 1e-3
    misfit: float = 10.0
    precision: float = 1e-7
    kept: int = 5
    scatter_rounds: int = 3
    gentle_rounds: int = 6
    robust_rounds: int = 14
    settled: float = 0.5
    settled_relative: float = 0.03
    confirmations: int = 5
    usual_scatter: float = 1e-3


@dataclass(frozen=True)
class GrowthOptions:
    """What steers a search that begins with the cold lever.

    Attributes
    ----------
    far : float
        A lever is far from data that differ from what it shows by this share of the largest
        (median).
    portions, fewest_rows : int
        By which a lever grows, the last of which is all of the rows; the least rows of one.
    widened, open : float
        By how much the usual priors are widened, and the spread of what has none, where only the
        directions are to be closed that a few cold rows leave open.
    mesh_follows : float
        Share of a dimension by which a mesh follows it well; edges' bias moves all of them.
    search : SearchOptions
        A portion is to be met within some per cent: the next moves the lever anyway.
    """

    far: float = 0.06
    portions: int = 6
    fewest_rows: int = 3
    widened: float = 4.0
    open: float = 0.5
    mesh_follows: float = 0.2
    search: SearchOptions = field(
        default_factory=lambda: SearchOptions(
            most_branches=4,
            decrement=2.0,
            scatter_rounds=0,
            first_region=0.7,
            largest_region=1.2,
        )
    )


GROWTH = GrowthOptions()
