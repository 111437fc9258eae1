#!/usr/bin/env python3
"""Makes the tables of docs/results/*.md from the documents in results/.

Usage: results.py                writes every table between `<!-- results: NAME -->` and `<!-- end -->`
       results.py --check        whether pages and documents agree; writes nothing
       results.py --self-test    whether --check finds a changed figure, a missing table and a document not cited

--check also requires that a page cites each document, or that a table or a picture reads it; that every cited document
exists; and that all together have 2 MB at most. Exit status: 0 yes, 1 no, 2 bad usage or a missing document.
"""
import argparse
import json
import math
import pathlib
import re
import shutil
import statistics
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
MOST_BYTES = 2_000_000
MARKED = re.compile(r"<!-- results: (\w+) -->\n(.*?)<!-- end -->", re.DOTALL)
CUT_SCENES = ("small_block", "kidney_arc", "kidney_discontinuous", "three_cuts", "liver_cut", "cuboid_press")
TORN = 3  # h; a Hausdorff distance beyond this means that tissue tore elsewhere than along the cut


class Documents:
    """The stored results, each read once; `read` has those."""

    def __init__(self, root):
        self.folder = root / "results"
        self.read = {}

    def __call__(self, name):
        if name not in self.read:
            try:
                self.read[name] = json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                raise SystemExit(f"results: {error}")
        return self.read[name]


# --- Figures ---------------------------------------------------------------------------------------------------------

def figure(value, digits=2):
    """A number to so many digits: with an exponent if it is small, with commas if it is great."""
    if value is None or value == "inf":
        return "–"
    if value != 0 and abs(value) < 1e-3:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    if abs(value) >= 10 ** digits:
        return f"{float(f'{value:.{digits}g}'):,.0f}"
    return f"{value:#.{digits}g}".rstrip(".")


def milliseconds(seconds):
    """The median of a time, in ms."""
    if seconds is None:
        return "–"
    return f"{seconds['median'] * 1e3:.{3 if seconds['median'] < 1e-3 else 2}f}"


def span(values, digits=2):
    low, high = f"{min(values):.{digits}f}", f"{max(values):.{digits}f}"
    return low if low == high else f"{low}–{high}"


def percent(part, whole):
    return f"{float(f'{100 * part / whole:.2g}'):,g} %"


def table(head, rows):
    for row in rows:
        assert len(row) == len(head), (head, row)
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in (head, ["---"] * len(head), *rows))


# --- README.md -------------------------------------------------------------------------------------------------------

def inconclusive(campaign):
    """Inconclusive comparisons of the step, as a part of those checked."""
    for one in campaign["properties"]:
        if one["property"] == "admissible step" and one.get("inconclusive"):
            return f"; {percent(one['inconclusive'], one['checked'])} of *admissible step* inconclusive"
    return ""


