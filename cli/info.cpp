// `cutproof info`: version, backends, devices, properties.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <vector>

#include "cli/commands.h"
#include "cli/options.h"
#include "model/fields.h"
#include "model/io/limits.h"
#include "model/io/scene_io.h"
#include "oracles/surface/surface.h"

namespace cutproof::cli {

namespace {

struct InfoOptions {
  bool scene = false;   // print the reference of scene files
  bool limits = false;  // print how much is read
};

// When it is judged: a property of a state says so itself, one of a stage after the stages that promise it.
std::string due_of(const oracles::Property& property) {
  if (property.check_state != nullptr) return std::string(property.due.text);
  std::vector<std::string_view> names;
  for (const Stage stage : kStages) {
    if (property.promised_by.contains(stage)) names.push_back(name_of(stage));
  }
  return fmt::format("after {}", fmt::join(names, ", "));
}

// The fields of a state (model/fields.h), as recordings name them.
std::string basis_of(const oracles::Property& property) {
  if (property.rests_on == kAll) return "the whole state";
  std::vector<std::string_view> names;
  for_each_field([&](const Field& field, auto&&) {
    if ((property.rests_on & field.part) != 0) names.push_back(field.name);
  });
  return fmt::format("{}", fmt::join(names, ", "));
}

void print_properties() {
  fmt::print("properties: where each comes from, when it is judged, what it rests on\n");
  oracles::PropertyLists lists = oracles::properties();
  lists.push_back(&oracles::history_properties());
  for (const oracles::PropertyList* const list : lists) {
    for (const oracles::Property& property : *list) {
      fmt::print("  {:<21} {}\n  {:<21} {}; rests on {}\n", property.name, property.source, "", due_of(property),
                 basis_of(property));
    }
  }
}

int info(const InfoOptions& options) {
  if (options.scene) {
    fmt::print("{}", io::scene_reference());
    return 0;
  }
  if (options.limits) {
    fmt::print("{}", io::limits_reference());
    return 0;
  }
  fmt::print("cutproof {}\nbackends:\n", kVersion);
  for (const harness::BackendDescriptor& backend : harness::backends()) {
    fmt::print("  {:<11} {}\n", backend.name, harness::description_of(backend));
  }
  print_properties();
  fmt::print(
      "scene files: version 1 (`cutproof info --scene` lists every field)\n"
      "recordings: temporal VTKHDF 2.0, index version 2\n"
      "licence: sources MIT; this program links CGAL and SuiteSparse, which makes it GPL\n");
  return 0;
}

}  // namespace

void add_info(CLI::App& program, Work& work) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* const command = program.add_subcommand("info", "version, backends, devices, properties");
  command->add_flag("--scene", options->scene, "list every field of a scene file");
  command->add_flag("--limits", options->limits, "list how much is read of each kind of file");
  command->callback([options, &work] { work = [options] { return info(*options); }; });
}

}  // namespace cutproof::cli
