"""Labels of a project out, through another program's own code, and in again.

``python -m tests.benchmarks.label_exchange PROJECT PYTHON...`` from the checkout: each PYTHON is
that of an environment with boris-behav-obs (7.13.9, 8.27.4, 9.15.0 and 10.0.2 were tried) or with
any of label-studio-sdk (2.1.2), pympi-ling (1.71), praatio (6.2.2) and textgrid (1.6.1). It runs
this file, too, and there nothing of forcelab is loaded. What comes back is imported into a copy of
the project that has no labels, and compared with what the project holds, segment by segment.
Aggregated events of BORIS 7 tell no time offset: there edges differ by that of the videos.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import types
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock


def through_boris(files: list[Path], out: Path) -> None:
    """Open a project as BORIS does, save it, and export its tabular and aggregated events."""
    (project,) = files
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    found = importlib.util.find_spec("boris")
    package = types.ModuleType("boris")  # without its window, which needs a player of videos
    package.__path__ = list(found.submodule_search_locations)  # type: ignore[union-attr, arg-type]
    sys.modules["boris"] = package
    sys.path += package.__path__  # BORIS 9 imports some of its modules as if they were no package's
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


def through_label_studio(files: list[Path], out: Path) -> None:
    """Check tasks as the client does, and convert them as the server's export does."""
    (file,) = files
    interface = file.with_suffix(".xml")
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


def through_pympi(files: list[Path], out: Path) -> None:
    """Read ELAN's files, and write what was read into new ones."""
    from pympi.Elan import Eaf

    for file in files:
        read, written = Eaf(str(file)), Eaf(author="pympi")
        written.remove_tier("default")
        for tier in read.get_tier_names():
            written.add_tier(tier)
            for start, end, action in read.get_annotation_data_for_tier(tier):
                written.add_annotation(tier, start, end, action)
        written.to_file(str(out / file.name))


def through_praatio(files: list[Path], out: Path) -> None:
    """Open TextGrids, and save them in the short form."""
    from praatio.textgrid import openTextgrid

    for file in files:
        grid = openTextgrid(str(file), includeEmptyIntervals=False)
        grid.save(str(out / file.name), "short_textgrid", includeBlankSpaces=True)


def through_textgrid(files: list[Path], out: Path) -> None:
    """Open TextGrids, and write them in the long form."""
    from textgrid import TextGrid  # type: ignore[import-not-found]

    for file in files:
        TextGrid.fromFile(str(file)).write(str(out / file.name))


#: The other sides: a package of an environment, what is exported for it, and what it does with it.
SIDES: list[tuple[str, str, Callable[[list[Path], Path], None]]] = [
    ("boris", "boris", through_boris),
    ("label_studio_sdk", "label-studio", through_label_studio),
    ("label_studio_sdk", "label-studio-video", through_label_studio),
    ("pympi", "elan", through_pympi),
    ("praatio", "textgrid", through_praatio),
    ("textgrid", "textgrid", through_textgrid),
]


def came_back(kind: str, out: Path) -> dict[str, list[Path]]:
    """What the other side of a format wrote."""
    if kind == "boris":
        tables = {
            f"{events}, {suffix}": sorted(out.glob(f"*{events}.{suffix}"))
            for events in ("aggregated", "tabular")
            for suffix in ("tsv", "csv")
        }
        return {"project, saved again": [out / "saved.boris"], **tables}
    if kind.startswith("label-studio"):
        what = "video" if kind.endswith("video") else "time series"
        return {what: [out / "json" / "result.json"]}
    return {"files": sorted(out.iterdir())}


