// `cutproof bench`: times, each beside its error.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "cli/bench/suites.h"
#include "cli/document_report.h"
#include "cli/interruption.h"
#include "cli/output.h"
#include "cli/report_page.h"
#include "model/nearest_word.h"
#include "model/stop.h"

namespace cutproof::cli {

void add_bench(CLI::App& program, Work& work) {
  CLI::App* const bench = program.add_subcommand("bench", "times, each beside its error");
  const auto suite = std::make_shared<Work>();
  for (const auto add : {add_stages, add_sampling, add_clusters, add_scale, add_rotations, add_machine_limits,
                         add_solver, add_baselines, add_sensitivity, add_parts, add_campaigns, add_material}) {
    add(*bench, *suite);
  }
  std::vector<std::string> names;
  for (const CLI::App* const command : bench->get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  // Takes a name that is no suite's, to refuse it.
  const auto unknown = std::make_shared<std::vector<std::string>>();
  bench->add_option("suite", *unknown)->group("");
  bench->callback([suite, unknown, names, &work] {
    work = [suite, unknown, names] {
      const std::string remedy = fmt::format("use one of {}", fmt::join(names, ", "));
      if (!unknown->empty()) {
        refuse("bench", fmt::format("there is no suite '{}'", unknown->front()),
               did_you_mean(unknown->front(), names) + remedy);
      }
      if (!*suite) refuse("bench", "no suite is named", remedy);
      return (*suite)();
    };
  });
}

namespace {

// Of a stopped suite, whose measurements were written after each row.
int print_how_far(const std::string& path, const std::string& report, const nlohmann::json& document,
                  const Suite& suite) {
  const std::size_t rows = document.at(suite.rows).size();
  if (rows > 0) suite.end(document);
  insist("\n{}: it was stopped after {} row{}\n", unsettled("INCOMPLETE"), rows, rows == 1 ? "" : "s");
  write_document(path, document);
  write_document_report(report, document, made_by(document.value("again", std::string())));
  print_written(path);
  print_written(report);
  return 1;
}

}  // namespace

void add_suite(CLI::App& command, Work& work, const std::string& what, Suite suite) {
  const auto path = std::make_shared<std::string>();
  const auto report = std::make_shared<std::string>();
  add_json(command, *path, what);
  add_report_option(command, *report);
  command.callback([path, report, suite, &command, &work] {
    work = [path, report, suite, again = as_given(command)] {
      require_writable(*path);
      require_report(*report);
      const EndsInOrder in_order;
      nlohmann::json document;  // so far
      bool begun = false;
      std::optional<Progress> progress;
      const auto show = [&](const nlohmann::json& so_far) {
        if (std::exchange(begun, true)) {
          if (!so_far.contains("judging")) suite.row(so_far);
          keep_document(*path, so_far);
        } else {
          say_filled(kHead, so_far);
          suite.begin(so_far);
        }
        flush_output();
        document = so_far;
        document["again"] = again;
        throw_if_asked(stop_asked);
        const auto rows_at_most = so_far.value("rows_at_most", int64_t{0});
        if (rows_at_most == 0) return;
        if (!progress) progress.emplace("row", rows_at_most);
        const std::size_t measured = so_far.at(suite.rows).size() - (so_far.contains("judging") ? 1 : 0);
        progress->show(static_cast<int64_t>(measured), "measuring");
      };
      try {
        document = suite.run(show);
        document["again"] = again;
      } catch (const Stopped&) {
        progress.reset();
        return print_how_far(*path, *report, document, suite);
      }
      if (document.at(suite.rows).empty()) {
        insist("{}: nothing was measured\n", failing("FAILS"));
        return 1;
      }
      progress.reset();
      write_document(*path, document);
      write_document_report(*report, document, made_by(again));
      suite.end(document);
      print_written(*path);
      print_written(*report);
      const bool holds = document.value("holds", true);
      const std::size_t rows = document.at(suite.rows).size();
      insist("measured: {} {}{}\n", rows, rows == 1 ? "row" : "rows",
             holds ? "" : "; " + failing("NOT everything holds."));
      return holds ? 0 : 1;
    };
  });
}

void add_timing(CLI::App& command, benchmarks::TimingOptions& options) {
  add_backend_name(command, options.backend, "backend under test", is_timed);
  add_count(command, "--frames", options.frames, "timed frames of each repeat (default: by backend)",
            whole_number(1, 10'000));
  add_count(command, "--repeats", options.repeats, "timed repeats, each after a warm-up", whole_number(1, 1'000));
  add_list(command, "--acceleration", options.acceleration,
           options.acceleration.empty() ? "none, chebyshev or both, instead of the scene's" : "none, chebyshev or both",
           "A");
  add_count(command, "--iterations", options.iterations, "iterations per substep, instead of the scene's",
            whole_number(1, 1'000'000));
  command
      .add_option("--remove", options.remove,
                  "ends that a too long edge loses: both, one or nearer, instead of the scene's")
      ->type_name("E")
      ->check(one_of({"both", "one", "nearer"}));
}

void print_scene(const nlohmann::json& document) {
  const nlohmann::json& row = document.at("rows").back();
  say_filled("{scene}, acceleration {acceleration}: {particles} particles, frame {1e3*seconds/frame/median:.4g} ms\n",
             row);
  print_failures(row.at("error").at("frame"));
}

void print_scenes(const nlohmann::json& document, const report::Suite& suite) {
  std::vector<Column> columns = columns_of(suite);
  for (const auto& [head, what] : {std::pair{"error of step", "step"}, {"topology", "frame"}}) {
    columns.emplace_back(head, [what = what](const nlohmann::json& row) {
      return benchmarks::in_words(row.at("error").at(what), "not measured");
    });
  }
  say_as_it_is("\n" + table_of(document.at("rows"), columns, 3));
}

void print_failures(const nlohmann::json& frame_error) {
  if (!frame_error.contains("failed")) return;
  for (const nlohmann::json& verdict : frame_error.at("failed")) {
    insist("  {}: {}\n", failing("FAILS"), io::filled("{property}: {witness/text}", verdict));
  }
}

std::vector<Column> columns_of(const report::Suite& suite) {
  std::vector<Column> shown;
  for (const report::RowColumn& column : suite.columns()) {
    if (column.shown == report::Shown::page) continue;
    shown.emplace_back(column.head, [column](const nlohmann::json& row) { return terminal_text(column, row); });
  }
  return shown;
}

}  // namespace cutproof::cli
