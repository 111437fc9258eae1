// A folder with a file for each verb but judge, whose plugins are tested elsewhere, and command lines that succeed.
#pragma once
#include <string>
#include <vector>

#include "model/io/array_file.h"
#include "tests/program.h"

inline constexpr const char* kScene = R"({"version": 5, "name": "small",
  "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01}, "frame": {"count": 2},
  "step": {"gravity": [0, 0, -9.81]}})";

class Verbs : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("cut.json", kScene);
    cutproof::io::ArrayFile state, kick;
    state.arrays = {cutproof::make_array<double>("positions", {2, 3}, {0, 0, 0, 1, 0, 0}),
                    cutproof::make_array<int32_t>("edges", {1, 2}, {0, 1}),
                    cutproof::make_array<int32_t>("cluster_offsets", {2}, {0, 2}),
                    cutproof::make_array<int32_t>("cluster_members", {2}, {0, 1})};
    cutproof::io::write_array_file(path("state.npz"), state);
    kick.arrays = {cutproof::make_array<double>("positions", {1, 2, 3}, {0, 0, 0, 1, 0, 0}),
                   cutproof::make_array<double>("kicked", {1, 2, 3}, {0, 0, 0, 2, 0, 0}),
                   cutproof::make_array<int32_t>("piece", {2}, {0, 1})};
    cutproof::io::write_array_file(path("kick.npz"), kick);
    write("organ.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
    // Answers that stand in the questions themselves.
    ASSERT_EQ(cutproof("vectors components -o vectors.npz --cases 1").status, 0);
    const cutproof::io::ArrayFile vectors = cutproof::io::read_array_file(path("vectors.npz"));
    cutproof::io::ArrayFile answers;
    answers.arrays = {*cutproof::find_array(vectors.arrays, "answer_label")};
    answers.arrays[0].name = "label";
    cutproof::io::write_array_file(path("answers.npz"), answers);
  }
  std::string counterexample() const {
    return (files::path(CUTPROOF_SOURCE) / "fixtures/regressions/skin_cell_not_renewed.json").string();
  }
  // One command line of each verb but judge, of each list of info, and of two suites of bench. Those that name `seen`
  // need record() first.
  std::vector<std::string> commands() const {
    std::vector<std::string> all = {"info",
                                    "info --scene",
                                    "info --scenes",
                                    "info --limits",
                                    "info --mesh organ.off",
                                    "--help",
                                    "--version",
                                    "run cut.json --check",
                                    "check seen",
                                    "check state.npz",
                                    "kick kick.npz",
                                    "vectors split -o split.h5 --cases 1",
                                    "check-vectors vectors.npz answers.npz",
                                    "digest seen",
                                    "fuzz --cases 20 --sizes 0-20",
                                    "replay '" + counterexample() + "'",
                                    "tune cut.json --tolerance 0.5 --reference substeps --repeats 1 --frames 1",
                                    "bench stages --sizes 1000 --frames 1 --repeats 1",
                                    "bench machine_limits --repeats 1"};
    if (CUTPROOF_HAS_PAGES != 0) {
      for (const char* const one :
           {"run cut.json --check --report page.html", "check seen --report page.html", "report seen -o page.html"})
        all.push_back(one);
    }
    return all;
  }
  void record() { ASSERT_EQ(cutproof("run cut.json --record seen").status, 0); }
};