def status(read):
    rows = []
    for name, where in (("h200_fuzz_million", "H200"), ("h200_fuzz_dynamics", "H200"), ("cpu_fuzz_host", "2 CPU cores"),
                        ("cpu_fuzz_dynamics_host", "2 CPU cores")):
        one = read(name)
        devices = one.get("devices") or [0]
        rows.append([f"random {'moving cases' if one['dynamics'] else 'dissections'}",
                     f"`cutproof fuzz --backend {one['backend']}{' --devices all' if len(devices) > 1 else ''}"
                     f"{' --dynamics' if one['dynamics'] else ''} --cases {one['cases_asked']} --seed {one['seed']}`",
                     where if len(devices) == 1 else f"{len(devices)} {where}",
                     f"{len(one['violations'])} violations in {one['verdicts']:,} verdicts" + inconclusive(one)
                     + (f"; {one['seconds']:.0f} s" if one["backend"] == "gpu" else "")])  # cores had other work too
    kit = read("h200_kit_summary")
    steps = kit["steps"]
    bad = [step["name"] for step in steps if step["status"]]
    scenes = sum(step["name"].startswith("scene_") for step in steps)
    tools = sum(step["name"].startswith("sanitizer_") for step in steps)
    rows.append([f"{scenes} checked scenes, primitives, refused CUDA calls, properties, same bits twice, {tools} runs of "
                 "compute-sanitizer", "`ci/gpu_kit.sh`", "H200",
                 f"{len(steps) - len(bad)} of {len(steps)} steps pass" + (f"; not {', '.join(bad)}" if bad else "")])
    night = read("cpu_nightly")
    rows.append([f"every test, {night['cases']:,} cases a property", f"`{night['command']}`", "2 CPU cores",
                 f"{night['failed']} of {night['tests']:,} tests fail, {night['skipped']} skip by name; "
                 f"{night['seconds'] / 60:.0f} min beside other work, kernels for one kind of GPU"])
    lockstep = read("cpu_lockstep_host")["scenes"]
    differing = sum(one["topology_differences"] for one in lockstep)
    rows.append([f"lockstep with the reference, {len(lockstep)} scenes, {sum(one['frames'] for one in lockstep)} frames",
                 "`cutproof run SCENE --backend host --against reference`", "2 CPU cores",
                 f"{differing} topology differences; positions within "
                 f"{figure(max(one['greatest']['position']['max'] for one in lockstep))} h"])
    solved = read("h200_solver_every_frame")["scenes"]
    rows.append(["substeps solved independently", "`cutproof run SCENE --backend gpu --errors solver`", "H200",
                 f"{sum(one['converged'] for one in solved)} of {sum(one['frames'] for one in solved)} frames have a solution"])
    fronts = read("h200_fronts")["fronts"]
    rows.append([f"error against time, {sum(not one['retardation'] for one in fronts)} scenes",
                 "`cutproof tune SCENE --full --reference substeps`", "H200", "[front](accuracy.md#the-front-on-an-h200)"])
    campaigns = [row for row in read("h200_campaigns")["rows"] if row["backend"] == "gpu"]
    rows.append(["cases a second", "`cutproof bench campaigns --backend gpu`", "H200",
                 "; ".join(f"{'moving, ' if row['dynamics'] else ''}{figure(row['mean_particles'], 1)} particles: "
                           f"{figure(row['cases_per_second'])}" for row in campaigns)])
    rows.append(["least error rejected", "`cutproof bench sensitivity --backend gpu`", "H200",
                 "[sensitivity](accuracy.md#sensitivity)"])
    mutants = read("mutation_testing")["rows"]
    rows.append(["mutants", "`ci/mutation_testing.sh`", "CPU",
                 f"{sum(row['found'] for row in mutants)} of {len(mutants)} found; [by stage](mutation_testing.md)"])
    return table(["what", "command", "on", "outcome"], rows)


def table_1(read):
    """Clusters of boxes."""
    times, particles, clusters = {}, {}, {}
    document = read("h200_table_1")
    for row in document["rows"]:
        if row["cooking"] == "boxes":
            times[row["scene"], row["what"]] = row["seconds"], row["paper_seconds"]
    for one in document["scenes"]:
        if one["cooking"] == "boxes":
            particles[one["scene"]], clusters[one["scene"]] = one["body"]["particles"], one["body"]["clusters"]
    scenes = ("cuboid", "liver", "kidney")
    rows = [["particles", *sum(([f"{particles[one]:,}", f"{101_096:,}" if one == "kidney" else "–"]
                                for one in scenes), [])],
            ["clusters", *sum(([clusters[one], 795 if one == "kidney" else "–"]
                               for one in scenes), [])]]
    for what in ("step", "detect", "split", "merge", "expand", "skin", "frame"):
        rows.append([what, *sum(([milliseconds(times[one, what][0]), f"{times[one, what][1] * 1e3:.2f}"]
                                 for one in scenes), [])])
    return table(["", "cuboid", "paper", "liver", "paper", "kidney", "paper"], rows)


