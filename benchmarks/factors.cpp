// `cutproof bench factors`: after a cut, is a factor of the substep's system updated or made anew?
#include "benchmarks/factors.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <utility>

#include "benchmarks/report.h"
#include "benchmarks/stages.h"
#include "benchmarks/suites.h"
#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "model/error.h"
#include "oracles/comparison/reference_solution.h"
#include "reference_cpu/reference.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;
using oracles::Cholmod;
using oracles::cluster_system;
using oracles::ClusterSystem;
using oracles::Factor;
using oracles::matrix_of;
using oracles::Sparse;

constexpr double kSpacing = 0.01;         // [m]
constexpr double kStiffness = 1e6;        // [1/s²]
constexpr double kSubstepLength = 0.004;  // [s]

template <typename Integer>
std::size_t at(Integer index) {
  return static_cast<std::size_t>(index);
}

}  // namespace

// --- A body that is cut ----------------------------------------------------------------------------------------------

CutCube make_cut_cube(int32_t side, int32_t core) {
  Scene spec;
  spec.name = fmt::format("cube_{}_cores_{}", side, core);
  spec.frame_length = kSubstepLength;
  spec.clusters.side = core;
  spec.step.substeps = 1;
  spec.step.iterations = 0;  // nothing moves: a geometric cut does not ask where the tissue is now
  spec.step.stiffness = kStiffness;
  spec.detect.criterion = Criterion::geometric;
  spec.skin.wanted = false;

  CutCube cube;
  cube.name = spec.name;
  Setup& setup = cube.setup;
  setup.body = fixtures::block(side, side, side, kSpacing);
  fixtures::take_stage_parameters(spec, setup);
  BladeSpec blade;
  blade.thickness = 0.5;
  blade.speed = kSpacing / spec.frame_length;
  StrokeSpec stroke;
  const double cut = (std::floor(0.5 * side) + 0.5 + 1.0 / 3) / side, beyond = 1.0 / side;
  stroke.points = {{-beyond, 0.5, cut}, {1 + beyond, 0.5, cut}};
  stroke.back = {-1, 0, 0};
  stroke.along = Vec3{0, 1, 0};
  blade.strokes = {stroke};
  spec.blade = blade;
  fixtures::resolve_schedule(spec, "command line", {}, setup);
  cube.state = fixtures::cook(setup.body, spec.clusters, spec.expand, spec.merge, spec.seed);
  return cube;
}

std::vector<Cut> cuts_of(const CutCube& cube) {
  const auto backend = reference::make_backend();
  backend->load({cube.setup}, {cube.state});
  auto run_to = [&, frame = int64_t{0}](int64_t end) mutable {
    for (; frame < end; ++frame) backend->run({});
    return backend->snapshot().front();
  };
  const int64_t all = cube.setup.frame_count(), half = all / 2;
  const State middle = run_to(half), next = run_to(half + 1), later = run_to(half + std::max<int64_t>(2, all / 4));
  return {{"one frame", middle, next}, {"quarter", middle, later}, {"whole", cube.state, run_to(all)}};
}

// --- What it does to the system --------------------------------------------------------------------------------------

