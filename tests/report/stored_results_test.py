#!/usr/bin/env python3
"""Every stored result (results/*.json): `cutproof report` makes a page of it, or refuses another format version, and
whatever else is not as this program writes it, by file, field and remedy. Usage: stored_results_test.py CUTPROOF RESULTS WORK. Needs no browser."""
import json
import pathlib
import re
import shutil
import subprocess
import sys

program, results, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

# Extracts of several documents (ci/extract_results.py and others), so no command has written them: they have no page as they
# stand.
COLLECTIONS = {"cpu_isolation", "cpu_lockstep_host", "cpu_methods_host", "cpu_nightly",
               "h200_baselines", "h200_fronts", "h200_geometry", "h200_guests", "h200_kit_summary", "h200_methods",
               "h200_solver_every_frame", "mutation_testing"}
LATEST = {"cutproof.fuzz": 4, "cutproof.bench": 3, "cutproof.judge": 1}


def shown_in(page):
    text = page.read_text()
    begin = text.index('id="data">') + len('id="data">')
    return json.loads(text[begin:text.index("</script>", begin)])


# What this version of the program does not read: stored results are not rewritten.
def is_of_another_version(document):
    if document["format"] not in LATEST:
        return False
    lacks = document["format"] != "cutproof.bench" and "complete" not in document
    return lacks or document["format_version"] != LATEST[document["format"]]


def made(file, page):
    return subprocess.run([program, "report", file, "-o", page], capture_output=True, text=True, timeout=100)


files = sorted(results.glob("*.json"))
assert len(files) > 30, f"{len(files)} files in {results}"
refused = 0
for file in files:
    page = work / (file.stem + ".html")
    done = made(file, page)
    said = done.stdout + done.stderr
    if file.stem in COLLECTIONS:
        assert done.returncode == 2 and not page.exists(), f"{file}: {done.returncode}\n{said}"
        assert str(file) in said and "format" in said and "remedy" in said, said
        print(f"no page: {said.strip()}")
        # The remedy holds: what such a file has within it, as a file of its own, makes a page; a run's needs a recording.
        within = json.loads(file.read_text())
        held = list(within.get("judged", {}).values())
        for one in held:
            if not isinstance(one, dict) or not one.get("format", "").startswith("cutproof."):
                continue
            (work / "one.json").write_text(json.dumps(one))
            done = made(work / "one.json", page)
            is_run, is_other = one["format"] == "cutproof.run", is_of_another_version(one)
            assert done.returncode == (2 if is_run or is_other else 0), f"{file}: {done.stdout}{done.stderr}"
            assert not is_run or "give the recording as well" in done.stdout + done.stderr, done.stderr
            if not is_run and not is_other:
                assert shown_in(page)["sheets"][0]["holds"] == one["holds"], file
        page.unlink(missing_ok=True)
        continue
    document = json.loads(file.read_text())
    is_other = is_of_another_version(document)
    if is_other or done.returncode == 2:
        assert done.returncode == 2 and not page.exists(), f"{file}: {done.returncode}\n{said}"
        # Some of this version lack a field, or a class of cases, that this program writes.
        why = f"this is version {document['format_version']}," if is_other else "(this is missing|key '.*' not found)"
        assert str(file) in said and re.search(why, said) and "remedy" in said, said
        refused += 1
        continue
    assert done.returncode == 0, f"{file}: {done.returncode}\n{said}"
    (sheet,) = shown_in(page)["sheets"]
    # What the document says of itself is what the page says of it: none of these is worse than it says.
    assert sheet["holds"] in (document.get("holds"), document.get("found") is not None), (file, sheet["holds"])
    if document["format"] == "cutproof.fuzz":
        assert f"{document['cases']:,} random dissections" in sheet["summary"], sheet["summary"]
        counted = document["coverage"]
        rows = next(one for one in sheet["pieces"] if one["title"] == "What occurred in the cases")["rows"]
        seen = {name: int(count.replace(",", "")) for name, count in (row["cells"] for row in rows)}
        assert seen == {name: n for name, n in counted.items() if n or document["dynamics"]}, file
        assert "Every property" in [one["title"] for one in sheet["pieces"]], file
        assert sheet["again"].startswith(f"cutproof fuzz --backend {document['backend']} "), sheet["again"]
    if document.get("suite") == "tune":
        outcomes = [row["cells"][1] for row in sheet["pieces"][-1]["rows"]]
        late = sum(one["outcome"] == "more_expensive" for one in document["trials"])
        assert outcomes.count("given up as more expensive") == late, file
    page.unlink()
shown = len(files) - len(COLLECTIONS) - refused
assert shown > 15 and refused > 5, (shown, refused)
print(f"{len(files)} files: {shown} pages; {refused} of other versions refused")
