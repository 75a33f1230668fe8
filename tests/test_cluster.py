"""The workers of a cluster: reached by TLS, with the same answers as local ones."""

from __future__ import annotations

import sys

import dask
import pytest
from distributed import LocalCluster, Security

from hotlever.errors import InputError
from hotlever.estimate.many import fit_many
from hotlever.processes import cluster_executor, run_all


def square(number: int) -> int:
    return number**2


@pytest.fixture
def credentials(tmp_path, monkeypatch):
    """Files of credentials, as the settings name them that the environment makes."""
    security = Security.temporary()
    files = {
        "ca-file": "tls_ca_file",
        "client.cert": "tls_client_cert",
        "client.key": "tls_client_key",
    }
    for attribute in files.values():
        (tmp_path / attribute).write_text(getattr(security, attribute))
    settings = {f"distributed.comm.tls.{key}": str(tmp_path / name) for key, name in files.items()}
    with dask.config.set(settings):
        yield security


def test_a_scheduler_with_tls_is_found_by_dask_s_settings(credentials):
    options = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "protocol": "tls"}
    with (
        LocalCluster(security=credentials, dashboard_address="127.0.0.1:0", **options) as cluster,
        cluster_executor(cluster.scheduler_address) as workers,
    ):
        assert cluster.scheduler_address.startswith("tls://")
        assert dict(run_all(workers, square, [(3,)])) == {0: 9}


@pytest.mark.parametrize(
    ("missing", "words"),
    [(None, "no credentials for TLS, expected .*CA_FILE is not set"), ("none.pem", "no such file")],
)
def test_tls_without_credentials_is_one_line(missing, words):
    settings = {"distributed.comm.tls.ca-file": missing}
    with dask.config.set(settings), pytest.raises(InputError, match=words):
        cluster_executor("tls://127.0.0.1:1").__enter__()


def test_a_scheduler_without_dask_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_text(
        "V_b (V),I_h (mA)\n" + "\n".join(f"{k},{k}" for k in range(1, 9))
    )
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"--scheduler tls://a:1: Dask is not installed, expected"):
        fit_many([tmp_path / "a.csv"], tmp_path / "out", scheduler="tls://a:1")