namespace {

// [clusters after] the row of each, and the origins of new rows.
std::vector<int32_t> rows_after(const Clusters& before, const Clusters& after, std::vector<int32_t>& origin) {
  std::map<std::vector<int32_t>, int32_t> same;
  std::map<int32_t, std::vector<int32_t>> holders;  // of particles
  const auto list = [](const Clusters& clusters, int32_t c) {
    return std::vector<int32_t>(clusters.of(c).begin(), clusters.of(c).end());
  };
  for (int32_t c = 0; c < before.count(); ++c) same[list(before, c)] = c;
  std::vector<uint8_t> taken(at(before.count()), 0);
  std::vector<int32_t> row(at(after.count()), -1), others;
  for (int32_t c = 0; c < after.count(); ++c) {
    const auto found = same.find(list(after, c));
    if (found == same.end()) {
      others.push_back(c);
    } else {
      row[at(c)] = found->second;
      taken[at(found->second)] = 1;
    }
  }
  for (int32_t c = 0; c < before.count(); ++c) {
    if (taken[at(c)]) continue;
    for (const int32_t i : before.of(c)) holders[i].push_back(c);
  }
  std::stable_sort(others.begin(), others.end(), [&](int32_t a, int32_t b) { return after.size(a) > after.size(b); });
  origin.resize(at(before.count()));
  std::iota(origin.begin(), origin.end(), 0);
  for (const int32_t c : others) {
    std::map<int32_t, int64_t> common;
    for (const int32_t i : after.of(c)) {
      const auto found = holders.find(i);
      if (found == holders.end()) continue;  // an expansion took it in
      for (const int32_t b : found->second) ++common[b];
    }
    const auto most = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto from = std::max_element(common.begin(), common.end(), most);
    const int32_t parent = from == common.end() ? 0 : from->first;
    if (from != common.end() && taken[at(parent)] == 0) {
      row[at(c)] = parent;
      taken[at(parent)] = 1;
    } else {
      row[at(c)] = static_cast<int32_t>(origin.size());
      origin.push_back(parent);
    }
  }
  return row;
}

// The same system in other rows; a row that nothing lies in has the mass `empty`.
ClusterSystem in_rows(const ClusterSystem& system, const std::vector<int32_t>& row, std::size_t rows, double empty) {
  ClusterSystem result;
  result.mass.assign(rows, empty);
  for (std::size_t c = 0; c < row.size(); ++c) result.mass[at(row[c])] = system.mass[c];
  for (auto [clusters, weight] : system.shared) {
    for (int32_t& c : clusters) c = row[at(c)];
    std::sort(clusters.begin(), clusters.end());
    result.shared.push_back({std::move(clusters), weight});
  }
  return result;
}

// By how much weights of sets of clusters and masses differ: after − before.
struct Differences {
  std::vector<ClusterSystem::Shared> shared;
  std::vector<std::pair<int32_t, double>> mass;
};
Differences differences(const SystemChange& change) {
  // Sums of the same terms in another order are not a difference.
  constexpr double kSame = 1e-12;
  std::map<std::vector<int32_t>, std::pair<double, double>> weights;
  for (const auto& [clusters, weight] : change.before.shared) weights[clusters].first = weight;
  for (const auto& [clusters, weight] : change.after.shared) weights[clusters].second = weight;
  Differences found;
  for (const auto& [clusters, weight] : weights) {
    const double difference = weight.second - weight.first;
    if (std::abs(difference) > kSame * std::max(weight.first, weight.second)) {
      found.shared.push_back({clusters, difference});
    }
  }
  for (std::size_t r = 0; r < change.before.mass.size(); ++r) {
    const double difference = change.after.mass[r] - change.before.mass[r];
    if (std::abs(difference) > kSame * change.before.mass[r]) {
      found.mass.emplace_back(static_cast<int32_t>(r), difference);
    }
  }
  return found;
}

}  // namespace

SystemChange change_of(const Body& body, const State& before, const State& after, double s) {
  const std::vector<uint8_t> fixed(body.node.size(), 0);
  const ClusterSystem first = cluster_system(body, before.clusters, s, fixed);
  const ClusterSystem second = cluster_system(body, after.clusters, s, fixed);
  SystemChange change;
  change.s = s;
  const std::vector<int32_t> row = rows_after(before.clusters, after.clusters, change.origin);
  std::vector<int32_t> kept(first.mass.size());
  std::iota(kept.begin(), kept.end(), 0);
  const std::size_t rows = change.origin.size();
  const double mean = std::accumulate(first.mass.begin(), first.mass.end(), 0.0) / static_cast<double>(rows);
  change.before = in_rows(first, kept, rows, mean);
  change.after = in_rows(second, row, rows, mean);
  change.new_rows = static_cast<int32_t>(rows - first.mass.size());
  const Differences found = differences(change);
  std::vector<uint8_t> differs(rows, 0);
  for (const auto& [clusters, weight] : found.shared) {
    for (const int32_t r : clusters) differs[at(r)] = 1;
  }
  for (const auto& [r, mass] : found.mass) differs[at(r)] = 1;
  for (std::size_t r = 0; r < rows; ++r) {
    if (differs[r]) change.changed.push_back(static_cast<int32_t>(r));
  }
  return change;
}

// --- Factors of the changed system -----------------------------------------------------------------------------------

const char* name_of(Way way) {
  switch (way) {
    case Way::analyse:
      return "analyse";
    case Way::ordered:
      return "ordered";
    case Way::numeric:
      return "numeric";
    case Way::updown:
      return "updown";
    case Way::rows:
      return "rows";
  }
  return "";
}

