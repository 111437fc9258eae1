#include "harness/errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "model/io/json_number.h"
#include "model/error.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

json number_or_null(const std::optional<double>& value) { return value ? json_number(*value) : json(nullptr); }

// Frames of the lookup table: name on the command line, member, in the order of accuracy_and_speed.md §1.
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

bool conserved(Precision precision, const oracles::Conservation& found) {
  const bool momentum = precision == Precision::binary64 ? found.momentum_relative <= kDoubleDrift
                                                         : found.momentum <= found.momentum_bound;
  return momentum && found.mass == 0 && (!found.energy || *found.energy <= found.energy_bound);
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

TopologyFigures topology_of(const Setup& setup, const State& state) {
  TopologyFigures figures;
  figures.components = oracles::graph_components(setup, state).count;
  figures.couplings = oracles::coupling_components(setup, state).count;
  figures.shells = oracles::skin_shells(state.skin).outer;
  figures.isolated = static_cast<int64_t>(oracles::isolation(setup, state).measured);
  figures.equal = oracles::component_match(setup, state).holds;
  return figures;
}

Errors::Errors(const ErrorsWanted& wanted, const Setup& setup, const State& start, oracles::MakeBackend make)
    : wanted_(wanted), setup_(setup), precision_(start.precision), start_(start), make_(std::move(make)) {
  if (wanted_.solver) {
    judged_ = make_();
    exact_ = reference::make_backend();
  }
}

bool Errors::looked_at(int64_t frame) const {
  const int64_t frames = setup_.frame_count();
  // Frame f is the last one of its part if the next frame belongs to another.
  return (frame + 1) * kLookedAt / frames != frame * kLookedAt / frames;
}

bool Errors::wants(int64_t frame) const {
  return wanted_.topology || ((wanted_.solver || wanted_.geometry) && looked_at(frame));
}

void Errors::frame_begins(const State& state) {
  if (!wanted_.solver || !looked_at(state.frame)) return;
  if (auto error = oracles::solver_error(*judged_, *exact_, setup_, state)) solver_.push_back({state.frame, *error});
}

void Errors::frame_ends(const State& state) {
  const int64_t frame = state.frame - 1;
  const bool last = state.frame == setup_.frame_count();
  if (wanted_.topology && (last || !state.removed.empty())) {
    const TopologyFigures figures = topology_of(setup_, state);
    ++topology_.frames;
    topology_.isolated = std::max(topology_.isolated, figures.isolated);
    if (!figures.equal) {
      ++topology_.unequal;
      if (!topology_.first_unequal) topology_.first_unequal = frame;
    }
    topology_.end = figures;
  }
  if (wanted_.geometry && looked_at(frame)) {
    const oracles::Interpenetration found = oracles::interpenetration(setup_, state);
    // What is not a number stays.
    if (!overlap_ || !(found.volume <= overlap_->found.volume || std::isnan(overlap_->found.volume))) {
      overlap_ = Overlap{frame, found};
    }
  }
}

void Errors::finish(const State& end, const Against* against) {
  if (wanted_.implementation && against != nullptr) {
    implementation_ = against->to_json().at("lockstep").at("greatest");
    int64_t differences = 0;
    for (const LockstepFrame& frame : against->lockstep()) differences += frame.topology_differences;
    implementation_["topology_differences"] = differences;
  }
  if (wanted_.geometry) geometry_ = oracles::cut_geometry(setup_, start_, end);
  if (wanted_.time_step) time_step_ = oracles::time_step_error(make_, setup_, start_, setup_.frame_count());
  const bool any_alive = std::find(start_.alive.begin(), start_.alive.end(), 1) != start_.alive.end();
  if (wanted_.conservation && any_alive && setup_.frame_count() > 0) {
    const Setup free = oracles::free_setup(setup_, 0, kFreeFrames);
    State moving = start_;
    oracles::set_in_motion(free, moving);
    conservation_ = oracles::conservation(*make_(), free, moving);
  }
}

bool Errors::holds() const { return !conservation_ || conserved(precision_, *conservation_); }

json to_json(const oracles::CutGeometry& geometry) {
  return {{"cut_area", json_number(geometry.cut_area)},
          {"lost_volume", json_number(geometry.lost_volume)},
          {"lost_per_area", number_or_null(geometry.lost_per_area)},
          {"least_per_area", number_or_null(geometry.least_per_area)},
          {"hausdorff", number_or_null(geometry.hausdorff())},
          {"skin_to_ideal", number_or_null(geometry.skin_to_ideal)},
          {"ideal_to_skin", number_or_null(geometry.ideal_to_skin)},
          {"sampling", {{"skin_to_ideal", geometry.sampling_skin}, {"ideal_to_skin", geometry.sampling_ideal}}}};
}

json to_json(const oracles::Interpenetration& found) {
  return {{"volume", json_number(found.volume)}, {"bound", json_number(found.bound)}};
}

json Errors::to_json() const {
  json result = json::object();
  if (wanted_.implementation) result["implementation"] = implementation_;
  if (wanted_.solver) {
    json frames = json::array();
    oracles::Spread all;
    for (const auto& [frame, error] : solver_) {
      frames.push_back({{"frame", frame},
                        {"max", json_number(error.position.greatest)},
                        {"rms", json_number(error.position.rms())},
                        {"energy", number_or_null(error.energy)},
                        {"by_energy", error.by_energy},
                        {"converged", error.converged}});
      all.join(error.position);
    }
    result["solver"] = {{"max", json_number(all.greatest)}, {"rms", json_number(all.rms())}, {"frames", frames}};
  }
  if (wanted_.time_step && time_step_) {
    json max = json::array(), rms = json::array(), first = nullptr;
    for (const oracles::Spread& spread : time_step_->position) {
      max.push_back(json_number(spread.greatest));
      rms.push_back(json_number(spread.rms()));
    }
    if (time_step_->first_difference) {
      first = {{"frame", *time_step_->first_difference}, {"particle", *time_step_->removed_otherwise}};
    }
    result["time_step"] = {{"factor", 8},
                           {"frames", time_step_->position.size()},
                           {"greatest_rms", json_number(time_step_->greatest_rms())},
                           {"max", max},
                           {"rms", rms},
                           {"first_difference", first}};
  }
  if (wanted_.geometry && geometry_) {
    result["geometry"] = cli::to_json(*geometry_);
    result["geometry"]["interpenetration"] = nullptr;
    if (overlap_) {
      result["geometry"]["interpenetration"] = cli::to_json(overlap_->found);
      result["geometry"]["interpenetration"]["frame"] = overlap_->frame;
    }
  }
  if (wanted_.topology) {
    result["topology"] = {{"components", topology_.end.components}, {"couplings", topology_.end.couplings},
                          {"shells", topology_.end.shells},         {"frames", topology_.frames},
                          {"unequal", topology_.unequal},           {"first_unequal", nullptr},
                          {"isolated", topology_.isolated}};
    if (topology_.first_unequal) result["topology"]["first_unequal"] = *topology_.first_unequal;
  }
  if (wanted_.conservation) {
    result["conservation"] = nullptr;
    if (conservation_) {
      const oracles::Conservation& c = *conservation_;
      result["conservation"] = {{"substeps", c.substeps},
                                {"momentum", json_number(c.momentum)},
                                {"momentum_relative", json_number(c.momentum_relative)},
                                {"momentum_bound", c.momentum_bound},
                                {"mass", json_number(c.mass)},
                                {"energy", number_or_null(c.energy)},
                                {"energy_bound", c.energy_bound},
                                {"angular_momentum", json_number(c.angular_momentum)},
                                {"holds", conserved(precision_, c)}};
    }
  }
  return result;
}

void Errors::print() const {
  const auto or_dash = [](const std::optional<double>& value) { return value ? fmt::format("{:.3g}", *value) : "-"; };
  fmt::print("\nerrors\n");
  if (wanted_.implementation && !implementation_.is_null()) {
    fmt::print("implementation  the table above\n");
  }
  if (wanted_.solver) {
    oracles::Spread all;
    std::optional<double> energy;
    int64_t unconverged = 0;
    for (const auto& [frame, error] : solver_) {
      all.join(error.position);
      if (error.energy) energy = std::max(energy.value_or(0), *error.energy);
      unconverged += !error.converged;
    }
    fmt::print("solver          max {:.3g} h, RMS {:.3g} h, energy {} above the least; {} substeps{}\n", all.greatest,
               all.rms(), or_dash(energy), solver_.size(),
               unconverged > 0 ? fmt::format(", {} without a converged answer", unconverged) : "");
  }
  if (time_step_) {
    fmt::print("time step       RMS up to {:.3g} h against 8 × the substeps, over {} frames{}\n",
               time_step_->greatest_rms(), time_step_->position.size(),
               time_step_->first_difference
                   ? fmt::format(", until particle {} is removed by one only", *time_step_->removed_otherwise)
                   : "");
  }
  if (geometry_) {
    const oracles::CutGeometry& g = *geometry_;
    fmt::print(
        "geometry        Hausdorff {} h (skin to ideal {}, ideal to skin {}), {} h lost per cut area of {:.4g} h², "
        "at least {}\n",
        or_dash(g.hausdorff()), or_dash(g.skin_to_ideal), or_dash(g.ideal_to_skin), or_dash(g.lost_per_area),
        g.cut_area, or_dash(g.least_per_area));
    if (overlap_) {
      fmt::print("                pieces share up to {:.3g} h³ (± {:.2g}), in frame {}\n", overlap_->found.volume,
                 overlap_->found.bound, overlap_->frame);
    }
  }
  if (wanted_.topology) {
    fmt::print(
        "topology        {} components, {} couplings, {} shells; unequal in {} of {} frames; {} isolated groups\n",
        topology_.end.components, topology_.end.couplings, topology_.end.shells, topology_.unequal, topology_.frames,
        topology_.isolated);
  }
  if (conservation_) {
    const oracles::Conservation& c = *conservation_;
    fmt::print(
        "conservation    {}: momentum {:.3g} m/s per mass ({:.3g} relative), bound {}; energy {}, bound {:.2g}; "
        "angular momentum {:.3g}; over {} substeps\n",
        holds() ? "holds" : "FAILS", c.momentum, c.momentum_relative,
        precision_ == Precision::binary64 ? fmt::format("{:.2g} relative", kDoubleDrift)
                                          : fmt::format("{:.2g} m/s", c.momentum_bound),
        or_dash(c.energy), c.energy_bound, c.angular_momentum, c.substeps);
  }
}

}  // namespace cutproof::cli
