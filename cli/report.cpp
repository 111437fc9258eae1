// `cutproof report`: a page for a browser, from a recording and its verdicts.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/commands.h"
#include "cli/counterexample_cards.h"
#include "cli/document_report.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/recordings.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_reader.h"
#include "model/io/limits.h"
#include "model/io/recording.h"
#include "property_tests/counterexample.h"
#include "report/document_page.h"
#include "report/documents.h"
#include "report/page.h"

namespace cutproof::cli {

namespace {

struct ReportOptions {
  std::vector<std::string> files;
  std::string output, backend;
  std::string again;  // the command line
};

constexpr const char* kSets =
    "give a recording, alone, with results of its run or check, or with another recording of its scene; or a result of "
    "fuzz, alone or with counterexamples "
    "of it; or a result of judge; or results of bench; or results of tune; or counterexamples";

// The files of the command line, by their contents.
struct Given {
  std::vector<std::string> recordings;
  std::map<report::DocumentKind, std::vector<std::size_t>> documents;  // by number
  std::vector<std::string> names;                                      // of all documents
  std::vector<nlohmann::json> contents;
};

// The files of a recording are HDF5, known by their first bytes; a recording may be named without its ending.
bool is_recording(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  // Nothing but a file is opened: a pipe would wait for ever.
  if (!fs::is_regular_file(file, error)) return fs::is_regular_file(io::recording_paths(file).index, error);
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::array<char, kSignature.size()> first = {};
  std::ifstream stream(file, std::ios::binary);
  stream.read(first.data(), first.size());
  return std::string_view(first.data(), static_cast<std::size_t>(stream.gcount())) == kSignature;
}

Given read_all(const std::vector<std::string>& files) {
  Given given;
  std::set<std::string> seen;
  for (const std::string& file : files) {
    std::error_code error;
    if (!seen.insert(std::filesystem::weakly_canonical(file, error).string()).second)
      throw InputError(file, "", "this file is given twice", "give each file once");
    if (is_recording(file)) {
      given.recordings.push_back(file);
      continue;
    }
    nlohmann::json document = io::read_json(file, io::kResultsLimits, "Give a recording, or what --json has written.");
    given.documents[report::kind_of(document, file)].push_back(given.names.size());
    given.names.push_back(file);
    given.contents.push_back(std::move(document));
  }
  return given;
}

const char* word_of(report::DocumentKind kind) {
  switch (kind) {
    case report::DocumentKind::run:
      return "a result of a run or a check";
    case report::DocumentKind::fuzz:
      return "a result of fuzz";
    case report::DocumentKind::judge:
      return "a result of judge";
    case report::DocumentKind::bench:
      return "a result of bench";
    case report::DocumentKind::tune:
      return "a result of tune";
    case report::DocumentKind::counterexample:
      return "a counterexample";
  }
  return "";
}

// Throws InputError, naming the first file that does not go with the others.
void require_set(const Given& given) {
  using Kind = report::DocumentKind;
  if (given.recordings.size() > 2)
    throw InputError(given.recordings[2], "", "a page shows two recordings at most, and there are two already", kSets);
  const bool has_recording = !given.recordings.empty(), has_campaign = given.documents.contains(Kind::fuzz);
  const Kind first = given.documents.empty() ? Kind::run : given.documents.begin()->first;
  for (const auto& [kind, numbers] : given.documents) {
    const std::string& name = given.names[numbers.front()];
    if (kind == Kind::run && !has_recording) {
      throw InputError(name, "format", "this is a result of a run or a check, and their pages show its recording",
                       "give the recording as well: what --record NAME has written");
    }
    if (has_recording && kind != Kind::run)
      throw InputError(name, "format", fmt::format("this is {}, which does not go with a recording", word_of(kind)),
                       kSets);
    const bool is_of_campaign = has_campaign && kind == Kind::counterexample;
    if (kind != first && !is_of_campaign) {
      throw InputError(name, "format",
                       fmt::format("this is {}, which does not go with {}", word_of(kind), word_of(first)), kSets);
    }
    const bool may_be_many = kind == Kind::bench || kind == Kind::tune || kind == Kind::counterexample;
    if (numbers.size() > 1 && !may_be_many) {
      throw InputError(given.names[numbers[1]], "format",
                       fmt::format("this is {}, and a page shows one", word_of(kind)), kSets);
    }
  }
}

// Those of a campaign are shown with it, so they only have to be of it.
void require_of_campaign(const nlohmann::json& campaign, const std::string& counterexample) {
  const property_tests::Counterexample one = property_tests::read_counterexample(counterexample);
  const auto& violations = campaign.at("violations");
  const bool is_of_it = campaign.at("seed") == one.seed &&
                        std::any_of(violations.begin(), violations.end(), [&](const nlohmann::json& violation) {
                          return violation.at("index") == one.index;
                        });
  if (!is_of_it)
    throw InputError(counterexample, "index", "this campaign has no such violation",
                     "give counterexamples of the campaign, or none: those that it names are found by themselves");
}

void say_whether(std::optional<bool> holds) {
  insist("{}\n", !holds   ? "nothing on the page is judged"
                 : *holds ? "everything on the page holds"
                          : "NOT everything on the page holds");
}

// Names of two recordings that a person tells apart: by backends, unless these are alike.
std::pair<std::string, std::string> told_apart(const io::Recording& one, const std::string& one_file,
                                               const io::Recording& other, const std::string& other_file) {
  if (one.backend != other.backend) return {one.backend, other.backend};
  return {one_file, other_file};
}

// Results are those of the first recording.
int report_recordings(const ReportOptions& options, const std::vector<std::string>& files,
                      const std::string& results_file) {
  const OpenRecording opened = open_recording(files.front());
  const io::RecordingReader& reader = *opened.reader;
  const io::Recording& recording = reader.header();
  const std::string& scene = opened.scene.name;
  report::Results results;
  if (results_file.empty()) {
    results = report::unjudged(recording, scene);
  } else {
    results = report::read_results(results_file);
    report::require_same_run(recording, scene, files.front(), results, results_file);
  }
  std::optional<OpenRecording> other;
  std::optional<ReadBeside> beside;
  if (files.size() > 1) {
    other.emplace(open_recording(files[1]));
    report::require_same_body(recording, files.front(), other->header(), files[1]);
    auto [own_name, name] = told_apart(recording, files.front(), other->header(), files[1]);
    beside.emplace(ReadBeside{*other->reader, true, std::move(name), std::move(own_name),
                              "the same particle of the other recording, in the same moment"});
  }
  write_page(options.output, reader, results, "cutproof check " + quoted(files.front()), made_by(options.again),
             beside ? &*beside : nullptr);
  print_written(options.output);
  insist("{}\n", !results.checked ? "nothing on the page is judged: give results as well"
                 : results.holds  ? "everything on the page holds"
                                  : "NOT everything on the page holds");
  return 0;
}

int make_report(const ReportOptions& options) {
  report::require_pages("report");
  require_writable(options.output);
  Given given = read_all(options.files);
  require_set(given);
  if (!given.recordings.empty())
    return report_recordings(options, given.recordings, given.names.empty() ? "" : given.names.front());
  std::optional<harness::BackendChoice> chosen;
  if (!options.backend.empty()) {
    chosen.emplace();
    chosen->name = options.backend;
  }
  const auto counterexamples = given.documents.find(report::DocumentKind::counterexample);
  const bool has_others = given.documents.size() > (counterexamples != given.documents.end() ? 1u : 0u);
  if (!has_others) {
    std::vector<property_tests::Counterexample> cases;
    for (const std::string& name : given.names) cases.push_back(property_tests::read_counterexample(name));
    std::vector<report::Scenery> sceneries;
    const report::Sheet sheet = counterexample_sheet(cases, given.names, chosen, sceneries);
    io::write_text(options.output, report::document_page({sheet}, sceneries, made_by(options.again)));
    print_written(options.output);
    say_whether(sheet.holds);
    return 0;
  }
  std::vector<nlohmann::json> documents;
  std::vector<std::string> names;
  for (const auto& [kind, numbers] : given.documents) {
    if (kind == report::DocumentKind::counterexample) continue;
    for (const std::size_t number : numbers) {
      documents.push_back(std::move(given.contents[number]));
      names.push_back(given.names[number]);
    }
  }
  const DocumentPage page = page_of_documents(documents, names, chosen, made_by(options.again));
  if (counterexamples != given.documents.end()) {
    for (const std::size_t number : counterexamples->second)
      require_of_campaign(documents.front(), given.names[number]);
  }
  io::write_text(options.output, page.text);
  print_written(options.output);
  say_whether(page.holds);
  return 0;
}

}  // namespace

void add_report(CLI::App& program, Work& work) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* const command =
      program.add_subcommand("report", "write a page about recordings, results or counterexamples");
  if (!report::has_pages()) command->group("");
  command
      ->add_option("files", options->files,
                   "a recording, alone, with its `run --json` or `check --json` result, or with another recording of "
                   "the same scene; or --json results of `fuzz`, `judge`, `bench` or `tune`; or counterexamples")
      ->required()
      ->type_name("FILE...");
  command->add_option("-o,--output", options->output, "the page to write")->required()->type_name("F");
  add_backend_name(*command, options->backend,
                   "backend that runs counterexamples again (default: the one that failed; plugins only by name)");
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return make_report(*options); };
  });
}

}  // namespace cutproof::cli