def fig_10(read):
    document = read("cpu_clusters_host")
    rows = []
    for row in document["rows"]:
        counts = row["clusters"]
        rows.append(["no merging" if row["tau"] is None else f"τ = {row['tau']:g}" + (", default" if row["tau"] == 0.5 else ""),
                     *(counts[frame] for frame in (0, 56, 64, 72, 80, 96)), f"{100 * row['growth']:+.1f} %"])
    return table(["", "start", "frame 56", "64", "72", "80", "96", "growth"], rows)


def sizes(read):
    """Frames of a cut, plain and accelerated; frames of the paper's kidneys beside its own times."""
    rows = []
    for name in ("h200_stages_rooms", "h200_stages_10M_one_condition", "h200_stages_sampled_traced"):
        document, found = read(name), {}
        for row in document["rows"]:
            found.setdefault(row["particles"], {})[row["acceleration"], row["what"]] = row
        for particles, of in found.items():
            body = next(one for one in document["scenes"] if one["body"]["particles"] == particles)
            fast = of.get(("chebyshev", "frame, cutting"))
            rows.append(["straight cut" + (", sampled" if body["cooking"] == "sampled" else ""), f"{particles:,}",
                         milliseconds(of["none", "frame, cutting"]["seconds"]),
                         milliseconds(fast["seconds"]) if fast else "–", "–",
                         figure(of["none", "step"]["error"]["max_h"]), f"{body['bytes'] / 1e6:,.0f}"])
    for row in sorted(read("h200_sampling")["rows"], key=lambda row: row["particles"]):
        rows.append(["paper's kidney", f"{row['particles']:,}", "–", milliseconds(row["seconds"]["frame"]),
                     f"{row['paper']['frame_seconds'] * 1e3:.4g}", figure(row["error"]["step"]["max_h"]), "–"])
    return table(["body", "particles", "plain", "Chebyshev", "paper", "error, h", "MB"], rows)


# --- accuracy.md -----------------------------------------------------------------------------------------------------

def without_tears(read, remove):
    return [run for run in read("h200_geometry")["runs"] if run["remove"] == remove and not run.get("changes")
            and run["scene"] != "three_cuts" and run["hausdorff"] <= TORN]


def errors(read):
    random_steps = read("h200_fuzz_dynamics")["steps_compared"]
    lockstep = read("cpu_lockstep_host")["scenes"]
    given = [one["as_given"]["rms_h"] for one in read("h200_fronts")["fronts"] if not one["retardation"]]
    nearer = without_tears(read, "nearer")
    limits = {scene: levels_of(read(f"cpu_tune_limit_{scene}")) for scene in CUT_SCENES}
    last = [levels[-1]["apart_h"] for levels in limits.values()]
    known = [known_to(read(f"cpu_tune_retarded_{scene}")) for scene in CUT_SCENES]
    known = [value for value in known if value is not None]
    bars = [row for row in read("h200_material")["rows"] if row["across"] > 10 and row["iterations"] is None]
    of_bars = lambda *tests: span([row["measured"] / row["asked"] for row in bars  # noqa: E731
                                   if row["test"] in tests and row["quantity"] in "EG"])
    return table(["error", "size", "depends on"], [
        ["implementation: single beside double precision, one frame",
         f"at most {figure(max(one['greatest']['position']['max'] for one in lockstep))} h in scenes, "
         f"{figure(random_steps['greatest_h'])} h in {random_steps['steps']:,} random steps",
         "stiffness, contacts"],
        ["solver: as given beside the same substeps solved",
         f"scenes: {figure(min(given))}–{figure(max(given))} h RMS", "k dt², iterations"],
        ["geometry: skin beside the blade's path, nearer end removed",
         f"{span([run['skin_rms'] for run in nearer])} h RMS; {span([ratio(run) for run in nearer])} times the least loss of "
         "tissue", "grid"],
        ["time step",
         f"between the last two levels {span(last)} h; with retardation known to "
         f"{figure(min(known))}–{figure(max(known))} h in {len(known)} of {len(CUT_SCENES)} cut scenes", "dt, damping"],
        ["model: moduli of [bars](material.md) over those asked, from 11 nodes across on",
         f"hanging {of_bars('hanging')}, bent and twisted {of_bars('swinging across', 'twisted')}", "clusters across"]])


