// --baseline F: compares a result with an earlier --json result. Failures of both do not count.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/annotations.h"
#include "model/io/junit.h"
#include "model/verdict.h"

namespace cutproof::cli {

void add_baseline(CLI::App& command, std::string& path);

struct Baseline {
  std::string file;
  nlohmann::json document;
};
// Nothing if `path` is empty. `formats`: of comparable documents; `scene`: the judged scene, or empty. Throws
// InputError for a file without such a document, or with one of another scene.
std::optional<Baseline> read_baseline(const std::string& path, const std::vector<std::string>& formats,
                                      const std::string& scene = "");

// Properties by their names in JUnit, with the stage where there is one.
struct SinceBaseline {
  struct Known {
    std::string name;
    int64_t failed = 0, failed_then = 0;  // verdicts
  };
  struct Slower {
    std::string stage;
    double seconds = 0, seconds_then = 0;  // of a frame, in the mean
  };
  std::string file;
  std::vector<std::string> fresh;       // fail, and did not; or say that too little was judged, as nothing excuses that
  std::vector<Known> known;             // failed and fail
  std::vector<std::string> mended;      // failed and hold
  std::vector<std::string> not_judged;  // failed, and were not judged, or not as far
  std::vector<Slower> slower;           // by a quarter at least: told, and never a failure

  // Whether all failures are known. A failure without a verdict is never known.
  bool excuses() const { return fresh.empty() && !known.empty(); }
  bool is_known(const std::string& name) const;
  bool is_known(const Verdict& verdict, bool in_stages) const;
};
// Compares, and adds `baseline` to the document. Throws InputError for a baseline that cannot be understood.
std::optional<SinceBaseline> since_baseline(const std::optional<Baseline>& baseline, nlohmann::json& document);

// Known failures become skipped cases with a message.
void excuse_known(const SinceBaseline& since, std::vector<io::JunitCase>& cases);
void add_baseline_to(ForGitHub& said, const SinceBaseline& since);
// The last line says whether anything new fails.
void print_since(const SinceBaseline& since);

}  // namespace cutproof::cli
