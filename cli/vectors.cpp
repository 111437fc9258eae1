// `cutproof vectors` and `cutproof check-vectors`: questions to single kernels as a file, and the answers to them.
#include "guests/questions/vectors.h"

#include <fmt/format.h>

#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/screen.h"
#include "cli/terminal.h"
#include "model/io/array_file.h"
#include "model/nearest_word.h"

namespace cutproof::cli {

namespace {

using namespace guests;
using nlohmann::json;

std::string operation_names() {
  std::string names;
  for (const OperationDescription& each : vector_operations()) {
    names += (names.empty() ? "" : ", ") + std::string(each.name);
  }
  return names;
}

// --- Making ----------------------------------------------------------------------------------------------------------

struct VectorsOptions {
  std::string operation, file;
  int64_t cases = 0;  // 0: the usual number
  uint64_t seed = 1;
  std::string precision = "single";
};

int make_vectors(const VectorsOptions& options) {
  const OperationDescription* const operation = find_vector_operation(options.operation);
  if (operation == nullptr) {
    refuse("OP", fmt::format("there is no operation '{}'", options.operation),
           did_you_mean(options.operation, listed(operation_names())) + "use one of " + operation_names());
  }
  if (options.cases > kMostCases) {
    refuse("--cases", fmt::format("a file has at most {} cases", kMostCases), "make several, of different seeds");
  }
  require_writable(options.file);
  const Vectors vectors =
      draw_vectors(*operation, options.seed, options.cases > 0 ? options.cases : usual_vector_cases(*operation),
                   options.precision == "double" ? Precision::binary64 : Precision::binary32);
  io::write_array_file(options.file, file_of(vectors));
  insist("wrote {}: {} cases of {}, of {} kinds, seed {}, {} precision\n", options.file, vectors.cases.size(),
         operation->name, vectors.kinds.size(), options.seed, options.precision);
  return 0;
}

// --- Judging ---------------------------------------------------------------------------------------------------------

struct CheckVectorsOptions {
  std::string vectors, answers;
  std::optional<std::string> promises;
  std::string json, junit;
  std::string again;  // the command line
};

constexpr int kMostPrinted = 3;  // failures of one property

void print(const Vectors& vectors, const VectorReport& report, const std::string& again) {
  say("{}: {} cases, {} precision\n", report.operation->name, report.cases,
      vectors.precision == Precision::binary32 ? "single" : "double");
  std::map<std::string, int> printed;
  for (const VectorFailure& failure : report.failures) {
    if (++printed[failure.verdict.property] > kMostPrinted) continue;
    insist("{}: '{}', case {} ({}), which begins at row {}:\n  {}\n", failing("FAILS"), failure.verdict.property,
           failure.index, vectors.cases[static_cast<std::size_t>(failure.index)].kind,
           first_row(vectors, failure.index), failure.verdict.witness.text);
  }
  for (const auto& [property, count] : printed) {
    if (count > kMostPrinted) insist("  and {} more cases fail in '{}'\n", count - kMostPrinted, property);
  }
  if (!printed.empty()) insist_copy("see it again:", again);
  print_judged(report.properties, &harness::PropertySummary::judged);
  for (const NotJudged& each : report.not_judged) {
    say("  {}: {}: {}{}\n", unsettled("not judged"), each.property, each.why,
        each.failing > 0 ? fmt::format(" (would fail in {} cases)", each.failing) : "");
  }
  if (report.verdicts == 0) insist("{}: nothing was judged\n", failing("FAILS"));
}

constexpr const char* kVectorsClass = "cutproof.check-vectors";

// A case for each property, judged or not.
std::vector<io::JunitCase> junit_cases(const Vectors& vectors, const VectorReport& report, double seconds,
                                       const std::string& again, std::vector<Failure>& failures) {
  std::vector<io::JunitCase> cases;
  const auto add = [&](const std::string& name) -> io::JunitCase& {
    return cases.emplace_back(io::JunitCase{name, fmt::format("{}.{}", kVectorsClass, report.operation->name)});
  };
  for (const harness::PropertySummary& property : report.properties.all()) {
    io::JunitCase& each = add(property.property);
    if (cases.size() == 1) each.seconds = seconds;
    if (property.judged == 0) {
      each.outcome = io::JunitOutcome::skipped;
      each.message = "there was nothing to judge";
    }
    for (const VectorFailure& failure : report.failures) {
      if (failure.verdict.property != property.property) continue;
      each.outcome = io::JunitOutcome::failed;
      each.message = failure.verdict.witness.text;
      each.text = fmt::format("case {} ({}): {}\n{} of {} cases fail\nto see it again: {}", failure.index,
                              vectors.cases[static_cast<std::size_t>(failure.index)].kind, each.message,
                              property.failed, report.cases, again);
      failures.push_back({fmt::format("{}: {}", report.operation->name, each.name), each.message, again});
      break;
    }
  }
  for (const NotJudged& not_judged : report.not_judged) {
    io::JunitCase& each = add(not_judged.property);
    each.outcome = io::JunitOutcome::skipped;
    each.message = not_judged.why;
  }
  if (report.verdicts == 0) {
    io::JunitCase& each = add("something was judged");
    each.outcome = io::JunitOutcome::failed;
    each.message = "nothing was judged";
    failures.push_back({std::string(report.operation->name), each.message, again});
  }
  return cases;
}

int check_vectors(const CheckVectorsOptions& options) {
  require_writable(options.json);
  require_writable(options.junit);
  const auto begin = std::chrono::steady_clock::now();
  const Vectors vectors = vectors_of(io::read_array_file(options.vectors), options.vectors);
  const harness::Promises promises = guests::promises_of(*vectors.operation, options.promises);
  const AllAnswers answers = answers_of(io::read_array_file(options.answers), options.answers, vectors);
  const VectorReport report = judge_vectors(vectors, answers, promises);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  say("{}, answers to {}\n", options.answers, options.vectors);
  print(vectors, report, options.again);
  json document = guests::to_json(vectors, report);
  document["format"] = "cutproof.check_vectors";
  document["format_version"] = 1;
  document["cutproof"] = kVersion;
  document["source"] = options.vectors;
  document["answers"] = options.answers;
  document["promises"] = json::array();
  for (std::size_t k = 0; k < harness::promise_words().size(); ++k) {
    if ((promises.words >> k & 1u) != 0) document["promises"].push_back(harness::promise_words()[k].name);
  }
  document["promises_given"] = options.promises.has_value();
  write_document(options.json, document);
  std::vector<Failure> failures;
  std::vector<io::JunitCase> cases = junit_cases(vectors, report, seconds, options.again, failures);
  write_junit(options.junit, {"cutproof check-vectors", kVectorsClass, options.again}, seconds, std::move(cases));
  insist("{}\n", report.holds() ? holding("all hold") : failing("FAILS"));
  tell_github({options.again, failures});
  return report.holds() ? 0 : 1;
}

}  // namespace

void add_vectors(CLI::App& program, Work& work) {
  const auto options = std::make_shared<VectorsOptions>();
  CLI::App* const command =
      program.add_subcommand("vectors", "write test vectors of one kernel, a file for any program");
  command->add_option("operation", options->operation, operation_names())
      ->required()
      ->type_name("OP")
      ->check(usually_one_of(listed(operation_names())));
  command->add_option("-o,--output", options->file, "file to write: NPZ if the name ends in .npz, else HDF5")
      ->required()
      ->type_name("FILE");
  add_count(*command, "--cases", options->cases,
            "number of cases, at least one of each kind (default: 200; rotations: one of each kind)", whole_number(1));
  add_seed(*command, options->seed, "seed of the cases");
  command->add_option("--precision", options->precision, "precision of the numbers and of the bounds: single or double")
      ->capture_default_str()
      ->check(one_of({"single", "double"}));
  command->callback([options, &work] { work = [options] { return make_vectors(*options); }; });
}

void add_check_vectors(CLI::App& program, Work& work) {
  const auto options = std::make_shared<CheckVectorsOptions>();
  CLI::App* const command = program.add_subcommand("check-vectors", "judge your code's answers to test vectors");
  command->add_option("vectors", options->vectors, "file from `cutproof vectors`")->required()->type_name("FILE");
  command->add_option("answers", options->answers, "answers to all cases of the file, as NPZ or HDF5")
      ->required()
      ->type_name("ANSWERS");
  command->add_option("--promises", options->promises, "promises to judge, by name (default: all of the operation)")
      ->type_name("WORDS");
  add_json(*command, options->json, "write counts and failures as JSON");
  add_junit(*command, options->junit);
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return check_vectors(*options); };
  });
}

}  // namespace cutproof::cli
