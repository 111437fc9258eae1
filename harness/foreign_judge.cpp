#include "harness/foreign_judge.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/depth.h"
#include "oracles/oracles.h"

namespace cutproof::harness {

namespace {

// What a property needs of a file: one of each list.
struct Needs {
  std::string_view property;
  std::vector<std::vector<std::string_view>> arrays;
};

const std::vector<Needs>& all_needs() {
  static const std::vector<Needs> needs = {
      {"rest frames", {{"rest_centers", "cluster_masses"}}},
      {"rotation", {{"rotations"}}},
      {"rotation match", {{"rotations"}, {"rest", "nodes"}}},
      {"best rotation", {{"rotations"}, {"rest", "nodes"}}},
      {"merge maximality", {{"tau"}}},
      {"tissue kept", {{"removed"}}},
      {"skin surface", {{"vertices"}}},
      {"skin match", {{"vertices"}, {"vertex_owner"}}},
      {"skin vertices", {{"vertices"}, {"vertex_owner"}, {"rotations"}}},
      {"skin shells", {{"vertices"}, {"vertex_owner"}}},
      {"skin geometry", {{"vertices"}, {"vertex_owner"}}},
  };
  return needs;
}

// The sentence that names what is missing; "" if all is there.
std::string missing(const ForeignState& foreign, std::string_view property) {
  for (const Needs& needs : all_needs()) {
    if (needs.property != property) continue;
    for (const auto& choice : needs.arrays) {
      const auto there = [&](std::string_view name) { return foreign.given.contains(name); };
      if (std::any_of(choice.begin(), choice.end(), there)) continue;
      std::string names;
      for (const std::string_view name : choice) names += (names.empty() ? "" : " or ") + std::string(name);
      return fmt::format("the file has no {}", names);
    }
  }
  return "";
}

// Centers that were given without rest positions have nothing to be compared with.
bool centers_hang_in_the_air(const ForeignState& foreign) {
  return foreign.given.contains("rest_centers") && !foreign.given.contains("rest") && !foreign.given.contains("nodes");
}

std::string why_not(const ForeignState& foreign, const oracles::Property& property) {
  if (property.check_state == nullptr) return "one state does not show what a stage does";
  if (property.name == "no pass") return "a file of arrays has no blade";
  if (!foreign.promises.cover(property.name)) return "not promised";
  // Rotations are taken before the positions that follow from them, so this goes without saying of nobody.
  if (property.name == "best rotation" && !foreign.promises_given) return "not promised";
  if (std::string why = missing(foreign, property.name); !why.empty()) return why;
  if (property.name == "rest frames" && centers_hang_in_the_air(foreign)) return "the file has no rest or nodes";
  return "";
}

Verdict closed(const ForeignState& foreign) {
  Verdict verdict = oracles::closed_surface(foreign.loose_skin);
  const auto& alive = foreign.state.alive;
  if (foreign.loose_skin.triangles.empty() && std::find(alive.begin(), alive.end(), 1) != alive.end()) {
    verdict.holds = false;
    verdict.vacuous.clear();
    verdict.measured = 1;
    verdict.witness.text = "tissue is alive, and there is no skin";
  }
  return verdict;
}

Verdict malformed(const ForeignState& foreign) {
  const oracles::Property& form = oracles::core_properties().front();
  Verdict verdict;
  verdict.property = form.name;
  verdict.unit = form.unit;
  verdict.bound_source = form.source;
  verdict.holds = false;
  verdict.measured = 1;
  verdict.checked = 1;
  verdict.witness.text = foreign.defect;
  return verdict;
}

// Beyond that the state can be read and has no NaN.
bool anything_was_judged(const std::vector<Verdict>& verdicts) {
  return std::any_of(verdicts.begin(), verdicts.end(), [](const Verdict& verdict) {
    return verdict.property != "well formed" && verdict.property != "finite" && verdict.checked > 0;
  });
}

void note_what_matters(const ForeignState& foreign, ForeignVerdicts& found) {
  if (!foreign.promises_given) {
    found.notes.push_back("The file has no promises: all that its arrays allow was judged.");
  }
  if (foreign.state.precision == Precision::binary32 && foreign.defect.empty()) {
    found.notes.push_back(
        fmt::format("Some of the file is float32: rest frames and skin are judged as single precision, in which an "
                    "absolute coordinate is off by up to {:.2g} h.",
                    foreign.state.place_rounding / foreign.setup.body.grid.spacing));
  }
  if (foreign.promises.cover("rest frames") && !foreign.given.contains("mass") &&
      (foreign.given.contains("rest_centers") || foreign.given.contains("cluster_masses"))) {
    found.notes.push_back("The file has no mass: each particle was taken to have mass 1.");
  }
}

}  // namespace

bool ForeignVerdicts::holds() const {
  return std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& verdict) { return verdict.holds; });
}

ForeignVerdicts judge_foreign_state(const ForeignState& foreign) {
  ForeignVerdicts found;
  oracles::PropertyLists lists = properties_of(Depth::motion);
  lists.push_back(&oracles::lone_state_properties());
  const bool surface_alone = foreign.loose_skin.position.size() + foreign.loose_skin.triangles.size() > 0 ||
                             (foreign.given.contains("vertices") && !foreign.given.contains("vertex_owner"));

  std::vector<Verdict> due;
  if (foreign.defect.empty()) {
    due = oracles::Judge(foreign.setup, lists).state(foreign.state, Stage::skin, true);
  } else {
    due = {malformed(foreign)};
  }
  const bool well_formed = due.front().holds;
  for (const oracles::PropertyList* const list : lists) {
    for (const oracles::Property& property : *list) {
      std::string why = why_not(foreign, property);
      const auto verdict =
          std::find_if(due.begin(), due.end(), [&](const Verdict& v) { return v.property == property.name; });
      const bool is_form = property.name == due.front().property;
      if (why.empty() && !well_formed && !is_form) why = "the state is not well formed";
      if (why.empty() && surface_alone && property.name == "skin surface") {
        found.verdicts.push_back(closed(foreign));
        continue;
      }
      if (why.empty() && verdict == due.end()) why = fmt::format("not due: {}", property.due.text);
      if (!why.empty()) {
        found.not_judged.push_back({std::string(property.name), std::move(why)});
        continue;
      }
      found.verdicts.push_back(*verdict);
    }
  }
  Verdict judged;
  judged.property = "something was judged";
  judged.unit = "1";
  judged.bound_source = "oracles.md, Somebody else's state";
  judged.checked = 1;
  judged.measured = anything_was_judged(found.verdicts) ? 1 : 0;
  judged.bound = 1;
  judged.holds = judged.measured > 0;
  if (!judged.holds) {
    judged.witness.text = "there was nothing to judge: no particles, or nothing of what is promised is in the file";
  }
  if (well_formed) found.verdicts.push_back(std::move(judged));
  for (Verdict& verdict : found.verdicts) {
    verdict.frame = 0;
    verdict.backend = "file";
    if (!verdict.holds || verdict.checked > 0 || !verdict.vacuous.empty()) continue;
    verdict.vacuous = "nothing to look at";
  }
  note_what_matters(foreign, found);
  return found;
}

}  // namespace cutproof::harness
