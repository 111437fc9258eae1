#include "harness/foreign_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "harness/depth.h"
#include "model/at.h"
#include "model/counted.h"
#include "oracles/oracles.h"
#include "oracles/piece_sizes.h"
#include "oracles/shells.h"

namespace cutproof::harness {

namespace {

// Arrays that a property needs: one of each list.
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
  if (property.check_state == nullptr) return "one state does not show the effect of a stage";
  if (property.name == "no pass") return "a file of arrays has no blade";
  if (!foreign.promises.cover(property.name)) return "not promised";
  // Simulators take rotations before the positions that follow from them, so no default promises this.
  if (property.name == "best rotation" && !foreign.promises_given) return "not promised";
  if (std::string why = missing(foreign, property.name); !why.empty()) return why;
  if (property.name == "rest frames" && centers_hang_in_the_air(foreign)) return "the file has no rest or nodes";
  return "";
}

// A verdict of no row of the registry.
Verdict of_file(std::string_view property, std::string_view source) {
  Verdict verdict;
  verdict.property = property;
  verdict.unit = "1";
  verdict.bound_source = source;
  return verdict;
}

Verdict malformed(const ForeignState& foreign) {
  const oracles::Property& form = oracles::core_properties().front();
  Verdict verdict = of_file(form.name, form.source);
  verdict.holds = false;
  verdict.measured = 1;
  verdict.checked = 1;
  verdict.witness.text = foreign.defect;
  return verdict;
}

// From present positions where rest is not known: a single distant particle would determine the longest edge.
double median_edge(const ForeignState& foreign) {
  const Body& body = foreign.setup.body;
  std::vector<double> lengths;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (const int32_t other : body.neighbours(i)) {
      if (other > i && body.rest_length(i, other) > 0) lengths.push_back(body.rest_length(i, other));
    }
  }
  if (lengths.empty()) return body.grid.spacing;
  const auto middle = lengths.begin() + std::ssize(lengths) / 2;
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

// Far enough from the origin the coordinates of two neighbours are the same number. No tissue, and no material, can be
// stretched a thousandfold (tolerances.md, Absolute coordinates).
Verdict plausible_places(const ForeignState& foreign) {
  constexpr double kMostStretch = 1000;
  Verdict verdict = of_file("plausible places", "tolerances.md, Absolute coordinates");
  verdict.bound = 1;
  const Body& body = foreign.setup.body;
  const State& state = foreign.state;
  const bool rests = foreign.given.contains("rest") || foreign.given.contains("nodes");
  const double h = rests ? body.grid.spacing : median_edge(foreign), u = unit_roundoff(state.precision);
  const auto see = [&](double measured, std::vector<int32_t> particles, const auto& text) {
    if (!(measured > verdict.measured)) return;
    verdict.measured = measured;
    if (measured <= verdict.bound) return;
    verdict.holds = false;
    verdict.witness.particles = std::move(particles);
    verdict.witness.text = text();
  };
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 x = state.x[at(i)];
    if (state.alive[at(i)] == 0 || !is_finite(x)) continue;
    ++verdict.checked;
    const double reach = std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)});
    see(2 * u * reach / h, {i}, [&] {
      return fmt::format("particle {} is at ({:.6g}, {:.6g}, {:.6g}) m, where coordinates are {:.3g} h apart", i, x.x,
                         x.y, x.z, 2 * u * reach / h);
    });
    if (!rests) continue;
    for (const int32_t other : body.neighbours(i)) {
      if (other < i || state.alive[at(other)] == 0 || !is_finite(state.x[at(other)])) continue;
      const Vec3 d = state.x[at(other)] - x;
      const double length = std::hypot(d.x, d.y, d.z), rest = body.rest_length(i, other);
      if (!(rest > 0)) continue;
      see(length / rest / kMostStretch, {i, other}, [&] {
        return fmt::format("the edge of particles {} and {} is {:.3g} times as long as at rest", i, other,
                           length / rest);
      });
    }
  }
  if (verdict.checked == 0) verdict.vacuous = "nothing is alive";
  return verdict;
}