namespace {

// Rank-one terms C C' of a change, in permuted rows: C, which the caller owns.
cholmod_sparse* columns_of(const std::vector<std::vector<std::pair<int32_t, double>>>& columns, std::size_t rows,
                           Cholmod& cholmod) {
  std::size_t entries = 0;
  for (const auto& column : columns) entries += column.size();
  cholmod_sparse* const matrix = cholmod_allocate_sparse(rows, columns.size(), entries, /*sorted=*/1, /*packed=*/1, 0,
                                                         CHOLMOD_REAL, cholmod.get());
  cholmod.check();
  auto* starts = static_cast<int*>(matrix->p);
  auto* indices = static_cast<int*>(matrix->i);
  auto* values = static_cast<double*>(matrix->x);
  int end = 0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    starts[k] = end;
    for (const auto& [row, value] : columns[k]) {
      indices[end] = row;
      values[end++] = value;
    }
  }
  starts[columns.size()] = end;
  return matrix;
}

// [rows] where each row of the system stands in the factor.
std::vector<int32_t> places_in(const cholmod_factor& factor) {
  const auto* permutation = static_cast<const int*>(factor.Perm);
  std::vector<int32_t> place(factor.n);
  for (std::size_t k = 0; k < factor.n; ++k) place[at(permutation[k])] = static_cast<int32_t>(k);
  return place;
}

// The elimination order of the system before, each new row right after its origin: what it shares particles with, its
// origin did, so it fills nothing that the origin did not.
std::vector<int> order_of(const SystemChange& change, const cholmod_factor& before) {
  const std::size_t old_rows = change.origin.size() - at(change.new_rows);
  std::vector<std::vector<int>> follow(old_rows);
  for (std::size_t r = old_rows; r < change.origin.size(); ++r) {
    follow[at(change.origin[r])].push_back(static_cast<int>(r));
  }
  const auto* permutation = static_cast<const int*>(before.Perm);
  std::vector<int> order;
  for (std::size_t k = 0; k < before.n; ++k) {
    if (at(permutation[k]) >= old_rows) continue;
    order.push_back(permutation[k]);
    const std::vector<int>& pieces = follow[at(permutation[k])];
    order.insert(order.end(), pieces.begin(), pieces.end());
  }
  return order;
}

// What stands in `common` for as long as this lives: the given order, and nothing else tried.
class GivenOrder {
 public:
  GivenOrder(Cholmod& cholmod, bool postorder) : common_(*cholmod.get()), before_(common_) {
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    common_.postorder = postorder ? 1 : 0;
  }
  ~GivenOrder() {
    common_.nmethods = before_.nmethods;
    common_.method[0].ordering = before_.method[0].ordering;
    common_.postorder = before_.postorder;
  }
  GivenOrder(const GivenOrder&) = delete;
  GivenOrder& operator=(const GivenOrder&) = delete;

 private:
  cholmod_common& common_;
  cholmod_common before_;
};

// As L D L', column by column with room to grow: what can be updated.
class Updatable {
 public:
  explicit Updatable(Cholmod& cholmod) : common_(*cholmod.get()) {
    common_.supernodal = CHOLMOD_SIMPLICIAL;
    common_.final_ll = 0;
    common_.final_pack = 0;
  }
  ~Updatable() {
    common_.supernodal = CHOLMOD_AUTO;
    common_.final_pack = 1;
  }
  Updatable(const Updatable&) = delete;
  Updatable& operator=(const Updatable&) = delete;

 private:
  cholmod_common& common_;
};

bool within_pattern(const cholmod_sparse& before, const cholmod_sparse& after) {
  const auto *p = static_cast<const int*>(before.p), *q = static_cast<const int*>(after.p);
  const auto *i = static_cast<const int*>(before.i), *j = static_cast<const int*>(after.i);
  for (std::size_t c = 0; c < before.ncol; ++c) {
    if (!std::includes(i + p[c], i + p[c + 1], j + q[c], j + q[c + 1])) return false;
  }
  return true;
}

void update_by_rank_one(const SystemChange& change, const Differences& found, cholmod_factor* factor,
                        Cholmod& cholmod) {
  const std::vector<int32_t> place = places_in(*factor);
  std::vector<std::vector<std::pair<int32_t, double>>> up, down;
  for (const auto& [clusters, weight] : found.shared) {
    // B has −weight u u'.
    auto& column = (weight < 0 ? up : down).emplace_back();
    for (const int32_t r : clusters) column.emplace_back(place[at(r)], std::sqrt(std::abs(weight)));
    std::sort(column.begin(), column.end());
  }
  for (const auto& [r, mass] : found.mass) {
    (mass > 0 ? up : down).push_back({{place[at(r)], std::sqrt(std::abs(mass))}});
  }
  // What adds comes first: then every matrix on the way is at least the last one, so all are positive definite.
  for (const bool add : {true, false}) {
    const Sparse columns(columns_of(add ? up : down, change.origin.size(), cholmod), cholmod);
    cholmod_updown(add ? 1 : 0, columns.get(), factor, cholmod.get());
    cholmod.check();
  }
}