def single_steps(read):
    """Of each scene: a frame in single beside double precision, and a substep beside its solution."""
    solved = {one["scene"]: one for one in read("h200_solver_every_frame")["scenes"]}
    rows = []
    for one in read("cpu_lockstep_host")["scenes"]:
        of = solved.get(one["scene"], {})
        left = one["positions_not_compared"]
        rows.append([one["scene"], figure(one["greatest"]["position"]["max"]),
                     percent(left, one["particles"] * one["frames"]) if left else "0",
                     figure(of.get("rms_h")), figure(of.get("max_h"))])
    steps = read("h200_fuzz_dynamics")["steps_compared"]
    rows.append(["random cases", figure(steps["greatest_h"]),
                 percent(steps["not_compared"], steps["particles"] + steps["not_compared"]), "–", "–"])
    return table(["scene", "implementation, greatest", "not compared", "solver, RMS", "greatest"], rows)


def ratio(run):
    return run["lost_per_area"] / run["least_per_area"]


def levels_of(document):
    levels = (document.get("reference") or document["answer"])["levels"]
    return [level for level in levels if isinstance(level["apart_h"], float)]


def known_to(document):
    """As in tuning/reference_solution.cpp, whose rule is newer than some documents."""
    levels = document["reference"]["levels"]
    apart = [level["apart_h"] for level in levels[1:]]
    same = all(level["alive_in_one"] == level["removed_in_another_frame"] == 0 for level in levels[-2:])
    if not same or not isinstance(apart[-1], float):
        return None
    falls_by = min(before / after for before, after in zip(apart, apart[1:]))
    return max(apart[-1], apart[-1] / (falls_by - 1)) if falls_by > 1 else None


def solver(read):
    rows = []
    for one in read("h200_solver")["scenes"]:
        if one["substeps"] != 1 or one["stiffness"] < 1e5:  # below, nothing is gained or lost
            continue
        reached = {of["acceleration"]: of for of in one["to_tolerance"]}
        rows.append([f"{one['scene'].split('_')[0]}, {one['particles']:,}", f"{one['stiffness']:.0e}".replace("e+0", "e"),
                     *(f"{reached[which]['iterations']}, {reached[which]['seconds'] * 1e3:.3f}"
                       for which in ("none", "chebyshev"))])
    return table(["body, particles", "k, 1/s²", "plain: iterations, ms", "Chebyshev"], rows)


def rotations(read):
    rows = []
    for one in read("h200_rotations")["methods"]:
        if one["precision"] == "single" and one["method"] != "mueller_cold":
            rows.append([f"`{one['method']}`" + (", default" if one["default"] or one["method"] == "newton" else ""),
                         figure(one["worst_gap"]), one["wrong"],
                         *(figure(one[f"{which}_seconds_per_million"]["median"] * 1e3) for which in ("near", "cold"))])
    return table(["method", "worst gap", "wrong", "near, ms", "cold, ms"], rows)


def retardation(read):
    rows = []
    for scene in (*CUT_SCENES, "uniform_stretch"):
        damped = read(f"cpu_tune_retarded_{scene}")
        apart = {level["substeps"]: level["apart_h"] for level in levels_of(damped)}
        plain = {}
        if scene in CUT_SCENES:
            plain = {level["substeps"]: level["apart_h"] for level in levels_of(read(f"cpu_tune_limit_{scene}"))}
        known = known_to(damped)
        order = math.log2(apart[256] / apart[512]) if 512 in apart else None
        rows.append([scene, *(figure(plain.get(level)) for level in (64, 128, 256, 512)),
                     *(figure(apart.get(level)) for level in (64, 128, 256, 512)),
                     "–" if order is None else f"{order:.2f}", "not known" if known is None else figure(known)])
    return table(["scene", "64", "128", "256", "512", "retarded: 64", "128", "256", "512", "order", "limit known to"], rows)