// Living particles with one rest position, within rounding; where rest is not known, with one present position.
struct Coincident {
  int64_t particles = 0;  // of which another is at the same place
  int32_t first = -1, second = -1;
};
Coincident coincident_particles(const ForeignState& foreign) {
  const Body& body = foreign.setup.body;
  const State& state = foreign.state;
  const double h = body.grid.spacing, near = std::min(8 * state.place_rounding, h / 64);
  // Places that are near have the same box, unless a face lies between them: then other boxes tell.
  const double side = near > 0 ? std::min(64 * near, h / 8) : h / 8;
  struct Boxed {
    std::array<int64_t, 3> box;
    int32_t particle;
  };
  Coincident found;
  if (body.on_grid()) return found;  // two particles on one node are not well formed
  std::vector<uint8_t> seen(state.x.size(), 0);
  for (const double offset : {0.0, 0.37, 0.71}) {
    std::vector<Boxed> boxed;
    for (int32_t i = 0; i < body.particle_count(); ++i) {
      const Vec3 x = body.rest_position(i);
      if (state.alive[at(i)] == 0 || !is_finite(x) || !(norm(x) < 0x1p60 * side)) continue;
      Boxed& each = boxed.emplace_back(Boxed{{}, i});
      for (int axis = 0; axis < 3; ++axis) {
        each.box[at(axis)] = static_cast<int64_t>(std::floor(x[axis] / side + offset));
      }
    }
    std::sort(boxed.begin(), boxed.end(),
              [](const Boxed& a, const Boxed& b) { return std::tie(a.box, a.particle) < std::tie(b.box, b.particle); });
    for (std::size_t first = 0, k = 1; k < boxed.size(); ++k) {
      if (boxed[k].box != boxed[first].box) {
        first = k;
        continue;
      }
      const int32_t a = boxed[first].particle, b = boxed[k].particle;
      if (seen[at(b)] != 0 || norm(body.rest_position(a) - body.rest_position(b)) > near) continue;
      seen[at(b)] = 1;
      ++found.particles;
      if (found.second < 0 || b < found.second) {
        found.first = a;
        found.second = b;
      }
    }
  }
  return found;
}

Verdict as_many_pieces(const ForeignState& foreign, const ForeignVerdicts& found) {
  Verdict verdict = of_file("pieces", "state.md, A state");
  verdict.checked = 1;
  verdict.measured = static_cast<double>(*found.pieces);
  verdict.bound = static_cast<double>(*foreign.pieces);
  verdict.holds = *found.pieces == *foreign.pieces;
  if (!verdict.holds) {
    verdict.witness.text =
        fmt::format("the tissue is {}, and the file says {}", found.pieces_in_words, *foreign.pieces);
  }
  return verdict;
}

void look_at_pieces(const ForeignState& foreign, ForeignVerdicts& found) {
  const oracles::Partition pieces = oracles::graph_components(foreign.setup.body, foreign.state.alive);
  found.pieces = pieces.count;
  found.pieces_in_words = oracles::pieces_in_words(pieces);
  const Coincident coincident = coincident_particles(foreign);
  found.coincident = coincident.particles;
  if (coincident.particles > 0) {
    found.notes.push_back(fmt::format(
        "{} where another one is, first particle {} where particle {} is. Is this an unwelded seam?",
        counted(coincident.particles, "particle is", "particles are"), coincident.second, coincident.first));
  }
}

// Says with which weights rest frames were asked, and whether the other ones explain what was given.
void explain_weights(const ForeignState& foreign, Verdict& verdict) {
  const State& given = foreign.state;
  State other = given;
  Setup setup = foreign.setup;
  std::vector<int32_t> held(given.x.size(), 0);
  for (const int32_t i : given.clusters.members) ++held[at(i)];
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (held[i] > 0)
      setup.body.mass[i] = foreign.plain_weights ? setup.body.mass[i] / held[i] : setup.body.mass[i] * held[i];
  }
  // Missing rest frames follow from the requested weights.
  for (int32_t c = 0; c < given.clusters.count(); ++c) {
    double mass = 0;
    Vec3 sum;
    for (const int32_t i : given.clusters.of(c)) {
      const double w = setup.body.mass[at(i)] / held[at(i)];
      mass += w;
      sum += w * setup.body.rest_position(i);
    }
    if (!foreign.given.contains("cluster_masses")) other.clusters.mass[at(c)] = mass;
    if (!foreign.given.contains("rest_centers")) other.clusters.rest_center[at(c)] = sum / mass;
  }
  const bool explains = oracles::rest_frames(setup, other).holds;
  const char* const shared = "mass / number of containing clusters";
  verdict.witness.text +=
      fmt::format("; the requested weights are {}", foreign.plain_weights ? "plain masses" : shared);
  if (explains) {
    verdict.witness.text += foreign.plain_weights
                                ? fmt::format(", and with {} all is right: write the text weights = 'shared'", shared)
                                : ", and with plain masses all is right: write the text weights = 'plain'";
  }
}