// `rows`: all of B after, both triangles.
void replace_rows(const SystemChange& change, const Sparse& rows, cholmod_factor* factor, Cholmod& cholmod) {
  const std::vector<int32_t> place = places_in(*factor);
  std::vector<uint8_t> absent(change.origin.size(), 0);
  for (const int32_t r : change.changed) {
    cholmod_rowdel(at(place[at(r)]), nullptr, factor, cholmod.get());
    cholmod.check();
    absent[at(r)] = 1;
  }
  const auto* starts = static_cast<const int*>(rows->p);
  const auto* indices = static_cast<const int*>(rows->i);
  const auto* values = static_cast<const double*>(rows->x);
  for (const int32_t r : change.changed) {
    absent[at(r)] = 0;
    std::vector<std::pair<int32_t, double>> row;
    for (int k = starts[r]; k < starts[r + 1]; ++k) {
      if (!absent[at(indices[k])]) row.emplace_back(place[at(indices[k])], values[k]);
    }
    std::sort(row.begin(), row.end());
    const Sparse column(columns_of({row}, change.origin.size(), cholmod), cholmod);
    cholmod_rowadd(at(place[at(r)]), column.get(), factor, cholmod.get());
    cholmod.check();
  }
}

int64_t entries_of(const cholmod_factor& factor) {
  if (factor.is_super) return static_cast<int64_t>(factor.xsize);
  const auto* counts = static_cast<const int*>(factor.nz);
  return std::accumulate(counts, counts + factor.n, int64_t{0});
}

double greatest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

// [rows] Σ |B_rc| of each row; all of `shared` are negative off the diagonal.
std::vector<double> row_sums(const ClusterSystem& system) {
  std::vector<double> sums = system.mass;
  for (const auto& [clusters, weight] : system.shared) {
    for (const int32_t r : clusters) sums[at(r)] += weight * (static_cast<double>(clusters.size()) - 2);
  }
  return sums;
}

double residual_of(const ClusterSystem& system, const std::vector<double>& right, const std::vector<double>& x) {
  std::vector<double> rest = right;
  for (std::size_t r = 0; r < rest.size(); ++r) rest[r] -= system.mass[r] * x[r];
  for (const auto& [clusters, weight] : system.shared) {
    double sum = 0;
    for (const int32_t r : clusters) sum += x[at(r)];
    for (const int32_t r : clusters) rest[at(r)] += weight * sum;
  }
  for (const double value : rest) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::infinity();
  }
  return greatest(rest) / (greatest(row_sums(system)) * greatest(x));
}

}  // namespace

std::optional<Factorised> factorise(const SystemChange& change, Way way, const std::vector<double>& right) {
  Cholmod cholmod;
  const Sparse before = matrix_of(change.before, cholmod), after = matrix_of(change.after, cholmod);
  const Differences found = differences(change);
  const Sparse both_triangles(cholmod_copy(after.get(), 0, 1, cholmod.get()), cholmod);
  const Factor analysed(cholmod_analyze(before.get(), cholmod.get()), cholmod);
  const auto analyse_in_order = [&](const Sparse& matrix, bool postorder) {
    const GivenOrder given(cholmod, postorder);
    std::vector<int> order = order_of(change, *analysed.get());
    return cholmod_analyze_p(matrix.get(), order.data(), nullptr, 0, cholmod.get());
  };

  std::unique_ptr<Factor> factor;
  const auto make = [&](cholmod_factor* made) { factor = std::make_unique<Factor>(made, cholmod); };
  const auto numerically = [&](const Sparse& matrix) {
    cholmod_factorize(matrix.get(), factor->get(), cholmod.get());
    cholmod.check();
  };
  Clock::time_point begin;
  switch (way) {
    case Way::analyse:
      begin = Clock::now();
      make(cholmod_analyze(after.get(), cholmod.get()));
      numerically(after);
      break;
    case Way::ordered:
      begin = Clock::now();
      make(analyse_in_order(after, true));
      numerically(after);
      break;
    case Way::numeric:
      if (!within_pattern(*before.get(), *after.get())) return std::nullopt;
      make(cholmod_copy_factor(analysed.get(), cholmod.get()));
      numerically(before);
      begin = Clock::now();
      numerically(after);
      break;
    case Way::updown:
    case Way::rows: {
      const Updatable updatable(cholmod);
      make(analyse_in_order(before, false));
      numerically(before);
      begin = Clock::now();
      if (way == Way::updown) {
        update_by_rank_one(change, found, factor->get(), cholmod);
      } else {
        replace_rows(change, both_triangles, factor->get(), cholmod);
      }
      break;
    }
  }
  Factorised result;
  result.seconds = seconds_since(begin);
  begin = Clock::now();
  result.x = oracles::solve(cholmod, factor->get(), right);
  result.solve_seconds = seconds_since(begin);
  result.residual = residual_of(change.after, right, result.x);
  result.entries = entries_of(*factor->get());
  return result;
}

