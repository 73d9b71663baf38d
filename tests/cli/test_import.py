"""``forcelab import`` of raw dumps."""

import pytest

from forcelab.formats.optoforce_packets import KINDS
from forcelab.project import Project
from forcelab.resources import asset
from tests.formats.optoforce_streams import packet, stream


def test_a_dump_becomes_a_demonstration_and_json_tells_what_was_lost(forcelab, tmp_path):
    dump, project = tmp_path / "dump.bin", tmp_path / "p.forcelab"
    counts = [*range(50), *range(53, 100)]
    dump.write_bytes(stream(KINDS[0], counts)[0] + b"abc" + packet(KINDS[0], 100)[:9] + b"junk")
    result = forcelab(
        "import", project, dump, "--format", "optoforce", "--rate", 500, "--task", "LEGO",
        "--calibration", asset("calibrations/3-axis-40N.toml"), "--json",
    ).json  # fmt: skip
    keys = ("packets", "bad_checksums", "skipped_bytes", "missing_samples")
    assert [result[key] for key in keys] == [97, 0, 16, 3]
    with Project.open(project) as opened:
        created = opened.demonstrations.load("dump")
    assert (created.rate, created.task, created.channels[0].unit) == (500, "LEGO", "N")
    assert created.times[50] - created.times[49] == pytest.approx(4 / 500)


def test_the_same_for_people_and_what_is_no_dump(forcelab, tmp_path):
    dump = tmp_path / "dump.bin"
    dump.write_bytes(stream(KINDS[2], range(60))[0])
    result = forcelab("import", tmp_path / "p.forcelab", dump)
    assert "taken as 1000 Hz" in result.out
    assert "Forces are in counts" in result.out
    (tmp_path / "a.csv").write_text("t,a\n0,1\n1,2\n")
    refused = forcelab(
        "import", tmp_path / "p.forcelab", tmp_path / "a.csv", "--format", "optoforce"
    )
    assert "a.csv' holds 0 valid OptoForce packets" in refused.sentence
    missing = forcelab(
        "import", tmp_path / "p.forcelab", dump, "--calibration", tmp_path / "x.toml"
    )
    assert "x.toml" in missing.sentence


def test_a_second_column_of_labels_is_refused_with_the_cure(forcelab, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,fx,one,two\n" + "".join(f"{i / 10},1,a,b\n" for i in range(9)))
    result = forcelab("import", tmp_path / "p", path, "--label", "one", "--label", "two")
    assert "--label was given 2 times and names one column" in result.wrong_word
    assert "call each column 'labels of NAME' in the header" in result.wrong_word


def test_units_are_named_with_their_channels(forcelab, tmp_path):
    table = tmp_path / "pull.csv"
    table.write_text("t,fx,tx\n" + "".join(f"{n / 50},{n % 7},{n % 5}\n" for n in range(99)))
    project, units = tmp_path / "lab.forcelab", ("--unit", "fx=N", "--unit", "tx = Nm")
    assert forcelab("import", project, table, *units).status == 0
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        assert [channel.unit for channel in info.channels] == ["N", "Nm"]
    wrong = forcelab("import", project, table, "--unit", "N").wrong_word
    assert "'N' is no unit of a channel; write such as fx=N" in wrong