def exchange(project: Path, pythons: list[str], folder: Path) -> None:
    """Export, run the other sides, import what comes back, and compare."""
    from forcelab.formats.export import exporting
    from forcelab.formats.importing import importing
    from forcelab.formats.label_files import LabelOptions, importing_labels
    from forcelab.formats.recording import ReadOptions
    from forcelab.jobs import finish
    from forcelab.project import Project
    from forcelab.review.run_result import latest_predictions

    def labels_of(path: Path) -> dict[tuple[str, str], Any]:
        """All segments of a project by demonstration and author."""
        with Project.open(path) as opened:
            return {
                (info.name, track.author): track.segments
                for info in opened.demonstrations.infos()
                for track in opened.tracks.of(info.id)
                if track.segments
            }

    def export(kind: str) -> list[Path]:
        written = finish(exporting(project, folder / kind, kind, predictions=latest_predictions))
        main = "".join(written[0].suffixes)
        return [file for file in written if file.name.endswith(main) and "_forces" not in file.name]

    def compare(what: str, copy: Path) -> None:
        """Say by how much the labels of a copy differ from those of the project, and remove it."""
        back, largest = labels_of(copy), 0.0
        assert back.keys() == stored.keys(), back.keys() ^ stored.keys()
        for key, segments in stored.items():
            assert [s.action for s in segments] == [s.action for s in back[key]], key
            for own, other in zip(segments, back[key], strict=True):
                largest = max(largest, abs(own.start - other.start), abs(own.end - other.end))
        print(f"  {what:<30} {total} segments, edges within {1000 * largest:.4f} ms", flush=True)
        shutil.rmtree(copy)

    def import_labels(what: str, files: list[Path]) -> None:
        shutil.copytree(unlabelled, copy)
        report = finish(importing_labels(copy, files, LabelOptions()))
        assert not report.trouble(), report.trouble()
        compare(what, copy)

    stored, copy = labels_of(project), folder / "copy.forcelab"
    unlabelled = Path(shutil.copytree(project, folder / "unlabelled.forcelab"))
    with Project.open(unlabelled) as opened:
        infos = opened.demonstrations.infos()
        for info in infos:
            for track in opened.tracks.of(info.id):
                opened.tracks.edit(info.id, track.author, track.segments, (), "cleared")
    assert not labels_of(unlabelled)
    total = sum(map(len, stored.values()))
    labelled = len({name for name, _ in stored})
    print(f"{labelled} of {len(infos)} demonstrations are labelled, in {len(stored)} tracks")
    print("not touched by another program:")
    kinds = ["csv", "table", "audacity", *dict.fromkeys(kind for _, kind, _ in SIDES)]
    files = {kind: export(kind) for kind in kinds}
    for kind, written in files.items():
        import_labels(kind, written)
    tasks = {info.name: info.task for info in infos}
    for kind in ("samples", "parquet"):  # these are read as recordings
        for file in export(kind):
            options = ReadOptions(task=tasks[file.name.removesuffix("".join(file.suffixes))])
            finish(importing(copy, [file], options))
        compare(kind, copy)
    for place, python in enumerate(pythons):
        print(f"{python}:", flush=True)
        side = [python, __file__, "--side"]
        done = subprocess.run(side, check=True, capture_output=True, text=True)
        for package, kind, _ in SIDES:
            if package not in done.stdout.split():
                continue
            out = folder / f"{place}-{package}-{kind}"
            out.mkdir()
            arguments = [package, kind, str(out), *map(str, files[kind])]
            subprocess.run([*side, *arguments], check=True)
            for what, back in came_back(kind, out).items():
                import_labels(f"{package}, {what}", back)


def run_side(package: str, kind: str, out: str, *files: str) -> None:
    """Let a package of this environment read exported files, and write them."""
    (convert,) = [side[2] for side in SIDES if side[:2] == (package, kind)]
    convert([Path(file) for file in files], Path(out))


if __name__ == "__main__":
    if sys.argv[1:] == ["--side"]:
        print(*{package for package, _, _ in SIDES if importlib.util.find_spec(package)})
    elif sys.argv[1] == "--side":
        run_side(*sys.argv[2:])
    else:
        with tempfile.TemporaryDirectory(dir=Path(sys.argv[1]).resolve().parent) as folder:
            exchange(Path(sys.argv[1]), sys.argv[2:], Path(folder))
