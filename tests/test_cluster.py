"""Work shared by the workers of a Dask scheduler; all of them are processes of their own here."""

import json
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import parallel_work
import pytest

pytest.importorskip("distributed")

from distributed import Client
from factories import labelled_set, synthetic_set

from forcelab import preset
from forcelab.cli import main
from forcelab.cluster import join_cluster
from forcelab.errors import ForcelabError, InputError
from forcelab.jobs import finish
from forcelab.labels import Track
from forcelab.measure.recognition import VARIANTS, measure_variants
from forcelab.parallel import run_job, share_work
from forcelab.project import Project
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.training import training_job

HELPERS = str(Path(__file__).parent)
PATIENCE = 60.0
SETTINGS = preset("paper").replace(max_scale=64, classifier="naive-bayes")


class DaskProcesses:
    """A scheduler on a free port of this machine, and workers that come and go."""

    def __init__(self, folder):
        self._file = folder / "scheduler.json"
        self._started = [self._start("scheduler", "--host", "127.0.0.1", "--port", "0")]
        self.address = self._read_address()

    def _start(self, what, *options):
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options]
        # A piece of work may take one worker with it, and no second one.
        own = {"PYTHONPATH": HELPERS, "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
        return subprocess.Popen(
            [*command, "--scheduler-file", self._file, "--no-dashboard"],
            env=os.environ | own,
            stderr=subprocess.DEVNULL,
        )

    def _read_address(self):
        deadline = time.monotonic() + PATIENCE
        while not self._file.exists() or not self._file.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.02)
        return json.loads(self._file.read_text())["address"]

    def have_workers(self, count):
        with Client(self.address, set_as_default=False) as client:
            present = len(client.scheduler_info(n_workers=-1)["workers"])
            for _ in range(count - present):
                options = "--nthreads", "2", "--no-nanny", "--host", "127.0.0.1"
                self._started.append(self._start("worker", *options))
            client.wait_for_workers(count, timeout=PATIENCE)

    def kill_workers(self):
        for process in self._started[1:]:
            process.kill()
            process.wait()

    def end(self):
        for process in reversed(self._started):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def processes(tmp_path_factory):
    started = DaskProcesses(tmp_path_factory.mktemp("dask"))
    yield started
    started.end()


@pytest.fixture
def address(processes):
    processes.have_workers(2)
    return processes.address


def test_a_scheduler_without_workers_is_refused(processes):
    with pytest.raises(InputError, match=r"has no worker; start some by 'dask worker tcp://127"):
        join_cluster(processes.address).__enter__()


def test_an_evaluation_is_the_same_on_a_cluster_as_here(address):
    items = labelled_set(3, rate=100.0)
    with join_cluster(address) as cluster:
        there = finish(leave_one_out_job(items, SETTINGS)).to_json()
        assert cluster.report().startswith(f"2 workers of {address} did 3 pieces of work in ")
    here = finish(leave_one_out_job(items, SETTINGS)).to_json()
    for evaluation in (there, here):
        del evaluation["seconds"]
    assert there == here


def test_a_recogniser_that_a_worker_trained_is_that_of_here(address):
    train, (held,) = labelled_set(3, rate=100.0)[:2], labelled_set(3, rate=100.0)[2:]
    with join_cluster(address) as cluster:
        there = finish(run_job(training_job, train, SETTINGS))
        assert "did 1 piece of work" in cluster.report()
    here = finish(run_job(training_job, train, SETTINGS))
    assert there.predict(held.demonstration).segments == here.predict(held.demonstration).segments


def test_recognition_is_measured_by_the_workers_with_the_errors_of_here(address):
    items = labelled_set(3, rate=100.0)
    variants = [v for v in VARIANTS if v.setting in {"naive-bayes", "decision-tree"}]
    with join_cluster(address) as cluster:
        there = finish(measure_variants(items, variants, "three"))
        assert "did 1 piece of work" in cluster.report()  # both have the same features
    here = finish(measure_variants(items, variants, "three"))
    assert [row.error for row in there] == [row.error for row in here]
    assert all(row.seconds > 0 for row in there)


