"""Labels of a project out, through another program's own code, and in again.

``python -m tests.benchmarks.label_exchange PROJECT PYTHON...`` from the checkout: each PYTHON is
that of an environment with boris-behav-obs (7.13.9, 8.27.4 and 10.0.2 were tried) or with
label-studio-sdk (2.1.2). It runs this file, too, and there nothing of forcelab is loaded. Printed
is what was compared, and by how much the edges of segments differ. Aggregated events of BORIS 7
tell no time offset: there they differ by that of the videos.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import types
from decimal import Decimal
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock


def through_boris(project: Path, out: Path) -> None:
    """Open a project as BORIS does, save it, and export its tabular and aggregated events."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    found = importlib.util.find_spec("boris")
    package = types.ModuleType("boris")  # without its window, which needs a player of videos
    package.__path__ = list(found.submodule_search_locations)  # type: ignore[union-attr, arg-type]
    sys.modules["boris"] = package
    for player in ("mpv", "boris.mpv", "boris.mpv2"):
        sys.modules[player] = MagicMock()
    import boris.config as cfg  # type: ignore[import-not-found]
    import tablib  # type: ignore[import-not-found]
    from boris import (  # type: ignore[import-not-found]
        export_observation,
        project_functions,
        version,
    )

    _, changed, content, message = project_functions.open_project_json(str(project))
    assert "error" not in content, content
    wrong = project_functions.check_project_integrity(
        content, "s", str(project), media_file_available=False
    )
    print(
        f"BORIS {version.__version__} opens it; changed {changed}, {message + wrong or 'no fault'}"
    )
    ethogram = content[cfg.ETHOGRAM]
    parameters = {
        "selected subjects": ["No focal subject"],
        "selected behaviors": [entry["code"] for entry in ethogram.values()],
        "time": cfg.TIME_EVENTS,
        "start time": None,
        "end time": None,
    }
    old = version.__version__.startswith("7")
    for kind in ("tsv", "csv"):
        rows = []
        for id_, observation in content[cfg.OBSERVATIONS].items():
            file = str(out / f"{id_}.tabular.{kind}")
            arguments = [parameters, id_, observation, ethogram, file, kind]
            if old:
                fine, why = export_observation.export_events(*arguments)
            else:
                fine, why = export_observation.export_tabular_events(content, *arguments)
            assert fine, why
            data = export_observation.export_aggregated_events(content, parameters, id_)
            rows += list(data[0] if isinstance(data, tuple) else data)
        # The window puts the header on, of which this is a copy.
        header = "Observation id,Observation date,Description,"
        if old:
            header += "Media file,Total length,FPS,observer,Subject,Behavior,Behavioral category,"
            header += "Modifiers,Behavior type,Start (s),Stop (s),Duration (s),Comment start,"
        else:
            header += "Observation type,Source,Time offset (s),Coding duration,Media duration (s),"
            header += "FPS (frame/s),observer,Subject,Observation duration by subject by "
            header += "observation,Behavior,Behavioral category,Behavior type,Start (s),Stop (s),"
            header += "Duration (s),Media file name,Image index start,Image index stop,Image file "
            header += "path start,Image file path stop,Comment start,"
        table = tablib.Dataset(*rows, headers=[*header.split(",")[:-1], "Comment stop"])
        export_observation.dataset_write(table, str(out / f"aggregated.{kind}"), kind)
    plain = json.dumps(content, default=lambda v: float(v) if isinstance(v, Decimal) else str(v))
    (out / "saved.boris").write_text(plain, "utf-8")


def through_label_studio(file: Path, interface: Path, out: Path) -> None:
    """Check tasks as the client does, and convert them as the server's export does."""
    from label_studio_sdk.converter import Converter  # type: ignore[import-not-found]
    from label_studio_sdk.label_interface import (  # type: ignore[import-not-found]
        LabelInterface,
    )
    from label_studio_sdk.label_interface.control_tags import (  # type: ignore[import-not-found]
        TimelineLabelsValue,
        TimeSeriesValue,
    )

    tasks = json.loads(file.read_text("utf-8"))
    config = interface.read_text("utf-8")
    checked = LabelInterface(config)
    checked.validate()
    regions = 0
    for number, task in enumerate(tasks, start=1):
        assert checked.validate_task({"data": task["data"]}), number
        for annotation in (*task["annotations"], *task["predictions"]):
            assert checked.validate_annotation(annotation), number
            for region in annotation["result"]:
                timeline = region["type"] == "timelinelabels"
                value = TimelineLabelsValue if timeline else TimeSeriesValue
                value.model_validate(region["value"], strict=True)
                regions += 1
        task["id"] = number  # what the server adds
        for place, annotation in enumerate(task["annotations"]):
            annotation |= {"id": 100 * number + place, "completed_by": 1, "was_cancelled": False}
    print(f"label-studio-sdk finds {len(tasks)} tasks and {regions} regions valid")
    served = out / "served.json"
    served.write_text(json.dumps(tasks), "utf-8")
    converter = Converter(config, str(out))
    converter.convert_to_json(str(served), str(out / "json"), is_dir=False)
    converter.convert_to_json_min(str(served), str(out / "json_min"), is_dir=False)


