#!/usr/bin/env python3
"""Extracts from many or large documents the small ones in results/ that tables need. Each names its omissions.

Usage: extract_results.py fronts TUNE.json...      of `cutproof tune SCENE --full --backend gpu --json`
       extract_results.py lockstep RUN.json...     of `cutproof run SCENE --backend host --against reference --mode lockstep`
       extract_results.py geometry RUN.json...     of `cutproof run SCENE --backend gpu --errors geometry --set detect.remove=R`, at
                                                   several sizes
       extract_results.py baselines BENCH.json...  of `cutproof bench baselines --backend gpu --particles N --seed S`
       extract_results.py solver RUN.json...       of `cutproof run SCENE --backend gpu --errors solver --error-frames 10000`
       extract_results.py isolation TEXT           of the output of `isolation_sweep --bodies 6000 --seed 1`
Then ci/results.sh makes the tables.
"""
import json
import pathlib
import re
import sys

RESULTS = pathlib.Path(__file__).resolve().parent.parent / "results"
OF_TRIALS = ("substeps", "iterations", "acceleration", "rotation", "differences", "rms_h", "max_h", "removed_otherwise",
             "seconds_per_frame")


def write(name, head, key, rows):
    lines = [f" {json.dumps(field)}: {json.dumps(value)}," for field, value in head.items()]
    lines += [f' "{key}": [', ",\n".join("  " + json.dumps(row) for row in rows), " ]"]
    (RESULTS / f"{name}.json").write_text("\n".join(["{", *lines, "}"]) + "\n", encoding="utf-8")
    print(f"results/{name}.json: {len(rows)} rows")


def fronts(documents):
    rows = []
    for _, document in documents:
        short = lambda k: {key: document["trials"][k][key] for key in OF_TRIALS}  # noqa: E731,B023
        rows.append({"scene": document["scene"].rsplit("/", 1)[-1].removesuffix(".json"), "again": document["again"],
                     "commit": document["commit"], "retardation": "retardation" in document["again"],
                     "known_h": document["reference"]["known_h"], "trials": len(document["trials"]), "as_given": short(0),
                     "front": [{"tolerance_h": point["tolerance_h"], **short(point["trial"])}
                               for point in document["front"] if point.get("trial") is not None]})
    write("h200_fronts", {"command": "cutproof tune SCENE --full --backend gpu", "device": documents[0][1]["device"],
                          "left_out": "trials off the front, distances by frame"}, "fronts", rows)


def lockstep(documents):
    rows = []
    for _, document in documents:
        run = document["against"]["lockstep"]
        rows.append({"scene": document["scene"], "particles": document["body"]["particles"],
                     "holds": document["against"]["holds"], "frames": len(document["frames"]),
                     "topology_differences": sum(run["frames"]["topology_differences"]),
                     "positions_not_compared": sum(run["frames"]["positions_not_compared"]), "greatest": run["greatest"]})
    write("cpu_lockstep_host", {"command": "cutproof run SCENE --backend host --against reference --mode lockstep",
                                "left_out": "verdicts, what each frame did"}, "scenes", rows)


def geometry(documents):
    rows = []
    for _, document in documents:
        remove = next(change.split("=")[1] for change in document["changes"] if change.startswith("--set detect.remove="))
        others = [change for change in document["changes"] if not change.startswith(("--set detect.remove=", "--particles"))]
        kept = ("cut_area", "lost_per_area", "least_per_area", "hausdorff", "skin_rms")
        rows.append({"scene": document["scene"], "particles": document["body"]["particles"], "remove": remove,
                     **({"changes": document["changes"]} if others else {}),
                     **{key: document["errors"]["geometry"][key] for key in kept}})
    write("h200_geometry", {"command": "cutproof run SCENE --errors geometry --backend gpu --set detect.remove=R --particles N",
                            "left_out": "verdicts, times, what each frame did"}, "runs", rows)


def baselines(documents):
    rows = []
    for _, document in documents:
        for row in document["rows"]:
            rows.append({"particles": document["particles_asked"], "seed": document["seed"], "name": row["name"],
                         "remove": row["settings"]["remove"], "holds": document["holds"],
                         **{key: row[key] for key in ("components", "couplings", "isolated", "equal")},
                         **{key: row["geometry"][key] for key in ("lost_per_area", "least_per_area", "hausdorff", "skin_rms")},
                         "interpenetration": row["interpenetration"]["volume"]})
    write("h200_baselines", {"command": "cutproof bench baselines --backend gpu --particles N --seed S",
                             "device": documents[0][1]["device"], "left_out": "times, settings that a name says"}, "rows", rows)


def solver(documents):
    rows = []
    for _, document in documents:
        error = document["errors"]["solver"]
        by = [frame["solved_by"] for frame in error["frames"]]
        energies = [frame["energy"] for frame in error["frames"] if frame["energy"] is not None]
        rows.append({"scene": document["scene"], "particles": document["body"]["particles"], "frames": len(by),
                     "converged": sum(frame["converged"] for frame in error["frames"]),
                     "solved_by": {what: by.count(what) for what in sorted(set(by), key=str)}, "max_h": error["max"],
                     "rms_h": error["rms"], "greatest_energy": max(energies, default=None)})
    write("h200_solver_every_frame", {"command": "cutproof run SCENE --backend gpu --errors solver --error-frames 10000",
                                      "left_out": "what each frame did, but for the greatest"}, "scenes", rows)


def isolation(text):
    # ratio, runs, then a count and a percentage of each of four
    line = re.compile(r"^ +([\d.]+|boxes) +(\d+)" + r" +(\d+) +[\d.]+ %" * 4, re.MULTILINE)
    rows = [dict(zip(("ratio", "runs", "before", "after_split", "published", "edge_cover"),
                     [found.group(1), *map(int, found.groups()[1:])])) for found in line.finditer(text)]
    write("cpu_isolation", {"command": "isolation_sweep --bodies 6000 --seed 1"}, "rows", rows)


def main(arguments):
    makers = {"fronts": fronts, "lockstep": lockstep, "geometry": geometry, "baselines": baselines,
              "solver": solver}
    if len(arguments) < 2 or arguments[0] not in {*makers, "isolation"}:
        sys.exit(__doc__)
    files = [pathlib.Path(file) for file in arguments[1:]]
    if arguments[0] == "isolation":
        return isolation(files[0].read_text(encoding="utf-8"))
    return makers[arguments[0]]([(file, json.loads(file.read_text(encoding="utf-8"))) for file in files])


if __name__ == "__main__":
    main(sys.argv[1:])
