"""Work shared by the machines of a cluster: joblib hands it to dask where it is told to."""

import os
from pathlib import Path

import parallel_work
import pytest

pytest.importorskip("distributed")

import joblib
from distributed import Client, LocalCluster
from factories import labelled_set

from forcelab import preset
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.parallel import map_in_processes
from forcelab.recognition.cross_validation import leave_one_out


@pytest.fixture(scope="module")
def cluster():
    workers = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(**workers) as local, Client(local) as client:
        client.run(
            lambda folder: __import__("sys").path.insert(0, folder), str(Path(__file__).parent)
        )
        with joblib.parallel_config(backend="dask"):
            yield local


def test_an_evaluation_is_the_same_on_a_cluster_as_here(cluster):
    items = labelled_set(3, rate=100.0)
    settings = preset("paper").replace(max_scale=64)
    on_cluster = finish(leave_one_out(items, settings, jobs=3)).to_json()
    here = finish(leave_one_out(items, settings)).to_json()
    for evaluation in (on_cluster, here):
        del evaluation["seconds"]
    assert on_cluster == here


def test_work_is_done_by_the_workers_and_comes_in_order(cluster):
    results = list(map_in_processes(parallel_work.doubled, range(6), 2))
    assert [number for number, _ in results] == [0, 2, 4, 6, 8, 10]
    assert os.getpid() not in {process for _, process in results}


def test_an_error_arrives_as_it_was_raised_and_stopping_early_leaves_a_cluster_that_works(cluster):
    with pytest.raises(InputError, match=r"^Number 2 cannot be done; leave it out\.$"):
        list(map_in_processes(parallel_work.refused, range(4), 2))
    making = map_in_processes(parallel_work.doubled, range(1000), 2)
    assert next(making)[0] == 0
    making.close()
    assert [number for number, _ in map_in_processes(parallel_work.doubled, range(3), 2)] == [
        0,
        2,
        4,
    ]