def exchange(project_path: Path, pythons: list[str], out: Path) -> None:
    """Export, run the other side, and compare what comes back."""
    from forcelab.formats.export import exporting
    from forcelab.formats.label_files import read_label_file
    from forcelab.jobs import finish
    from forcelab.project import Project
    from forcelab.review.run_result import latest_predictions

    stored: dict[tuple[str, str], Any] = {}
    with Project.open(project_path) as project:
        for info in project.demonstrations.infos():
            videos = project.demonstrations.load(info.id).videos
            for track in project.tracks.of(info.id):
                stored[info.name, track.author] = track.segments, videos

    def compare(what: str, files: list[Path]) -> None:
        found = [labels for file in files for labels in read_label_file(file)]
        tracks = {
            (labels.name, track.author): (track, labels)
            for labels in found
            for track in labels.tracks
        }
        missing, number, largest = len(stored.keys() - tracks.keys()), 0, 0.0
        for key, (track, labels) in tracks.items():
            if key not in stored:
                missing += 1
                continue
            segments, videos = stored[key]
            clock = videos[0].clock if videos and labels.media else None
            assert [s.action for s in segments] == [s.action for s in track.segments], key
            for ours, theirs in zip(segments, track.segments, strict=True):
                number += 1
                for own, other in ((ours.start, theirs.start), (ours.end, theirs.end)):
                    expected = own if clock is None else float(clock.to_device(own))
                    largest = max(largest, abs(expected - other))
        print(
            f"  {what:<24} {len(tracks):>4} tracks, {missing} not of the project, {number} "
            f"segments with the same actions, edges within {1000 * largest:.4f} ms"
        )

    files = {
        kind: finish(exporting(project_path, out / kind, kind, predictions=latest_predictions))
        for kind in ("boris", "label-studio", "label-studio-video")
    }
    print("not touched by another program:")
    for kind, written in files.items():
        compare(kind, [written[0]])
    for place, python in enumerate(pythons):
        print(f"{python}:", flush=True)
        code = (
            "from importlib.util import find_spec as f; "
            "print(f('boris') is not None, f('label_studio_sdk') is not None)"
        )
        done = subprocess.run([python, "-c", code], check=True, capture_output=True, text=True)
        boris, client = done.stdout.split()
        runs = ["boris"] if boris == "True" else []
        runs += ["label-studio", "label-studio-video"] if client == "True" else []
        for kind in runs:
            side = out / f"{place}-{kind}"
            side.mkdir()
            inputs = [str(file) for file in files[kind][:2] if file.suffix != ".csv"]
            subprocess.run([python, __file__, "--side", *inputs, str(side)], check=True)
            if kind == "boris":
                compare("project, saved again", [side / "saved.boris"])
                for form in ("tsv", "csv"):
                    compare(f"aggregated, {form}", [side / f"aggregated.{form}"])
                    compare(f"tabular, {form}", sorted(side.glob(f"*.tabular.{form}")))
            else:
                compare(f"{kind}, JSON", [side / "json" / "result.json"])
                # This names no coder: all are by who imported them, the last one counts.
                read_label_file(side / "json_min" / "result.json")


if __name__ == "__main__":
    if sys.argv[1] == "--side":
        sides = [Path(argument) for argument in sys.argv[2:]]
        through_boris(*sides) if sides[0].suffix == ".boris" else through_label_studio(*sides)
    else:
        with tempfile.TemporaryDirectory(dir=Path(sys.argv[1]).resolve().parent) as folder:
            exchange(Path(sys.argv[1]), sys.argv[2:], Path(folder))