FRONT_SCENES = ("small_block", "kidney_arc", "three_cuts", "cuboid_press", "liver_cut", "irregular_sampled", "kidney_101096")


def front(read):
    rows = []
    for one in read("h200_fronts")["fronts"]:
        if one["scene"] not in FRONT_SCENES or one["retardation"]:
            continue
        given, cells = one["as_given"], []
        for tolerance in (0.5, 0.05, 0.01):
            within = next((point for point in one["front"] if point["tolerance_h"] == tolerance), None)
            cells.append(f"{milliseconds(within['seconds_per_frame'])} ({steps_of(within)})" if within else "–")
        rows.append([one["scene"],
                     f"{milliseconds(given['seconds_per_frame'])} ({steps_of(given)}): {figure(given['rms_h'])}", *cells])
    return table(["scene", "as given: error", "0.5 h", "0.05 h", "0.01 h"], rows)


def steps_of(trial):
    return f"{trial['substeps']}×{trial['iterations']}" + ("p" if trial["acceleration"] == "none" else "")


def geometry(read):
    rows = []
    for scene in CUT_SCENES:
        runs = {remove: [run for run in without_tears(read, remove) if run["scene"] == scene]
                for remove in ("both", "one", "nearer")}
        if not runs["nearer"]:
            continue
        rows.append([scene, *(span([ratio(run) for run in runs[remove]]) for remove in ("both", "one", "nearer")),
                     span([run["hausdorff"] for run in runs["nearer"]], 1),
                     span([run["skin_rms"] for run in runs["nearer"]])])
    return table(["scene", "both: × least", "one", "nearer", "Hausdorff", "skin RMS"], rows)


def baselines(read):
    rows = []
    for name in ("this method", "nearer end of each edge", "strain detection", "no expansion", "particles deleted, no split",
                 "clusters deleted, no split"):
        cells = ["both ends of each edge" if name == "this method" else name]
        for particles in (1000, 10000, 100000):
            runs = [row for row in read("h200_baselines")["rows"] if row["name"] == name and row["particles"] == particles]
            cells.append(f"{statistics.median(ratio(run) for run in runs):.2f}")
            if particles == 10000:
                cells += [f"{statistics.median(run['hausdorff'] for run in runs):.1f}",
                          span([run["components"] for run in runs], 0), span([run["couplings"] for run in runs], 0)]
        rows.append([*cells[:2], *cells[2:3], cells[6], *cells[3:6]])
    return table(["method", "1,000", "10,000", "100,000", "Hausdorff", "pieces", "couplings"], rows)


SEEN = (("position", "step", "h"), ("velocity", "step", "h/dt"), ("rotation", "step", "rad"), ("gravity", "step", "relative"),
        ("stiffness", "step", "relative"), ("friction", "step", "relative"), ("impulse between pieces", "step", "weights"),
        ("mass", "split", "relative"), ("rest center", "split", "h"),
        ("skin vertex", "skin", "h"))


def sensitivity(read):
    found = {(row["scene"], row["disturbance"], row["stage"]): row for row in read("h200_sensitivity")["rows"]}
    rows = []
    for what, stage, unit in SEEN:
        of = [found.get((scene, what, stage)) for scene in ("small_block", "kidney_discontinuous")]
        if what == "friction":
            of = [found["small_block, sliding", what, stage], None]
        goal = "met" if all(row["within_goal"] for row in of if row) else "missed"
        rows.append([f"{what}, {unit}", stage, *(figure(row["least"]) if row else "–" for row in of), goal])
    return table(["disturbance", "after", "small_block", "kidney_discontinuous", "goal"], rows)


def isolation(read):
    rows = []
    for row in read("cpu_isolation")["rows"]:
        if row["ratio"] in ("1.10", "1.35", "1.75"):  # between others
            continue
        cells = [percent(row[when], row["runs"]) if row[when] else "0"
                 for when in ("before", "after_split", "published", "edge_cover")]
        rows.append([row["ratio"], *cells])
    return table(["radius / spacing", "before", "after split", "published expansion", "`edge_cover`"], rows)


