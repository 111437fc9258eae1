#include "cli/bench/suites.h"
#include "cli/interruption.h"
#include "cli/scene_files.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

// Those that come with the program and are small enough to be run many times over.
const std::vector<std::string>& usual_scenes() {
  static const std::vector<std::string> names = {"small_block",          "cuboid_press",     "kidney_arc",
                                                 "kidney_discontinuous", "three_cuts",       "liver_cut",
                                                 "uniform_stretch",      "irregular_sampled"};
  return names;
}

bool is_given(const json& row) { return row.at("without").is_null(); }

std::string words_of_part(const json& row) { return is_given(row) ? "as it is" : io::filled("without {without}", row); }

void print_row_of_parts(const json& document) {
  const json& row = document.at("rows").back();
  say("{}, {}: ", io::filled("{scene}", row), words_of_part(row));
  if (row.at("seconds_per_frame").is_null()) {
    say("refused\n");
  } else {
    say_filled("{1e3*seconds_per_frame/median:.4g} ms a frame\n", row);
  }
}

// Of the scene as it is: its stages, and what its particles cost one by one.
void print_given(const json& row) {
  say_filled("\n{scene}: {particles} particles, {clusters} clusters, {frames} frames of {substeps} × {iterations}\n",
             row);
  std::string stages;
  for (const std::string_view stage : kStageNames) {
    const json& one = row.at("stages").at(std::string(stage));
    if (one.at("frames") == 0) continue;
    stages += (stages.empty() ? "" : "; ") + std::string(stage) +
              io::filled(" {1e3*seconds_per_frame:.3g}, in {frames}", one);
  }
  say("  stages alone, ms in the mean of all frames, and in how many: {}\n", stages);
  if (!row.at("work").is_null()) {
    say_filled(
        "  particles of a step, in the mean: {work/carried:.0f} with their group, {work/held:.0f} in a grip, "
        "{work/resolved:.0f} resolved, {work/loose:.0f} in no group\n",
        row);
  }
  if (!row.at("per_resolved").is_null()) {
    say_filled(
        "  a resolved particle adds {1e9*per_resolved/seconds:.3g} ± {1e9*per_resolved/standard_error:.2g} ns to a "
        "step\n",
        row);
  }
}

void print_parts(const json& document) {
  std::vector<json> rows;
  const auto print = [&] {
    if (rows.empty()) return;
    print_given(rows.front());
    say_as_it_is(table_of(rows, columns_of(report::kPartsSuite)));
    rows.clear();
  };
  for (const json& row : document.at("rows")) {
    if (is_given(row)) print();
    rows.push_back(row);
  }
  print();
  say("Times are of a frame; relative: to the scene as it is. RMS, max: distance of tissue, in its worst frame, from "
      "the scene as it is. Removed otherwise: particles that only one of both scenes has at the end.\n");
}

}  // namespace

void add_parts(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::PartsOptions>();
  options->stop_asked = stop_asked;
  CLI::App* const command =
      bench.add_subcommand("parts", "cost of each part of a scene, and change of the result without it");
  command->add_option("scenes", options->scenes, "files, or names (`cutproof info --scenes`; default: eight of these)")
      ->type_name("SCENE");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_count(*command, "--frames", options->frames, "frames of each scene, at most", whole_number(1, 10'000));
  add_count(*command, "--repeats", options->repeats, "timed runs, alternating with runs without each part",
            whole_number(1, 1'000));
  add_suite(*command, work, "write times, errors and stages as JSON",
            {.run =
                 [options](const auto& progress) {
                   benchmarks::PartsOptions asked = *options;
                   if (asked.scenes.empty()) asked.scenes = usual_scenes();
                   for (std::string& scene : asked.scenes) scene = scene_file(scene);
                   return run_parts(asked, progress);
                 },
             .row = print_row_of_parts,
             .end = print_parts});
}

}  // namespace cutproof::cli