double residual_bound(const SystemChange& change, Way way) {
  const auto n = static_cast<double>(change.origin.size());
  const auto gamma = [](double k) { return k * 0x1p-53 / (1 - k * 0x1p-53); };
  const double growth = 2 * (1 + std::sqrt(n));
  const double amplified = 1 / (1 - change.s);
  double bound = gamma(3 * n + 1) * growth;
  if (way == Way::rows)
    bound += gamma(6 * n + 1) * growth * static_cast<double>(change.changed.size()) * (1 + amplified);
  if (way == Way::updown) {
    std::vector<double> sums = row_sums(change.before);
    double steps = 0;
    const Differences found = differences(change);
    for (const auto& [clusters, weight] : found.shared) {
      ++steps;
      for (const int32_t r : clusters) {
        if (weight < 0) sums[at(r)] -= weight * static_cast<double>(clusters.size());
        if (weight > 0) steps += weight * amplified / change.after.mass[at(r)];
      }
    }
    for (const auto& [r, mass] : found.mass) {
      ++steps;
      if (mass > 0) sums[at(r)] += mass;
      if (mass < 0) steps += -mass * amplified / change.after.mass[at(r)];
    }
    const double larger = std::max(1.0, greatest(sums) / greatest(row_sums(change.after)));
    bound += gamma(6 * n + 1) * growth * steps * larger;
  }
  return bound;
}

// --- The suite -------------------------------------------------------------------------------------------------------