def claims(read):
    """The paper's claims, its own tables, and our measurements."""
    frames = {row["scene"]: row["paper_seconds"] for row in read("h200_table_1")["rows"] if row["what"] == "frame"}
    sums = {scene: 0 for scene in ("cuboid", "liver", "kidney")}
    for row in read("h200_table_1")["rows"]:
        if row["scene"] in sums and row["cooking"] == "boxes" and \
                row["what"] in ("step", "detect", "split", "merge", "expand", "skin"):
            sums[row["scene"]] += row["paper_seconds"]
    saved = ", ".join(f"{100 * (1 - frames[scene] / total):.1f}" for scene, total in sums.items())
    kidneys = {row["paper"]["particles"]: row for row in read("h200_sampling")["rows"]}
    few, many = kidneys[48385], kidneys[101096]
    growth = [row["growth"] for row in read("cpu_clusters_host")["rows"] if row["tau"] is not None]
    loss = {name: statistics.median(ratio(row) for row in read("h200_baselines")["rows"]
                                    if row["name"] == name and row["particles"] == 10000)
            for name in ("this method", "clusters deleted, no split", "particles deleted, no split")}
    more = lambda seconds: f"{100 * (seconds(many) / seconds(few) - 1):.0f} % more"  # noqa: E731
    return table(["claim", "the paper's figures", "measured"], [
        ["concurrent stages save 5 to 15 %", f"Table 1: {saved} % less than its stages", "–"],
        ["30 frames a second in complex scenes",
         f"Table 1: {1 / frames['liver']:.1f} (liver), {1 / frames['kidney']:.1f} (kidney)", "–"],
        ["twice the particles cost half as much again",
         f"Table 2, rows 2 and 4: {101096 / 48385:.2f} times, "
         f"{more(lambda row: row['paper']['frame_seconds'])}",
         f"{more(lambda row: row['seconds']['frame']['median'])} ([sizes](README.md#sizes))"],
        ["+1 % clusters after a cut", "begins at frame 35 (text) or 30 (caption); τ not given",
         f"{100 * min(growth):+.1f} to {100 * max(growth):+.1f} % ([Fig. 10](README.md#fig-10-clusters-during-a-cut))"],
        ["expansion leaves no isolated cluster", "one picture", "some, below"],
        ["Berndt et al. lose much volume", "one picture",
         f"deleting clusters {loss['clusters deleted, no split']:.1f}, deleting particles "
         f"{loss['particles deleted, no split']:.1f}, this method {loss['this method']:.1f} times the least"]])


# --- libraries.md, mutation_testing.md -------------------------------------------------------------------------------

def cuda_plugins(read):
    rows = []
    for name, judged in read("h200_guests")["judged"].items():
        (operation,) = judged["operations"]
        worst = max(operation["properties"], key=lambda of: of["failed"])
        checked = max(of["checked"] for of in operation["properties"])
        rows.append([f"`{name}`", f"{checked:,}", "holds" if judged["holds"] else
                     f"{worst['property']}: {worst['failed']} of {operation['cases']:,} {operation['of']} fail"])
    return table(["plugin", "answers", "verdict"], rows)


def finder(row):
    if not row["found"]:
        return "not found"
    if row["by"].startswith("fuzz"):
        return "`fuzz`"
    return "random property or schedule" if re.search(r"\b(case|schedule)s?\b", row["took"]) else "unit test"


def mutants_by_finder(read):
    document = read("mutation_testing")
    finders = ("`fuzz`", "random property or schedule", "unit test", "not found")
    rows = []
    for stage in (*document["stages"], "all"):
        of = [finder(row) for row in document["rows"] if stage in (row["stage"], "all")]
        rows.append([stage, *(of.count(which) for which in finders), len(of)])
    return table(["stage", *finders, "mutants"], rows)


