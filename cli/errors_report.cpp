#include "cli/errors_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "cli/against_report.h"
#include "cli/screen.h"
#include "harness/geometry_json.h"
#include "model/error.h"
#include "model/io/columns.h"
#include "model/io/filled.h"
#include "model/io/json_number.h"
#include "model/nearest_word.h"

namespace cutproof::cli {

using harness::to_json;

using harness::Errors;
using harness::ErrorsWanted;
using oracles::ErrorNorm;

namespace {

using nlohmann::json;

// Frames of the lookup table: name on the command line, member, in the order of measure_and_tune.md, Errors.
struct Kind {
  const char* name;
  bool ErrorsWanted::*member;
};
constexpr std::array<Kind, 6> kKinds = {{{"implementation", &ErrorsWanted::implementation},
                                         {"solver", &ErrorsWanted::solver},
                                         {"time_step", &ErrorsWanted::time_step},
                                         {"geometry", &ErrorsWanted::geometry},
                                         {"topology", &ErrorsWanted::topology},
                                         {"conservation", &ErrorsWanted::conservation}}};

json implementation_json(const harness::Lockstep* lockstep) {
  if (lockstep == nullptr) return nullptr;
  json result = worst_json(*lockstep);
  int64_t differences = 0;
  for (const harness::LockstepFrame& frame : lockstep->frames()) differences += frame.topology_differences;
  result["topology_differences"] = differences;
  return result;
}

}  // namespace

std::vector<std::string> error_names() {
  std::vector<std::string> names = {"all"};
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

ErrorsWanted errors_wanted(const std::string& list) {
  ErrorsWanted wanted;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) {
    bool known = name == "all";
    for (const Kind& kind : kKinds) {
      if (name != "all" && name != kind.name) continue;
      wanted.*kind.member = true;
      known = true;
    }
    if (!known) {
      throw InputError("command line", "--errors", fmt::format("there is no error '{}'", name),
                       did_you_mean(name, error_names()) +
                           fmt::format("use some of {} with commas between them", fmt::join(error_names(), ", ")));
    }
  }
  return wanted;
}

json to_json(const Errors& errors, const harness::Lockstep* lockstep) {
  json result = json::object();
  if (errors.wanted().implementation) result["implementation"] = implementation_json(lockstep);
  if (errors.wanted().solver) {
    json frames = json::array();
    ErrorNorm all;
    for (const auto& [frame, error] : errors.solver()) {
      json elsewhere = nullptr;
      if (error.elsewhere) {
        elsewhere = {{"distance", json_number(error.elsewhere->distance)},
                     {"energy", json_number(error.elsewhere->energy)}};
      }
      frames.push_back({{"frame", frame},
                        {"max", json_number(error.position.max)},
                        {"rms", json_number(error.position.rms())},
                        {"energy", json_number(error.energy)},
                        {"by_energy", error.solved_by == oracles::SolvedBy::minimum},
                        {"solved_by", name_of(error.solved_by)},
                        {"converged", error.converged},
                        {"elsewhere", elsewhere}});
      all.join(error.position);
    }
    result["solver"] = {{"max", json_number(all.max)}, {"rms", json_number(all.rms())}, {"frames", frames}};
  }
  if (errors.wanted().time_step && errors.time_step()) {
    json max = json::array(), rms = json::array(), first = nullptr;
    for (const ErrorNorm& norm : errors.time_step()->position) {
      max.push_back(json_number(norm.max));
      rms.push_back(json_number(norm.rms()));
    }
    if (errors.time_step()->first_difference) {
      first = {{"frame", *errors.time_step()->first_difference}, {"particle", *errors.time_step()->removed_otherwise}};
    }
    result["time_step"] = {{"factor", 8},
                           {"frames", errors.time_step()->position.size()},
                           {"greatest_rms", json_number(errors.time_step()->greatest_rms())},
                           {"max", max},
                           {"rms", rms},
                           {"first_difference", first}};
  }
  if (errors.wanted().geometry && errors.geometry()) {
    result["geometry"] = to_json(*errors.geometry());
    result["geometry"]["interpenetration"] = nullptr;
    if (errors.overlap()) {
      result["geometry"]["interpenetration"] = to_json(errors.overlap()->found);
      result["geometry"]["interpenetration"]["frame"] = errors.overlap()->frame;
    }
  }
  if (errors.wanted().topology) {
    result["topology"] = {
        {"components", errors.topology().end.components}, {"couplings", errors.topology().end.couplings},
        {"shells", errors.topology().end.shells},         {"frames", errors.topology().frames},
        {"unequal", errors.topology().unequal},           {"first_unequal", nullptr},
        {"isolated", errors.topology().isolated}};
    if (errors.topology().first_unequal) result["topology"]["first_unequal"] = *errors.topology().first_unequal;
  }
  if (errors.wanted().conservation) {
    result["conservation"] = nullptr;
    if (errors.conservation()) {
      const oracles::Conservation& c = *errors.conservation();
      result["conservation"] = {{"substeps", c.substeps},
                                {"momentum", json_number(c.momentum)},
                                {"momentum_relative", json_number(c.momentum_relative)},
                                {"momentum_bound", c.momentum_bound},
                                {"mass", json_number(c.mass)},
                                {"energy", json_number(c.energy)},
                                {"energy_bound", c.energy_bound},
                                {"angular_momentum", json_number(c.angular_momentum)},
                                {"holds", errors.holds()}};
    }
  }
  return result;
}

void print_errors(const Errors& errors, const json& document) {
  constexpr std::size_t kName = 16;
  say("\nerrors\n");
  // Errors that were not measured are absent or null.
  const auto row = [&](const char* kind, const char* name, const std::string& text) {
    if (!document.contains(kind) || document.at(kind).is_null()) return std::string();
    return io::hanging(fmt::format("{:<{}}{}", name, kName, io::filled(text, document.at(kind))), kName) + "\n";
  };
  say_text(row("implementation", "implementation", "the table above"));
  std::optional<double> energy;
  int64_t unconverged = 0, by_iteration = 0;
  for (const auto& [frame, error] : errors.solver()) {
    if (error.energy) energy = std::max(energy.value_or(0), *error.energy);
    unconverged += !error.converged;
    by_iteration += error.converged && error.solved_by == oracles::SolvedBy::iteration;
  }
  say_text(row("solver", "solver",
               fmt::format("max {{max:.3g}} h, RMS {{rms:.3g}} h, energy {} above the least; {} substeps{}{}",
                           energy ? fmt::format("{:.3g}", *energy) : "-", errors.solver().size(),
                           by_iteration > 0 ? fmt::format(", {} beside where plain iterations end", by_iteration) : "",
                           unconverged > 0 ? fmt::format(", {} without a reference solution", unconverged) : "")));
  const auto& steps = errors.time_step();
  say_text(
      row("time_step", "time step",
          fmt::format("RMS up to {{greatest_rms:.3g}} h against {{factor}} × the substeps, over {{frames}} frames{}",
                      steps && steps->first_difference
                          ? fmt::format(", until particle {} is removed by one only", *steps->removed_otherwise)
                          : "")));
  say_text(row("geometry", "geometry",
               "Hausdorff {hausdorff:.3g} h (skin to ideal {skin_to_ideal:.3g}, ideal to skin {ideal_to_skin:.3g}), "
               "{lost_per_area:.3g} h lost per cut area of {cut_area:.4g} h², at least {least_per_area:.3g}"));
  if (errors.overlap()) {
    say_text(row("geometry", "",
                 "pieces share up to {interpenetration/volume:.3g} h³ (± {interpenetration/bound:.2g}), in frame "
                 "{interpenetration/frame}"));
  }
  say_text(row("topology", "topology",
               "{components} components, {couplings} couplings, {shells} shells; unequal in {unequal} of {frames} "
               "frames; {isolated} isolated groups"));
  const bool is_double = errors.precision() == Precision::binary64;
  const std::string conservation = row(
      "conservation", "conservation",
      fmt::format("{}: momentum {{momentum:.3g}} m/s per mass ({{momentum_relative:.3g}} relative), bound {}; energy "
                  "{{energy:.3g}}, bound {{energy_bound:.2g}}; angular momentum {{angular_momentum:.3g}}; over "
                  "{{substeps}} substeps",
                  errors.holds() ? holding("holds") : failing("FAILS"),
                  is_double ? fmt::format("{:.2g} relative", harness::kDoubleDrift) : "{momentum_bound:.2g} m/s"));
  errors.holds() ? say_text(conservation) : insist_text(conservation);
}

}  // namespace cutproof::cli
