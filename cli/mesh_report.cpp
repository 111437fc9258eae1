#include "cli/mesh_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "cli/screen.h"
#include "fixtures/units.h"

namespace cutproof::cli {

namespace {

using fixtures::Defect;
using fixtures::MeshExamination;
using fixtures::RepairReport;

double cubed(double x) { return x * x * x; }

nlohmann::json repair_json(const RepairReport& report) {
  nlohmann::json steps = nlohmann::json::array();
  for (const fixtures::RepairStep& step : report.steps) {
    steps.push_back({{"name", step.name}, {"count", step.count}, {"text", step.text}});
  }
  return {{"steps", steps},
          {"warnings", report.warnings},
          {"triangles_before", report.triangles_before},
          {"triangles_after", report.triangles_after},
          {"volume_before", cubed(report.unit) * report.volume_before},
          {"volume_after", cubed(report.unit) * report.volume_after},
          {"volume_shared", cubed(report.unit) * report.volume_shared},
          {"volume_change", fixtures::volume_change(report)},
          {"volume_at_stake", fixtures::volume_at_stake(report)},
          {"cap_share", report.cap_share},
          {"made_up", report.is_made_up}};
}

nlohmann::json defects_json(const std::vector<Defect>& defects) {
  nlohmann::json list = nlohmann::json::array();
  for (const Defect& defect : defects) {
    list.push_back({{"where", defect.where}, {"problem", defect.problem}, {"remedy", defect.remedy}});
  }
  return list;
}

void print_defects(const std::vector<Defect>& defects) {
  for (const Defect& defect : defects) {
    insist("  {}\n", defect.problem);
    if (!defect.where.empty()) insist("    first: {}\n", defect.where);
  }
}

void print_volume(double volume) { say("volume {:.5g} cm³\n", 1e6 * volume); }

// Spacings that give bodies from a quick look to a large run.
constexpr std::array<int, 3> kUsualCounts = {2000, 8000, 100'000};

void print_usual_counts(double volume) {
  say("as a body:");
  for (const int count : kUsualCounts) {
    say("{} {} particles at h = {:.3g} mm", count == kUsualCounts.front() ? "" : ",", count,
        1e3 * std::cbrt(volume / count));
  }
  say("\n");
}

}  // namespace

CLI::Option* add_unit(CLI::App& command, std::string& unit) {
  std::vector<std::string> names;
  for (const fixtures::MeshUnit& each : fixtures::kMeshUnits) names.emplace_back(each.name);
  return command.add_option("--unit", unit, "unit of the mesh's numbers: mm, cm or m")
      ->capture_default_str()
      ->type_name("U")
      ->check(one_of(names));
}

double metres_per(const std::string& unit) {
  const auto& units = fixtures::kMeshUnits;
  return std::find_if(units.begin(), units.end(), [&](const auto& each) { return unit == each.name; })->metres;
}

fixtures::OnRepairStep repair_progress() {
  const auto line = std::make_shared<Progress>("repair", 0);
  return [line](std::string_view what) { line->tell(what); };
}

void print_build(const fixtures::BuildReport& built) {
  if (built.repair) {
    for (const std::string& line : fixtures::report_lines(*built.repair)) say("{}\n", line);
  }
  for (const std::string& note : built.notes) say("{} {}\n", lesser("note:"), note);
}

nlohmann::json build_json(const fixtures::BuildReport& built) {
  nlohmann::json build = {{"notes", built.notes}};
  if (built.repair) build["repair"] = repair_json(*built.repair);
  return build;
}

void print_examination(const MeshExamination& mesh, const std::string& unit) {
  const Vec3 size = 1e3 * (mesh.bounds.high - mesh.bounds.low);
  say("mesh {}: {} vertices, {} triangles, {} component{}\n", mesh.name, mesh.points, mesh.triangles, mesh.components,
      mesh.components == 1 ? "" : "s");
  say("size {:.4g} × {:.4g} × {:.4g} mm, one unit being 1 {} (--unit changes that)\n", size.x, size.y, size.z, unit);
  if (mesh.defects.empty()) {
    print_volume(mesh.volume);
    print_usual_counts(mesh.volume);
    insist("{}\n", holding("it bounds a solid"));
    return;
  }
  insist("it does {} bound a solid:\n", failing("not"));
  print_defects(mesh.defects);
  if (!mesh.repaired_defects.empty()) {
    insist("--repair would not help; remaining defects:\n");
    print_defects(mesh.repaired_defects);
  } else {
    insist("--repair would make it a solid:\n");
  }
  for (const std::string& line : fixtures::report_lines(*mesh.repair)) say("  {}\n", line);
  if (mesh.repaired_defects.empty() && fixtures::volume_at_stake(*mesh.repair) > kMostRepairChange) {
    insist("a run refuses this repair unless --repair-change allows it: {}\n",
           fixtures::stake_in_words(*mesh.repair, kMostRepairChange));
  }
  if (mesh.repaired_defects.empty()) {
    print_volume(mesh.repaired_volume);
    print_usual_counts(mesh.repaired_volume);
  }
}

nlohmann::json examination_json(const MeshExamination& mesh, const std::string& file, double unit) {
  const auto vector = [](Vec3 v) { return nlohmann::json::array({v.x, v.y, v.z}); };
  nlohmann::json document = {{"format", "cutproof.mesh"},      {"format_version", 1},
                             {"cutproof", kVersion},           {"source", file},
                             {"metres_per_unit", unit},        {"vertices", mesh.points},
                             {"triangles", mesh.triangles},    {"components", mesh.components},
                             {"low", vector(mesh.bounds.low)}, {"high", vector(mesh.bounds.high)},
                             {"solid", mesh.defects.empty()},  {"defects", defects_json(mesh.defects)}};
  if (mesh.defects.empty()) document["volume"] = mesh.volume;
  if (mesh.repair) {
    document["repair"] = repair_json(*mesh.repair);
    document["repair"]["solid"] = mesh.repaired_defects.empty();
    document["repair"]["defects"] = defects_json(mesh.repaired_defects);
    if (mesh.repaired_defects.empty()) document["repair"]["volume"] = mesh.repaired_volume;
  }
  return document;
}

}  // namespace cutproof::cli
