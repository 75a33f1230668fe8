"""A fit file is input like any other: read back whole, or refused in one line."""

from __future__ import annotations

import json

import pytest

from hotlever.errors import InputError
from hotlever.estimate import read_fit
from made_up import GONE, damaged


@pytest.fixture(scope="module")
def content(noisy_fit):
    return json.loads(json.dumps(noisy_fit.content()))


def nested(depth):
    value = []
    for _ in range(depth):
        value = [value]
    return value


@pytest.mark.parametrize(
    ("keys", "value"),
    [
        (("data",), 3),
        (("data",), GONE),
        (("correlation", "names"), None),
        (("correlation", "names"), ["nd"]),
        (("correlation", "matrix"), [[1.0]]),
        (("correlation", "matrix", 0), nested(60)),
        (("correlation", "matrix", 0, 0), -1.0),
        (("correlation", "matrix", 0, 1), 10.0),
        (("parameters",), []),
        (("parameters",), {}),
        (("parameters", "n_d", "value"), "much"),
        (("parameters", "n_d", "value"), 1e17),
        (("parameters", "n_d", "value"), 10**400),
        (("parameters", "n_d", "value"), float("nan")),
        (("parameters", "n_d", "stderr"), -1.0),
        (("observables",), ["voltage"]),
        (("data", "columns", "V_b"), []),
        (("data", "columns", "V_b", 3), "3 V"),
        (("data", "weights"), [[1.0]]),
        (("probe",), {"probe": {"shape": "four-leg"}}),
        (("probe", "material", "n_d"), -1.0),
        (("options",), None),
        (("options", "medium"), "water"),
        (("options", "observables"), []),
        (("options", "fixed"), {"nothing": None}),
        (("options", "priors"), {"n_d": "rubbish"}),
        (("band",), {"bias_V": [1.0]}),
        (("common_noise_covariance",), [[1.0, 2.0]]),
        (("notes",), "none"),
        (("evaluations",), 1.5),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(content, tmp_path, keys, value):
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(damaged(content, *keys, value=value)))
    with pytest.raises(InputError, match=r"fit\.json") as refused:
        read_fit(path)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize("text", ["", "3", "[]", "{", '{"a": ' * 1000 + "1" + "}" * 1000])
def test_what_is_no_fit_file_is_refused(tmp_path, text):
    (tmp_path / "fit.json").write_text(text)
    with pytest.raises(InputError, match=r"fit\.json"):
        read_fit(tmp_path / "fit.json")
