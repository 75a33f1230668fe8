"""Fits of many levers: what is stopped goes on, what dies is done again, what is bad is said."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import experiments
from hotlever.errors import ComputationError, HotleverError, InputError
from hotlever.estimate import FitOptions
from hotlever.estimate.many import Batch, fit_many, lever_names
from hotlever.lever import Lever
from hotlever.processes import Patience
from limits import processes_below

BIAS = np.linspace(2, 11, 7)
#: Two parameters are left to find: the fits are not what is tested.
OPTIONS = FitOptions(
    observables=("current", "tip"), fixed={"n_d": None, "p": None, "a0": None, "a1": None}
)
COMMAND = ("--observables", "current,tip", "--fix", "n_d", "--fix", "p", "--fix", "a0")
COMMAND += ("--fix", "a1")


TRUTHS = [0.66, 0.67, 0.68]

pytestmark = pytest.mark.usefixtures("coarse_meshes", "fits_on_coarse_meshes")


@pytest.fixture(scope="module")
def fits_on_coarse_meshes() -> Iterator[None]:
    """Let worker processes fit on coarse meshes as this one does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hotlever.estimate.many.fit", experiments.coarse_fit)
        yield


@pytest.fixture(scope="module")
def texts(coarse: Lever) -> list[str]:
    """Data of levers that differ in c_kappa."""
    texts = []
    for c_kappa in TRUTHS:
        material = coarse.probe.material.with_(c_kappa=c_kappa)
        sweep = coarse.with_material(material).sweep(BIAS)
        rows = zip(BIAS, sweep.current_mA.values, sweep.tip_K.values, strict=True)
        lines = [",".join(map(str, row)) for row in rows]
        texts.append("\n".join(["V_b (V),I_h (mA),T_tip (K)", *lines, ""]))
    return texts


@pytest.fixture
def levers(texts: list[str], tmp_path: Path) -> list[Path]:
    """Files of these data."""
    paths = [tmp_path / f"lever-{number}.csv" for number in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)
    return paths


def found(batch: Batch) -> list[float]:
    return [fit.parameters["c_kappa"].value for fit in batch.results.values()]


def test_killing_a_worker_loses_nothing(levers, tmp_path):
    killed = []

    def kill_one(done: int, total: int) -> None:
        if done == 1:
            killed.append(processes_below()[0])
            killed[0].kill()

    batch = fit_many(levers, tmp_path / "out", None, OPTIONS, processes=2, progress=kill_one)
    assert len(killed) == 1
    assert batch.exit_status == 0
    assert list(batch.results) == ["lever-0", "lever-1", "lever-2"]
    assert found(batch) == pytest.approx(TRUTHS, abs=1e-3)
    assert processes_below() == []