# Table 3 of the paper [ms], by the name of our method; the sizes are those of the paper.
PAPER_SIZES = (12800, 37704, 48385, 101096)
PAPER_FRAMES = {"tets": (22.1, 56.3, 64.4, 105.7), "fem": (70.2, 310.6, 601.1, 2038.6),
                "clusters deleted, no split": (13.6, 38.9, 46.0, 56.2), "mpm": (22.4, 45.6, 52.0, 70.2),
                "this method": (20.2, 42.1, 47.0, 59.8)}


def methods(read):
    """Table 3."""
    def share(value, digits=2):
        return "–" if value is None else "0" if value == 0 else figure(value, digits)

    rows = []
    for row in read("h200_methods")["methods"]:
        size = min(PAPER_SIZES, key=lambda one: abs(one - row["particles"]))
        name = row["name"].removesuffix("_cuda")
        paper = PAPER_FRAMES.get(name)
        settings = row["settings"].removesuffix(",remove=both")
        is_rule = settings.startswith("iterations") and name != "this method"
        # What differs little from size to size stands once.
        if settings == "steps=1" and size != PAPER_SIZES[-1] or settings == "steps=640" and size not in PAPER_SIZES[-2:]:
            continue
        if (is_rule and paper is None or settings == "labels=0") and size != PAPER_SIZES[0]:
            continue
        if name == "nearer end of each edge":  # as one end
            continue
        if name == "clusters deleted, no split" and size not in (PAPER_SIZES[0], PAPER_SIZES[-1]):
            continue
        settings = "" if is_rule else settings.replace("iterations=", "K = ")
        rows.append([name + (f", {settings}" if settings else ""), f"{row['particles']:,}", milliseconds(row["frame"]),
                     milliseconds(row["cutting"]), figure(row["seconds_per_second"]),
                     percent(row["error"]["rms"], 1), row["pieces"]["coupled"], share(row["felt"]["blade_in"]),
                     share(row["felt"]["withdrawn"]), percent(max(0, row["lost"]), 1) if row["lost"] > 1e-6 else "0",
                     f"{paper[PAPER_SIZES.index(size)]:g}" if paper else "–"])
    return table(["method", "particles", "frame, ms", "cutting, ms", "s/s", "error", "bodies", "felt, blade in", "withdrawn",
                  "lost", "paper, ms"], rows)


def methods_on_cores(read):
    rows = []
    for row in read("cpu_methods_host")["methods"]:
        name, settings = row["name"].removesuffix("_host"), row["settings"].removesuffix(",remove=both")
        if settings.startswith("iterations") and name != "this method":
            continue
        settings = settings.replace("iterations=", "K = ")
        rows.append([name + (f", {settings}" if settings else ""), milliseconds(row["frame"]),
                     figure(row["seconds_per_second"]), percent(row["error"]["rms"], 1), row["pieces"]["coupled"]])
    return table(["method", "frame, ms", "s/s", "error", "bodies"], rows)


def material(read):
    found = {}
    for row in read("h200_material")["rows"]:
        if row["iterations"] is None:
            found.setdefault((row["poisson_ratio"], row["side"], row["across"]), {})[row["test"], row["quantity"]] = row
    rows = []
    for (nu, side, across), of in sorted(found.items()):
        if across == 7:
            continue  # the picture has it
        share = lambda test, quantity="E": f"{of[test, quantity]['measured'] / of[test, quantity]['asked']:.2f}"  # noqa: E731
        rows.append([f"{nu:g}", side, across, share("hanging"), f"{abs(of['hanging', 'ν']['measured']):.3f}",
                     f"{of['pulled by a fifth', 'volume']['measured']:.3f}", share("swinging along"),
                     share("swinging across"), share("twisted", "G")])
    return table(["ν asked", "side", "across", "E, hanging", "ν", "volume", "E, swinging", "E, bent", "G, twisted"], rows)


def mutants_alone(read):
    alone = read("mutation_testing")["alone"]
    rows = [[stage, *(f"{found}/{asked}" for found, asked in counts)] for stage, counts in alone["stages"].items()]
    return table(["stage", *alone["columns"], "any"], rows)