namespace {

struct FactorsOptions {
  std::vector<int32_t> sides = {10, 20, 30, 40, 50}, fine_sides = {20, 54};
  int64_t repeats = 5;
  uint64_t seed = 1;
  std::string json;
};
constexpr int32_t kCore = 5, kFineCore = 2;

void check(const FactorsOptions& options) {
  for (const auto& [name, sides] : {std::pair{"--sides", &options.sides}, {"--fine-sides", &options.fine_sides}}) {
    for (const int32_t side : *sides) {
      if (side >= 8 && side <= 200) continue;
      throw InputError("command line", name, fmt::format("{} is out of bounds", side), "give numbers from 8 to 200");
    }
  }
}

// What a whole converged answer of the state takes, when everything in it moves.
json whole_substep(const CutCube& cube, State state, std::mt19937_64& random) {
  std::uniform_real_distribution<double> speed(-0.1 * kSpacing / kSubstepLength, 0.1 * kSpacing / kSubstepLength);
  for (Vec3& v : state.v) v = {speed(random), speed(random), speed(random)};
  state.frame = 0;
  const Setup& setup = cube.setup;
  const auto begin = Clock::now();
  const oracles::ReferenceSolution answer = oracles::reference_solution(setup, state);
  const double seconds = seconds_since(begin);
  fmt::print("  a converged answer of one substep: {:.4g} s, {} alternations{}\n", seconds, answer.alternations,
             answer.converged ? "" : ", NOT converged");
  return {{"seconds", seconds}, {"alternations", answer.alternations}, {"converged", answer.converged}};
}

int bench_factors(const FactorsOptions& options) {
  check(options);
  require_writable(options.json);
  json document = begin_report("factors", "reference");
  document["repeats"] = options.repeats;
  document["seed"] = options.seed;
  document["stiffness"] = kStiffness;
  document["substep_seconds"] = kSubstepLength;
  document["holds"] = true;
  document["scenes"] = json::array();
  const double kdt2 = kStiffness * kSubstepLength * kSubstepLength;
  std::vector<std::pair<int32_t, int32_t>> scenes;
  for (const int32_t side : options.sides) scenes.emplace_back(side, kCore);
  for (const int32_t side : options.fine_sides) scenes.emplace_back(side, kFineCore);
  bool holds = true;
  for (const auto& [side, core] : scenes) {
    std::mt19937_64 random(options.seed);
    const CutCube cube = make_cut_cube(side, core);
    const int64_t particles = cube.setup.body.particle_count(), clusters = cube.state.clusters.count();
    fmt::print("\n{}: {} particles, {} clusters\n", cube.name, particles, clusters);
    Table table({"cut", "removed", "rows changed", "new", "way", "median ms", "least", "solve ms", "entries",
                 "residual", "bound"});
    json rows = json::array();
    const std::vector<Cut> cuts = cuts_of(cube);
    for (const Cut& cut : cuts) {
      const SystemChange change = change_of(cube.setup.body, cut.before, cut.after, kdt2 / (1 + kdt2));
      const int64_t removed = std::count(cut.before.alive.begin(), cut.before.alive.end(), 1) -
                              std::count(cut.after.alive.begin(), cut.after.alive.end(), 1);
      std::vector<double> right(change.origin.size());
      for (double& value : right) value = std::uniform_real_distribution<double>(-1, 1)(random);
      for (const Way way : kWays) {
        std::vector<double> seconds, solving;
        std::optional<Factorised> last;
        for (int64_t repeat = 0; repeat < options.repeats; ++repeat) {
          last = factorise(change, way, right);
          if (!last) break;
          seconds.push_back(last->seconds);
          solving.push_back(last->solve_seconds);
        }
        if (!last) continue;
        const double bound = residual_bound(change, way);
        const bool within = last->residual <= bound;
        holds &= within;
        const Times times = times_of(seconds), solve = times_of(solving);
        table.add({cut.name, fmt::format("{}", removed), fmt::format("{}", change.changed.size()),
                   fmt::format("{}", change.new_rows), name_of(way), ms(times), fmt::format("{:.4g}", 1e3 * times.min),
                   ms(solve), fmt::format("{}", last->entries), fmt::format("{:.1e}", last->residual),
                   fmt::format("{:.1e}{}", bound, within ? "" : " EXCEEDED")});
        rows.push_back({{"cut", cut.name},
                        {"removed", removed},
                        {"rows", change.origin.size()},
                        {"changed_rows", change.changed.size()},
                        {"new_rows", change.new_rows},
                        {"way", name_of(way)},
                        {"seconds", to_json(times)},
                        {"solve_seconds", to_json(solve)},
                        {"entries", last->entries},
                        {"residual", last->residual},
                        {"residual_bound", bound}});
      }
    }
    fmt::print("{}", table.text());
    json substep = whole_substep(cube, cuts.back().after, random);
    std::fflush(stdout);
    document["scenes"].push_back({{"scene", cube.name},
                                  {"particles", particles},
                                  {"clusters", clusters},
                                  {"memberships", cube.state.clusters.members.size()},
                                  {"rows", rows},
                                  {"converged_substep", substep}});
    document["holds"] = holds;
    // After each, so that what has been measured is kept if a later one fails.
    document["complete"] = document["scenes"].size() == scenes.size();
    write_report(options.json, document);
  }
  if (!options.json.empty()) fmt::print("\nwrote {}\n", options.json);
  return holds ? 0 : 1;
}

}  // namespace

Suite factors_suite() {
  return {"factors", "a cut body's linear system: its factor updated, or made anew", [](CLI::App& command) {
            const auto options = std::make_shared<FactorsOptions>();
            command.add_option("--sides", options->sides, "particles along a cube, clusters of cores of 5³")
                ->delimiter(',')
                ->capture_default_str()
                ->type_name("N,N...");
            command.add_option("--fine-sides", options->fine_sides, "the same with many clusters, of cores of 2³")
                ->delimiter(',')
                ->capture_default_str()
                ->type_name("N,N...");
            command.add_option("--repeats", options->repeats, "of each measurement")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::Range(1, 1000));
            command.add_option("--seed", options->seed, "of right-hand sides and velocities")->capture_default_str();
            command.add_option("--json", options->json, "write every row")->type_name("F");
            return [options] { return bench_factors(*options); };
          }};
}

}  // namespace cutproof::cli
