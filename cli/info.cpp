// `cutproof info`: backends, devices, properties, version; a mesh, examined.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <ctime>
#include <memory>
#include <vector>

#include "cli/commands.h"
#include "cli/errors_report.h"
#include "cli/mesh_report.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/reference_pages.h"
#include "cli/scene_files.h"
#include "cli/screen.h"
#include "fixtures/build.h"
#include "fixtures/import/mesh.h"
#include "fixtures/material.h"
#include "guests/questions/vectors.h"
#include "harness/promises.h"
#include "model/error.h"
#include "model/fields.h"
#include "model/io/columns.h"
#include "model/io/limits.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "oracles/surface/surface.h"

namespace cutproof::cli {

namespace {

struct InfoOptions {
  bool scene = false;    // print the reference of scene files
  bool schema = false;   // print the JSON Schema of scene files
  bool scenes = false;   // print the scenes that come with the program
  bool limits = false;   // print how much is read
  std::string material;  // print that of this scene
  std::string mesh;      // examine it
  std::string unit = "mm";
  std::string json;
  bool man = false;        // print the manual page
  std::string completion;  // print what this shell offers
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
  insist("properties: source, time of judging, assumptions\n");
  oracles::PropertyLists lists = oracles::properties();
  lists.push_back(&oracles::lone_state_properties());
  for (const oracles::PropertyList* const list : lists) {
    for (const oracles::Property& property : *list) {
      insist("{}\n", io::hanging(fmt::format("  {:<21} {}", property.name, property.source), 24));
      insist("{}\n",
             io::hanging(fmt::format("  {:<21} {}; rests on {}", "", due_of(property), basis_of(property)), 24));
    }
  }
}

int print_scene_names() {
  const std::vector<std::string> names = scene_names();
  if (names.empty()) {
    throw InputError("cutproof info", "--scenes", "The scenes that come with the program are missing.",
                     "Run the program from its build or its package, or give a scene file.");
  }
  for (const std::string& name : names) insist("{}\n  {}\n", name, io::read_scene(scene_file(name)).description);
  return 0;
}

int print_material(const std::string& scene_name) {
  const std::string file = scene_file(scene_name);
  const Scene scene = io::read_scene(file);
  if (scene.step.solver != Solver::implicit) {
    throw InputError(file, "step.solver", "The solver \"published\" has no elastic modulus.",
                     "Choose \"solver\": \"implicit\".");
  }
  const fixtures::Built built = fixtures::build(scene, file);
  const fixtures::Cover cover = fixtures::measure_cover(built.setup.body, built.state.clusters, scene.clusters);
  const StepParameters& step = built.setup.step;
  const double dt =
      built.setup.substep_length.empty() ? scene.frame_length / step.substeps : built.setup.substep_length.front();
  for (const std::string& sentence :
       fixtures::sentences_of(fixtures::material_of(step, cover, scene.body.density), step, dt)) {
    insist("{}\n", io::hanging(sentence, 2));
  }
  return 0;
}

int examine(const InfoOptions& options) {
  const double unit = metres_per(options.unit);
  require_writable(options.json);
  const fixtures::MeshExamination mesh = fixtures::examine_mesh(options.mesh, unit, repair_progress());
  write_document(options.json, examination_json(mesh, options.mesh, unit));
  print_examination(mesh, options.unit);
  print_written(options.json);
  return mesh.defects.empty() ? 0 : 1;
}

// Every list of words that options know and remedies tell.
void print_words() {
  insist("  plugin:FILE.so  a plugin (cutproof/plugin.h)\n");
  const auto line = [](const char* what, const auto& words) {
    insist("{}\n", io::hanging(fmt::format("{}: {}", what, fmt::join(words, ", ")), 2));
  };
  line("schedules (--schedule)", harness::schedule_names());
  line("depths of judging (--check)", harness::kDepthNames);
  line("errors (--errors)", error_names());
  std::vector<std::string_view> promises, operations;
  for (const harness::PromiseWord& each : harness::promise_words()) promises.push_back(each.name);
  for (const guests::OperationDescription& each : guests::vector_operations()) operations.push_back(each.name);
  line("promises (--promises, and of plugins)", promises);
  line("operations (vectors)", operations);
}

// Date of the page: today, or the date of a reproducible build (reproducible-builds.org).
std::string date_of_build() {
  const char* const given = std::getenv("SOURCE_DATE_EPOCH");
  const std::time_t time =
      given != nullptr ? static_cast<std::time_t>(std::strtoll(given, nullptr, 10)) : std::time(nullptr);
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(time));
}

int info(const InfoOptions& options, const CLI::App& program) {
  if (options.scenes) return print_scene_names();
  if (!options.material.empty()) return print_material(options.material);
  if (!options.mesh.empty()) return examine(options);
  if (options.scene) {
    insist_text(io::scene_reference());
    return 0;
  }
  if (options.schema) {
    insist_as_it_is(io::scene_schema());
    return 0;
  }
  if (options.limits) {
    insist_text(io::limits_reference());
    return 0;
  }
  if (!options.completion.empty()) {
    insist_as_it_is(options.completion == "zsh"    ? zsh_completion(program)
                    : options.completion == "fish" ? fish_completion(program)
                                                   : bash_completion(program));
    return 0;
  }
  if (options.man) {
    insist_as_it_is(manual_page(program, date_of_build()));
    return 0;
  }
  insist("backends:\n");
  for (const harness::BackendDescriptor& backend : harness::backends()) {
    insist("{}\n", io::hanging(fmt::format("  {:<11} {}", backend.name, harness::description_of(backend)), 14));
  }
  print_words();
  print_properties();
  insist(
      "scene files: version {} (`cutproof info --scene` lists every field)\n"
      "recordings: temporal VTKHDF 2.0, format {}\n"
      "licence: sources MIT; this program links CGAL and SuiteSparse, which makes it GPL\n"
      "cutproof {}\n",
      kSceneVersion, io::kFormatVersion, kVersion);
  return 0;
}

}  // namespace

void add_info(CLI::App& program, Work& work) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* const command =
      program.add_subcommand("info", "list backends, devices, properties, version; examine a mesh");
  command->add_flag("--scene", options->scene, "list every field of a scene file");
  command->add_flag("--schema", options->schema, "print the JSON Schema of scene files, for editors");
  command->add_flag("--scenes", options->scenes, "list the scenes that come with the program");
  command
      ->add_option("--material", options->material,
                   "print Young's modulus and Poisson's ratio of a scene, and what its iterations make of them")
      ->type_name("SCENE");
  CLI::Option* const mesh = command
                                ->add_option("--mesh", options->mesh,
                                             "examine a surface mesh: defects, size, volume and effect of --repair; "
                                             "exit status 1 if the mesh bounds no solid")
                                ->type_name("FILE");
  add_unit(*command, options->unit)->needs(mesh);
  command->add_option("--json", options->json, "write findings on the mesh as JSON")->type_name("F")->needs(mesh);
  command->add_flag("--limits", options->limits, "list the size limits of each kind of file");
  command->add_flag("--man", options->man, "print the manual page, cutproof(1)");
  command->add_option("--completion", options->completion, "print a completion script for a shell: bash, zsh or fish")
      ->type_name("SHELL")
      ->check(one_of({"bash", "zsh", "fish"}));
  command->callback([options, &program, &work] { work = [options, &program] { return info(*options, program); }; });
}

}  // namespace cutproof::cli