TABLES = {of.__name__: of for of in (status, table_1, fig_10, sizes, errors, single_steps, solver, rotations, retardation, front,
                                     geometry, baselines, sensitivity, methods, methods_on_cores, material, claims, isolation, cuda_plugins, mutants_by_finder,
                                     mutants_alone)}
# Documents that only pictures use: docs/images/make.
OF_PICTURES = {"h200_front_kidney_arc", "h200_front_small_block", "h200_front_cuboid_press", "h200_front_liver_cut"}


# --- The command -----------------------------------------------------------------------------------------------------

def made(text, read):
    """The text with each table made from the documents, and the names of these tables."""
    names = []

    def again(marked):
        name = marked.group(1)
        if name not in TABLES:
            raise SystemExit(f"results: there is no table '{name}'; there are {', '.join(TABLES)}")
        names.append(name)
        return f"<!-- results: {name} -->\n{TABLES[name](read)}\n<!-- end -->"

    return MARKED.sub(again, text), names


def run(root, check):
    read = Documents(root)
    problems, names, pages = [], [], ""
    for page in sorted((root / "docs/results").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        new, found = made(text, read)
        names += found
        pages += text
        if new == text:
            continue
        if check:
            problems.append(f"{page.relative_to(root)}: tables differ from results/: make them by ci/results.sh")
        else:
            page.write_text(new, encoding="utf-8")
            print(f"{page.relative_to(root)} written")
    problems += [f"no page has the table '{name}'" for name in TABLES if names.count(name) != 1]
    stored = {path.stem: path.stat().st_size for path in read.folder.glob("*.json")}
    cited = set(re.findall(r"\b((?:cpu|h200)_\w+)\.json", pages))
    problems += [f"there is no results/{name}.json" for name in sorted(cited - stored.keys())]
    problems += [f"nothing cites results/{name}.json" for name in sorted(stored.keys() - cited - read.read.keys() - OF_PICTURES)]
    if sum(stored.values()) > MOST_BYTES:
        problems.append(f"results/ has {sum(stored.values()):,} bytes, more than {MOST_BYTES:,}")
    for problem in problems:
        print(problem)
    print(f"{len(names)} tables, {len(stored)} documents, {sum(stored.values()) / 1e6:.2f} MB: "
          + (f"{len(problems)} problems" if problems else "pages and documents agree"))
    return 1 if problems else 0


def self_test():
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        shutil.copytree(ROOT / "docs/results", root / "docs/results")
        shutil.copytree(ROOT / "results", root / "results")
        page = root / "docs/results/mutation_testing.md"
        sound = page.read_text(encoding="utf-8")
        stray = root / "results" / "h200_stray.json"
        changes = {
            "nothing": (0, lambda: None),
            "a changed figure": (1, lambda: page.write_text(re.sub(r"\d+ \|\n<!-- end", "1 |\n<!-- end", sound, count=1))),
            "a table less": (1, lambda: page.write_text(MARKED.sub("", sound, count=1))),
            "a document that nothing cites": (1, lambda: stray.write_text("{}")),
            "a document that is missing": (1, lambda: page.write_text(sound + "\n`cpu_gone.json`\n")),
        }
        for what, (status_, change) in changes.items():
            page.write_text(sound, encoding="utf-8")
            stray.unlink(missing_ok=True)
            change()
            if run(root, True) != status_:
                wrong.append(what)
    print(f"self-test: {', '.join(wrong) + ' not told' if wrong else 'all told'}")
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser(description="Makes the tables of docs/results/*.md from results/*.json.")
    parser.add_argument("--check", action="store_true", help="whether pages and documents agree; writes nothing")
    parser.add_argument("--self-test", action="store_true", help="whether --check finds what is wrong")
    options = parser.parse_args()
    return self_test() if options.self_test else run(ROOT, options.check)


if __name__ == "__main__":
    sys.exit(main())
