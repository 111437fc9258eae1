#!/usr/bin/env python3
"""Chooses the long tests that a commit runs. ci/test.sh runs a share of them, ci/nightly.sh all.

Usage: long_tests.py BUILD    prints a pattern of the omitted tests (ctest -E), then a line for a person

The commit's hash chooses every SHARE-th. Each row names a find that no shorter test makes. Other tests should find every
mutant. Outside a repository all are run.
"""
import json
import pathlib
import re
import subprocess
import sys

SHARE = 128
LONG = (
    (r"Packaging\.(subdirectory|archive|static)", "that others can build with the libraries, and run what is packed"),
    (r"OfThePaper/Scene\.Holds/.*", "faults where clusters and particles are many; what the paper's scenes come to"),
    (r"Organs/.*", "a mesh of others that cannot be repaired, or a scene on it that fails"),
    (r".*SavedCounterexamples/(simulated|host)_.*", "an order of threads in which a saved case fails again"),
    (r"Over/LargeBodies\..*/host_blocks", "room for lists that runs out in blocks of threads alone"),
    (r"PluginBackend\.(IsFoundAndSimplifiedWhereOneStageIsWrong|HoldsStageByStageAndFrameByFrame)",
     "a guest whose stages are right and fail, or of which one is wrong and not shrunk"),
    (r"LargeQuestions\.ShowFaultsOfWidth.*", "a fault of large bodies alone whose least size is not found"),
    (r"Documents\.FollowTheirSchemas", "a verb's document that differs from its schema"),
    (r"RepairOfOne\.(MakesEveryOutsideMeshASolid|JoinsTwoOfVeryManyParts)", "a mesh that is repaired wrongly, or slowly"),
    (r"RecordedValues\.AreEachHeldAgainstTheOthersOrJudged", "a recorded value of which no verdict would notice a change"),
    (r".*/FaultySimulator\..*", "a fault of a whole simulator that the judge of a scene accepts"),
    (r"Programs/Allocations\..*", "what a verb does wrongly when memory ends at some allocation of a whole run"),
    (r"Program\.CheckGivesTheVerdictsThatTheRunGave", "a judge that needs more than a recording keeps"),
    (r"Program\.LetsTheRestOfTheKidneyEndWithTheSameBits.*", "a ghost force by the bits of a whole scene"),
    (r"Report\.(InABrowser|ScenesInABrowser|RunsInABrowser|HowFast|OfStoredResults)", "what a page draws, what a click does, its pace"),
    (r"(PythonWithCudaStandIn\.Arrays|SciPy\.Judged)", "answers in a device's memory; a library that stops to hold"),
    (r"Runs\.(Related|DissectedWithoutFault)", "a right simulator that fails a relation, or a property in some drawn scene"),
    (r"Runs\.DissectedWithFaults/.*", "a fault of a simulator that no drawn scene shows, or that is not shrunk"),
    (r"Runs\.JudgedWithFaults", "a fault of a simulator that no property and no relation of a run shows"),
    (r".*HistoriesOfCommands/simulated_.*", "an order of threads in which a history of commands breaks a promise"),
    (r"ScenesOfTheProject\..*", "a scene of the project whose substeps do not suffice"),
    (r"AgainstTheReference\.TheReferenceDeviates.*", "a comparison that finds differences where there is none"),
    (r"(Vectors\.ThatThePageAnswersHold|Tutorial\.FromAFailingCutToTheFix)", "programs of a page that no longer run"),
    (r"(BenchSensitivity|BenchSampling)\.HasARowForEach.*|BenchBaselines\.(TellsOfEveryMethodWhatItCosts|AsksOtherSimulators)"
     r"|Bench\.ReproducesTable1.*", "a row of a suite that is missing or wrong"),
    (r"Skin\.LiesOnTheSurfaceOfAnUncutBody", "a skin that reference, kernels and oracles all have off the surface"),
    (r"Screen\.(IsNotLeftByAnyVerb|OnATerminal)", "a line that is too long in what a whole campaign or suite prints"),
    (r"Interrupted\.(TuneWritesWhatItHasTried|EverySuiteOfBenchWritesItsDocumentHoweverEarly)",
     "a document that an interrupted search or suite does not write"),
    (r"Screen\.ShowsWhatFailsFirst.*", "a first failure that a long run does not name first"),
    (r"Interrupted\.ASecondSignalEndsARun.*", "files that a run leaves behind after two signals"),
    (r"Page\.IsUnderTwoMegabytes.*", "a page of a large scene that is too large"),
    (r"Report\.PreviewInABrowser", "what a page without a run shows"),
    (r"RotationMethods\.BesideTheDefault.*", "a method of rotations that nobody chose, and that is wrong"),
    (r"VectorsTest\.AreRefusedOrJudgedWhateverValuesTheyHave", "a value of a file of vectors that ends the program"),
    (r"JudgeVerb\.JudgesStagesToo|Reports\.OfEveryVerbThatJudges", "a verb that reports what it judged wrongly"),
)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    listed = subprocess.run(["ctest", "--test-dir", sys.argv[1], "--show-only=json-v1"], check=True,
                            capture_output=True)
    # The name of a parameterised test continues with its value, in words.
    names = [test["name"].partition("  #")[0] for test in json.loads(listed.stdout)["tests"]]
    long_tests = [name for pattern, _ in LONG for name in names if re.fullmatch(pattern, name)]
    commit = subprocess.run(["git", "-C", pathlib.Path(__file__).parent, "rev-parse", "--short=12", "HEAD"],
                            capture_output=True, text=True).stdout.strip()
    chosen = long_tests[int(commit, 16) % SHARE::SHARE] if commit else long_tests
    commit = commit or "that is not there"
    left_out = [re.sub(r"([^\w/])", r"[\1]", name) for name in long_tests if name not in chosen]
    print(f"^({'|'.join(left_out)})(  #.*)?$")
    print(f"LONG TESTS: {len(chosen)} of {len(long_tests)} by the commit {commit} (ci/nightly.sh runs all): "
          f"{' '.join(chosen)}")


if __name__ == "__main__":
    main()