def test_work_is_done_by_the_workers_and_comes_in_order(address):
    with join_cluster(address):
        results = list(share_work(parallel_work.doubled, range(6), 2))
    assert [number for number, _ in results] == [0, 2, 4, 6, 8, 10]
    assert os.getpid() not in {process for _, process in results}


def test_an_error_arrives_as_it_was_raised_and_stopping_early_leaves_a_cluster_that_works(address):
    with join_cluster(address):
        with pytest.raises(InputError, match=r"^Number 2 cannot be done; leave it out\.$"):
            list(share_work(parallel_work.refused, range(4), 2))
        with pytest.raises(FileNotFoundError):
            list(share_work(parallel_work.read_missing_file, range(2), 2))
        making = share_work(parallel_work.doubled, range(1000), 2)
        assert next(making)[0] == 0
        making.close()
        results = share_work(parallel_work.doubled, range(3), 2)
        assert [number for number, _ in results] == [0, 2, 4]


def test_a_command_joins_the_scheduler_that_it_is_told(address, tmp_path, capsys):
    path = tmp_path / "p.forcelab"
    with Project.create(path) as project:
        for demonstration, segments in synthetic_set(3, 100.0, "foam", 1):
            project.demonstrations.add(demonstration, [Track("Ann", segments)])
    options = ["--max-scale", "64", "--classifier", "naive-bayes", "--scheduler", address]
    assert main(["evaluate", str(path), *options]) == 0
    assert f"forcelab: 2 workers of {address} did 3 pieces of work in" in capsys.readouterr().err


def test_a_worker_of_another_version_is_refused(address, monkeypatch):
    monkeypatch.setattr("forcelab.cluster.__version__", "9.9")
    with pytest.raises(InputError, match=r"has forcelab \S+, and this is 9\.9; install the same"):
        join_cluster(address).__enter__()


# From here on workers are killed; so many are started anew as the next test needs.


def test_what_a_lost_worker_did_is_done_again_and_said(address, tmp_path):
    items = [(number, tmp_path / "killed") for number in range(5)]
    with join_cluster(address) as cluster:
        assert list(share_work(parallel_work.killed_once, items, 2)) == [0, 1, 2, 3, 4]
        report = cluster.report()
    # Which other piece that worker had done and not yet handed over differs.
    again = r" 1 worker went missing: (1 piece|2 pieces) had to be done again, \d\.\d s of work\.$"
    assert re.search(again, report)


def test_work_that_takes_every_worker_with_it_ends_in_a_sentence(address):
    with (
        join_cluster(address),
        pytest.raises(ForcelabError, match=r"^Every worker of tcp://\S+ that took on a piece of"),
    ):
        list(share_work(parallel_work.killed, [1], 2))


def test_work_that_no_worker_is_left_for_ends_in_a_sentence(processes, monkeypatch):
    processes.have_workers(1)
    monkeypatch.setattr("forcelab.cluster.PATIENCE", 0.5)
    monkeypatch.setattr("forcelab.cluster.LOOK_EVERY", 0.1)
    with join_cluster(processes.address):
        timer = threading.Timer(0.2, processes.kill_workers)
        timer.start()
        with pytest.raises(ForcelabError, match=r"^No worker of tcp://\S+ is left; start some by"):
            list(share_work(parallel_work.lasting, [1, 2], 2))
        timer.join()


@pytest.mark.parametrize("address", ["nonsense", "127.0.0.1:1", "tcp://127.0.0.1:1"])
def test_where_no_scheduler_answers_the_sentence_says_how_to_start_one(address):
    with pytest.raises(InputError, match=rf"answers at '{address}'; start one by 'dask schedul"):
        join_cluster(address).__enter__()