def test_what_was_stopped_goes_on_and_bad_files_are_said(levers, run, tmp_path):
    def stop(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    out = tmp_path / "report" / "fits"
    with pytest.raises(KeyboardInterrupt):
        fit_many(levers, out, None, OPTIONS, processes=1, progress=stop)
    written = {path: path.read_text() for path in out.iterdir()}
    assert len(written) == 2
    assert processes_below() == []

    (tmp_path / "bad.csv").write_text("V_b (V),I_h (mA)\n1,high\n")
    (tmp_path / "few.csv").write_text("V_b (V),I_h (mA),T_tip (K)\n1,0.1,\n,,\n2,,\n")
    names = ["bad.csv", "few.csv", *(path.name for path in levers)]
    status, printed, err = run("fit", *names, *COMMAND, "--processes", "1", "--report", "report")
    assert status == 2
    assert "bad.csv: line 2: I_h: found 'high', expected a number" in err
    assert "few.csv: no values of tip" in err
    assert "2 of 5 levers have their fits from before" in err
    assert "Traceback" not in err
    assert {path: path.read_text() for path in written} == written
    for path, truth in zip(levers, TRUTHS, strict=True):
        content = json.loads((out / f"{path.stem}.json").read_text())
        assert content["parameters"]["c_kappa"]["value"] == pytest.approx(truth, abs=1e-3)
        assert content["request"]["sha256"] == content["data"]["sha256"]
    for words in ("lever-2", "weighted mean", "scatter between levers"):
        assert words in printed
    table = (out / "levers.csv").read_text().splitlines()
    assert len(table) == 6
    assert sum(line.startswith(("bad.csv,", "few.csv,")) for line in table) == 2
    page = (tmp_path / "report" / "index.html").read_text()
    assert page.count("<img") == 1
    assert "few.csv: no values of tip" in page

    # all is there: no process is started, and the same table comes again
    again = run("fit", *names[2:], *COMMAND, "--report", "report")
    assert again[0] == 0
    assert again[1] == printed


@pytest.mark.slow
def test_changed_data_options_or_files_are_fitted_anew(levers, tmp_path):
    from distributed import LocalCluster

    cluster = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0")
    with cluster:
        address = cluster.scheduler_address

        def reused(options: FitOptions = OPTIONS) -> int:
            return fit_many(levers[:1], tmp_path / "out", None, options, scheduler=address).reused

        assert reused() == 0
        assert reused() == 1
        levers[0].write_text(levers[0].read_text() + "# a comment\n")
        assert reused() == 0
        (tmp_path / "out" / "lever-0.json").write_text("{damaged")
        assert reused() == 0
        assert reused(FitOptions(observables=("current",), fixed=OPTIONS.fixed)) == 0


SCHEDULER = """
import sys, time
from distributed import LocalCluster
sys.path.insert(0, sys.argv[1])
options = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "protocol": "tcp"}
cluster = LocalCluster(dashboard_address='127.0.0.1:0', **options)
print(cluster.scheduler_address, flush=True)
sys.stdin.readline()
cluster.scale(0)
time.sleep(600)
"""


@pytest.mark.parametrize(
    ("lost", "message"),
    [
        (lambda process: process.kill(), "the scheduler is lost; what was done until then"),
        pytest.param(
            lambda process: process.communicate(timeout=0.01),
            "the scheduler has no workers left",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["scheduler", "workers"],
)
def test_a_lost_cluster_is_said_and_what_was_done_is_written(
    levers, tmp_path, capfd, monkeypatch, lost, message
):
    impatient = Patience(look_s=0.5, without_workers_s=0.5)
    monkeypatch.setattr("hotlever.processes.ClusterExecutor.patience", impatient)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(
        [sys.executable, "-c", SCHEDULER, str(Path(experiments.__file__).parent)], **pipes
    ) as process:
        try:
            address = process.stdout.readline().decode().strip()

            def lose(done: int, total: int) -> None:
                if done == 1:
                    with suppress(subprocess.TimeoutExpired):
                        lost(process)

            with pytest.raises(ComputationError, match=message):
                fit_many(levers, tmp_path / "out", None, OPTIONS, scheduler=address, progress=lose)
        finally:
            process.kill()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["lever-0.json"]
    assert "Traceback" not in capfd.readouterr().err


def test_bad_levers_are_reported_by_name_and_the_others_go_on(texts, run, tmp_path):
    def lever(name: str | bytes, head: str = "", number: int = 0) -> str:
        path = Path(os.fsdecode(name))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{head}\n{texts[number]}")
        return str(path)

    names = [
        lever("cold.csv", "# base temperature (K): 77"),
        lever("wrong.csv", "# R_s (kOhm): -5.6"),
        lever("taken.csv"),
        lever("a_b/x.csv", number=1),
        lever("a/b/x.csv", number=2),
        lever("$x^{$.csv", number=0),
        lever(b"caf\xe9.csv", number=1),
    ]
    Path("link.csv").symlink_to("a_b/x.csv")
    os.link("a/b/x.csv", "hard.csv")
    same = ["a_b/../a_b/x.csv", "link.csv", "hard.csv"]
    Path("out/taken.json").mkdir(parents=True)
    outputs = ("-o", "out", "--report", "report", "--processes", "1")
    status, out, err = run("fit", *names, *same, *COMMAND, *outputs)
    assert status == 2, err
    assert len(re.findall("^hotlever: ", err, re.M)) == 3
    # what was understood of each of the others
    assert "a_b/x.csv: up (" in err
    assert "hotlever: taken.csv: out/taken.json: is a folder, expected a file name" in err
    assert "hotlever: cold.csv: " in err
    assert "base_temperature_K = 77" in err
    assert "hotlever: wrong.csv: " in err
    assert "series_resistance_ohm = -5600" in err
    fitted = {path.name for path in Path("out").glob("*.json") if path.is_file()}
    assert fitted == {"a_b_x.csv.json", "a_b_x.csv-2.json", "$x^{$.json", "caf\\udce9.json"}
    data = json.loads(Path("out/caf\\udce9.json").read_text())["data"]
    assert data["path"] == names[-1]
    assert len(out.splitlines()) >= 6
    assert Path("report/lever_parameters.pdf").stat().st_size > 1000


@pytest.mark.parametrize("names", [("one.json", "two.json"), ("one.csv", "levers.csv")])
def test_a_batch_overwrites_no_input(texts, run, tmp_path, names):
    for name in names:
        Path(name).write_text(texts[0])
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    status, _, err = run("fit", *names, *COMMAND, "-o", ".")
    assert status == 2
    assert f"{names[1]}: is an input of this command" in err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_what_fails_for_one_lever_is_a_failure_of_its_own(levers, texts, tmp_path, monkeypatch):
    """A geometry that cannot be reduced, and a file that cannot be written."""
    levers[0].write_text(f"# base temperature (K): 300\n{texts[0]}")
    make = Lever.__init__

    def fail(self, probe, *arguments, **options):
        if probe.circuit.base_temperature_K == 300:
            raise RuntimeError("Factor is exactly singular")
        make(self, probe, *arguments, **options)

    def full(path: Path, text: str) -> None:
        if path.stem == "lever-1":
            raise HotleverError(f"{path}: cannot be written (No space left on device)")
        path.write_text(text)

    monkeypatch.setattr(Lever, "__init__", fail)
    monkeypatch.setattr("hotlever.estimate.estimate.write_text", full)
    batch = fit_many(levers, tmp_path / "out", None, OPTIONS, processes=1)
    assert list(batch.results) == ["lever-2"]
    assert batch.exit_status == 1
    geometry, file = (str(batch.failures[str(path)]) for path in levers[:2])
    assert geometry.endswith("RuntimeError: Factor is exactly singular")
    assert "No space left" in file


def test_levers_of_the_same_name_are_told_apart_by_their_folders():
    named = lever_names(["w1/a.csv", "w2/a.csv", "w2/b.csv", "w1/a.csv"])
    assert named == {
        "w1_a.csv": Path("w1/a.csv"),
        "w2_a.csv": Path("w2/a.csv"),
        "b": Path("w2/b.csv"),
    }


def test_the_worst_failure_decides_the_exit_status():
    batch = Batch(failures={"a": ComputationError("no convergence")})
    assert batch.exit_status == 1
    batch.failures["b"] = InputError("no such file")
    assert batch.exit_status == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "2 data files: expected -o FOLDER or --report DIR"),
        (("-o", "out", "--fix", "nd"), "did you mean 'n_d'"),
        (("-o", "out", "--processes", "0"), "--processes 0: expected a number from 1"),
        (
            ("-o", "out", "--processes", "2", "--scheduler", "tcp://a:1"),
            "expected only one of them",
        ),
        (("-o", "a.csv"), "a.csv: cannot be made a folder"),
        (("-o", "out", "--scheduler", "tcp://127.0.0.1:1"), "no scheduler answers there"),
    ],
)
def test_requests_for_many_levers_that_cannot_be_met(run, monkeypatch, arguments, message):
    monkeypatch.setattr("hotlever.processes.ClusterExecutor.patience", Patience(scheduler_s=1.0))
    for name in ("a.csv", "b.csv"):
        Path(name).write_text("V_b (V),I_h (mA)\n1,0.1\n")
    status, out, err = run("fit", "a.csv", "b.csv", *arguments)
    assert status == 2
    assert message in err
    assert len(re.findall("^hotlever: ", err, re.M)) == 1
    assert out == ""
    assert not Path("out").exists()