// Beyond that the state can be read and has no NaN.
bool anything_was_judged(const std::vector<Verdict>& verdicts) {
  return std::any_of(verdicts.begin(), verdicts.end(), [](const Verdict& verdict) {
    constexpr std::array kOfEverybody = {std::string_view("well formed"), std::string_view("finite"),
                                         std::string_view("plausible places")};
    return verdict.checked > 0 &&
           std::find(kOfEverybody.begin(), kOfEverybody.end(), verdict.property) == kOfEverybody.end();
  });
}

void note_what_matters(const ForeignState& foreign, ForeignVerdicts& found) {
  if (!foreign.promises_given) {
    found.notes.push_back("The file has no promises: every property was judged that its arrays allow.");
  }
  if (foreign.state.precision == Precision::binary32 && foreign.defect.empty()) {
    found.notes.push_back(
        fmt::format("Some of the file is float32: rest frames, rotations and skin are judged as single precision, in "
                    "which an absolute coordinate is off by up to {:.2g} h.",
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

Verdict closed_skin(const Skin& skin, bool any_alive) {
  Verdict verdict = oracles::closed_surface(skin);
  if (skin.triangles.empty() && any_alive) {
    verdict.holds = false;
    verdict.vacuous.clear();
    verdict.measured = 1;
    verdict.witness.text = "tissue is alive, and there is no skin";
  }
  return verdict;
}

ForeignVerdicts judge_foreign_state(const ForeignState& foreign) {
  ForeignVerdicts found;
  found.notes = foreign.notes;
  oracles::PropertyLists lists = properties_of(Depth::motion);
  lists.push_back(&oracles::lone_state_properties());
  const bool surface_alone = foreign.loose_skin.position.size() + foreign.loose_skin.triangles.size() > 0 ||
                             (foreign.given.contains("vertices") && !foreign.given.contains("vertex_owner"));
  const auto& alive = foreign.state.alive;
  const bool any_alive = std::find(alive.begin(), alive.end(), 1) != alive.end();

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
        found.verdicts.push_back(closed_skin(foreign.loose_skin, any_alive));
        continue;
      }
      // Of vertices without owners nothing is known but where they are, which is all that such a promise is about.
      const bool is_free_match =
          property.name == "skin match" && foreign.promises.free_skin_places() && foreign.given.contains("vertices");
      if (is_free_match && well_formed) {
        const Verdict surface = closed_skin(surface_alone ? foreign.loose_skin : foreign.state.skin, any_alive);
        if (surface.holds) {
          found.verdicts.push_back(oracles::free_skin_match(foreign.setup, foreign.state,
                                                            surface_alone ? foreign.loose_skin : foreign.state.skin));
        } else {
          found.not_judged.push_back({std::string(property.name), "the skin is no closed surface"});
        }
        continue;
      }
      if (why.empty() && verdict == due.end()) why = fmt::format("not due: {}", property.due.text);
      if (!why.empty()) {
        found.not_judged.push_back({std::string(property.name), std::move(why)});
        continue;
      }
      found.verdicts.push_back(*verdict);
      if (property.name == "rest frames" && !verdict->holds) explain_weights(foreign, found.verdicts.back());
    }
  }
  if (well_formed) {
    look_at_pieces(foreign, found);
    found.verdicts.push_back(plausible_places(foreign));
    if (foreign.pieces) found.verdicts.push_back(as_many_pieces(foreign, found));
  }
  Verdict judged = of_file("something was judged", "oracles.md, A state from a file");
  judged.checked = 1;
  judged.holds = anything_was_judged(found.verdicts);
  judged.measured = judged.holds ? 0 : 1;
  if (!judged.holds) {
    judged.witness.text = "there was nothing to judge: no particles, or no array of any promised property";
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
