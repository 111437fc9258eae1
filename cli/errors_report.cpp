#include "cli/errors_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "cli/against_report.h"
#include "harness/geometry_json.h"
#include "model/error.h"
#include "model/io/json_number.h"

namespace cutproof::cli {

using harness::to_json;

using harness::Errors;
using harness::ErrorsWanted;
using oracles::ErrorNorm;

namespace {

using nlohmann::json;

json number_or_null(const std::optional<double>& value) { return value ? json_number(*value) : json(nullptr); }

// Frames of the lookup table: name on the command line, member, in the order of guide.md, Errors.
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
                       "use all, or some of implementation, solver, time_step, geometry, topology, conservation with "
                       "commas between them");
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
      frames.push_back({{"frame", frame},
                        {"max", json_number(error.position.max)},
                        {"rms", json_number(error.position.rms())},
                        {"energy", number_or_null(error.energy)},
                        {"by_energy", error.by_energy},
                        {"converged", error.converged}});
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
                                {"energy", number_or_null(c.energy)},
                                {"energy_bound", c.energy_bound},
                                {"angular_momentum", json_number(c.angular_momentum)},
                                {"holds", errors.holds()}};
    }
  }
  return result;
}

void print_errors(const Errors& errors, const harness::Lockstep* lockstep) {
  const auto or_dash = [](const std::optional<double>& value) { return value ? fmt::format("{:.3g}", *value) : "-"; };
  fmt::print("\nerrors\n");
  if (errors.wanted().implementation && lockstep != nullptr) {
    fmt::print("implementation  the table above\n");
  }
  if (errors.wanted().solver) {
    ErrorNorm all;
    std::optional<double> energy;
    int64_t unconverged = 0;
    for (const auto& [frame, error] : errors.solver()) {
      all.join(error.position);
      if (error.energy) energy = std::max(energy.value_or(0), *error.energy);
      unconverged += !error.converged;
    }
    fmt::print("solver          max {:.3g} h, RMS {:.3g} h, energy {} above the least; {} substeps{}\n", all.max,
               all.rms(), or_dash(energy), errors.solver().size(),
               unconverged > 0 ? fmt::format(", {} without a reference solution", unconverged) : "");
  }
  if (errors.time_step()) {
    fmt::print("time step       RMS up to {:.3g} h against 8 × the substeps, over {} frames{}\n",
               errors.time_step()->greatest_rms(), errors.time_step()->position.size(),
               errors.time_step()->first_difference
                   ? fmt::format(", until particle {} is removed by one only", *errors.time_step()->removed_otherwise)
                   : "");
  }
  if (errors.geometry()) {
    const oracles::CutGeometry& g = *errors.geometry();
    fmt::print(
        "geometry        Hausdorff {} h (skin to ideal {}, ideal to skin {}), {} h lost per cut area of {:.4g} h², "
        "at least {}\n",
        or_dash(g.hausdorff()), or_dash(g.skin_to_ideal), or_dash(g.ideal_to_skin), or_dash(g.lost_per_area),
        g.cut_area, or_dash(g.least_per_area));
    if (errors.overlap()) {
      fmt::print("                pieces share up to {:.3g} h³ (± {:.2g}), in frame {}\n",
                 errors.overlap()->found.volume, errors.overlap()->found.bound, errors.overlap()->frame);
    }
  }
  if (errors.wanted().topology) {
    fmt::print(
        "topology        {} components, {} couplings, {} shells; unequal in {} of {} frames; {} isolated groups\n",
        errors.topology().end.components, errors.topology().end.couplings, errors.topology().end.shells,
        errors.topology().unequal, errors.topology().frames, errors.topology().isolated);
  }
  if (errors.conservation()) {
    const oracles::Conservation& c = *errors.conservation();
    fmt::print(
        "conservation    {}: momentum {:.3g} m/s per mass ({:.3g} relative), bound {}; energy {}, bound {:.2g}; "
        "angular momentum {:.3g}; over {} substeps\n",
        errors.holds() ? "holds" : "FAILS", c.momentum, c.momentum_relative,
        errors.precision() == Precision::binary64 ? fmt::format("{:.2g} relative", harness::kDoubleDrift)
                                                  : fmt::format("{:.2g} m/s", c.momentum_bound),
        or_dash(c.energy), c.energy_bound, c.angular_momentum, c.substeps);
  }
}

}  // namespace cutproof::cli
