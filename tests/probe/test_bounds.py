"""Every number of a probe file has bounds, within which a lever is solved or an error says why."""

from __future__ import annotations

import numpy as np
import pytest

from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.lever import Lever
from hotlever.materials import PARAMETERS, PUBLISHED, Material
from hotlever.probe import Circuit, MeshOptions, Probe, ThreeLeg, Tip, UShape, mesh_layout
from hotlever.probe.circuit import Contact
from hotlever.probe.mesh import mesh_solid

RECORDS = (ThreeLeg, UShape, Circuit, Contact, Material, Tip)
NUMBERS = (float, int, float | None)


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.__name__)
def test_every_number_has_bounds_and_a_meaning(record):
    for name, field in record.model_fields.items():
        if field.annotation in NUMBERS:
            bounds = {type(one).__name__ for one in field.metadata}
            assert {"Ge", "Le"} <= bounds, name
            assert record.description()[name]


def test_a_fit_stays_inside_the_bounds_of_a_material():
    material = next(iter(PUBLISHED.values())).material
    for name, known in PARAMETERS.items():
        for bound in (known.lower, known.upper):
            assert getattr(material.with_(**{name: bound}), name) == bound


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("length_um", 1e6, "at most 2000"),
        ("heater_length_um", 1e-3, "at least 0.05"),
        ("thickness_um", 0.0, "at least 0.01"),
        ("series_resistance_ohm", 1e8, r"at most 1\d*"),
        ("n_d", 1e300, "at most 2"),
        ("n_hd", 1e23, "at most 1"),
        ("surface_gap_um", 1e-9, "at least 0.001"),
        ("accommodation", 1e-300, "at least 0.01"),
        ("thickness_um", True, "a number"),
        ("gap_um", "3.2", "a number"),
        pytest.param("gap_um", 10**5000, "gap_um = a very long int: expected a number", id="huge"),
        ("gap_um", [[1] * 1000], r"gap_um = \[\[1, 1.*…: expected a number"),
        ("chip", 1, "true or false"),
    ],
)
def test_a_number_beyond_its_bounds_is_quoted_with_them(name, value, expected):
    with pytest.raises(InputError, match=expected) as caught:
        Probe.reference().with_(**{name: value})
    assert len(str(caught.value)) < 150


@pytest.mark.parametrize("shape", [["three-leg"], {"a": 1}, 7, None])
def test_a_shape_that_is_no_name_is_refused(shape):
    with pytest.raises(InputError, match=r"shape.*three-leg, u-shape"):
        Probe.from_sections({"probe": {"shape": shape}}, "probe")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"heater_width_um": 0.1}, "the heater is 4 µm by 0.1 µm, expected at most 30 times"),
        ({"heater_length_um": 50.575}, "the centre leg is 0.005 µm long or wide, expected 0.01"),
        ({"reader_centre_um": 2.005}, "the right leg is 0.005 µm long or wide"),
        ({"reader_centre_um": 48.575}, "the right leg front is 0.005 µm long or wide"),
        ({"heater_width_um": 12.83}, r"less than the 12.84 µm .* by 0.02 µm"),
    ],
)
def test_parts_that_cannot_be_meshed_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        Probe.reference().with_(**values)


THIN = {"heater_length_um": 0.3945, "heater_width_um": 0.05, "centre_leg_width_um": 0.05}


def test_a_mesh_with_a_hole_is_an_error():
    """Netgen reports a face that it cannot mesh on the terminal only."""
    values = {"length_um": 2000.0, "outer_leg_width_um": 1000.0, "gap_um": 1000.0, **THIN}
    values |= {"reader_length_um": 29.85, "reader_centre_um": 998.1}
    layout = Probe.reference().with_(**values).layout()
    with pytest.raises(ComputationError, match="Netgen could not mesh this layout"):
        mesh_layout(layout)


def test_a_lever_too_fine_for_the_air_is_refused_before_gigabytes():
    probe = Probe.reference().with_(length_um=300.0, gap_um=100.0, thickness_um=0.01, medium="air")
    with pytest.raises(ComputationError, match=r"air: this lever takes \d+ panels, more than 8000"):
        Lever(probe)


@pytest.mark.parametrize("values", [{"thickness_um": 0.01}, {"thickness_um": 20.0}])
def test_a_lever_too_fine_for_tetrahedra_is_refused_before_hours(values):
    with pytest.raises(InputError, match="takes too many tetrahedra"):
        mesh_solid(Probe.reference().with_(**values).layout())


def corner(rng: np.random.Generator) -> Probe:
    """Draw a lever of dimensions at or between their bounds."""
    while True:
        probe = Probe.reference() if rng.random() < 0.5 else Probe.u_shape()
        values = {}
        for name, field in type(probe.shape).model_fields.items():
            if name not in ("shape", "reader_centre_um", "edge_bias_um"):
                low, high = sorted(
                    one.ge if hasattr(one, "ge") else one.le for one in field.metadata
                )
                between = float(np.exp(rng.uniform(np.log(low), np.log(high))))
                values[name] = rng.choice([low, high, getattr(probe.shape, name), between])
        narrowest = min(2.0, *values.values())
        values["edge_bias_um"] = narrowest * float(rng.choice([0.0, 0.45, -0.45]))
        try:
            return probe.with_(**values)
        except InputError:
            continue


@pytest.mark.parametrize("seed", range(6))
def test_at_the_corners_of_the_bounds_a_sweep_ends_or_says_why(seed):
    probe = corner(np.random.default_rng(seed))
    try:
        sweep = Lever(probe, MeshOptions(refinement=0.5)).sweep([1.0, 5.0])
    except HotleverError as error:
        sweep = getattr(error, "partial", None)
    if sweep is not None:
        np.testing.assert_allclose(sweep.ground_current_mA, sweep.current_mA, rtol=1e-6)
